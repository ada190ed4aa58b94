//! The rotor's rotation: free, with slipping teeth, or held by a tooth that sticks.
//!
//! ```text
//! m_t (v' + k v) = sum_p F_p,     v = R_t rate,   m_t = J / R_t^2,   k = b_th R_t^2 / J                  (14b)
//! F_p in L_p Sgn(s_p' - v),       L_p = mu N_p: Coulomb's law, per unit of time
//! ```
//!
//! `Sgn` is the sign, and at zero any value between -1 and 1. In the motor model the tangential force does not act on
//! the teeth. So the vertical motion comes first, and the rotation follows from its series. A switching is a slip that
//! reaches zero, or a holding force that reaches its limit. Between two switchings every term is a power series, and so
//! is `v`. `F` falls as `v` grows, so the motion after a switching is unique: exactly one choice of forces has the
//! signs of the slips, or of their first derivatives.

use super::series::{ORDER, Series};
use super::system::{Segment, System};
use super::tie_breaking::TieBreaker;
use simulation::runs::RunError;

/// Slips below this count as zero.
const SLIP_TOLERANCE_M_S: f64 = 1e-13;
/// Teeth and rotor are at rest if they all move slower than this.
const REST_M_S: f64 = 1e-12;

/// The constants of the rotor's rotation.
#[derive(Clone, Copy, Debug)]
pub struct Rotation {
    /// `R_t`.
    pub radius_m: f64,
    /// `m_t`.
    pub tangential_mass_kg: f64,
    /// `k`.
    pub damping_per_s: f64,
    /// `mu`.
    pub friction: f64,
}

/// How a pair of teeth acts on the rotation.
#[derive(Clone, Copy, Debug, PartialEq)]
enum PairFriction {
    /// The pair is not in contact.
    Open,
    /// The pair slips. The slip has this sign.
    Slipping(f64),
    /// The pair starts to slip in the direction of this sign. The series of its slip has a root of this multiplicity
    /// at the start.
    StartsToSlip(f64, usize),
    /// The pair does not slip: it holds the rotor.
    Sticking,
}

impl PairFriction {
    fn sign(self) -> f64 {
        match self {
            Self::Slipping(sign) | Self::StartsToSlip(sign, _) => sign,
            Self::Open | Self::Sticking => 0.0,
        }
    }
}

/// Series of one pair about an instant of a segment.
#[derive(Clone, Copy, Debug)]
struct Tooth {
    /// `s'`.
    velocity: Series,
    /// `L / m_t`.
    limit: Series,
}

impl Rotation {
    /// The rotor's tangential speed at `tau = end` of `segment`, from `v` at its start, and the arc that it makes.
    ///
    /// # Errors
    /// When switchings follow each other without end at one instant.
    pub fn over(&self, system: &System, segment: &Segment, end: f64, v: f64) -> Result<(f64, f64), RunError> {
        let (mut v, mut arc) = (v, 0.0);
        if at_rest(system, segment, v) {
            return Ok((0.0, 0.0));
        }
        let (mut start, mut known, mut ties) = (0.0, None, TieBreaker::default());
        while start < end {
            let ignored = ties.ignored_part();
            let piece = self.piece(system, segment, (start, end), ignored, known, v);
            ties.record_advance(piece.width)?;
            v = piece.speed.at(piece.width);
            arc += segment.duration_s * piece.speed.integral_to(piece.width);
            start = if piece.whole { end } else { start + piece.width };
            known = piece.slips;
        }
        Ok((v, arc))
    }

    /// The motion from `start` to the next switching or to `end`, or over the part in which switchings are ignored.
    fn piece(
        &self,
        system: &System,
        segment: &Segment,
        (start, end): (f64, f64),
        ignored: Option<f64>,
        known: Option<(usize, f64)>,
        v: f64,
    ) -> Piece {
        let teeth = [0, 1].map(|p| self.tooth(system, segment, start, p));
        let width = (end - start).min(ignored.unwrap_or(f64::INFINITY));
        let frictions = self.frictions(segment, &teeth, known, v);
        let h = segment.duration_s;

        let sticking = (0..2).find(|&p| frictions[p] == PairFriction::Sticking);
        let pulls = (0..2).fold(Series::ZERO, |sum, p| sum.plus(frictions[p].sign(), &teeth[p].limit));
        let speed = match sticking {
            Some(p) => teeth[p].velocity,
            None => self.sliding(&pulls, h, v),
        };
        let mut next = Piece { speed, width, whole: width >= end - start, slips: None };
        let mut switch = |tau: Option<f64>, slips| {
            if let Some(tau) = tau.filter(|&tau| tau < next.width && ignored.is_none()) {
                next.width = tau;
                next.whole = false;
                next.slips = slips;
            }
        };
        for (p, friction) in frictions.into_iter().enumerate() {
            let slip = |sign: f64| teeth[p].velocity.times(sign).plus(-sign, &speed);
            match friction {
                PairFriction::Open => {}
                PairFriction::Slipping(sign) => switch(slip(sign).first_descent(width), None),
                PairFriction::StartsToSlip(sign, roots) => {
                    switch(slip(sign).without_root_at_start(roots).first_descent(width), None);
                }
                PairFriction::Sticking => {
                    let needed = self.needed(&teeth[p].velocity, h).plus(-1.0, &pulls);
                    for sign in [-1.0, 1.0] {
                        let spare = teeth[p].limit.plus(-sign, &needed);
                        switch(spare.first_descent(width), Some((p, sign)));
                    }
                }
            }
        }
        next
    }

    /// `v' + k v` of a rotor that moves with `velocity`.
    fn needed(&self, velocity: &Series, duration_s: f64) -> Series {
        velocity.derivative().times(1.0 / duration_s).plus(self.damping_per_s, velocity)
    }

    /// Speed under the sum of sliding forces per mass.
    fn sliding(&self, pulls: &Series, duration_s: f64, v: f64) -> Series {
        let mut speed = Series::ZERO;
        speed.0[0] = v;
        let mut power = 0.0;
        for k in 0..ORDER {
            power += 1.0;
            speed.0[k + 1] = duration_s / power * (pulls.0[k] - self.damping_per_s * speed.0[k]);
        }
        speed
    }

    /// The series of pair `p` about `start`.
    fn tooth(&self, system: &System, segment: &Segment, start: f64, p: usize) -> Tooth {
        if !segment.contact[p] {
            return Tooth { velocity: Series::ZERO, limit: Series::ZERO };
        }
        let normal =
            segment.normal_force_per_mass_m_s2[p].times(system.rotor_mass_kg / self.tangential_mass_kg);
        let velocity = Segment::combine(&segment.velocity_m_s, system.teeth[p].lever.as_slice());
        Tooth { velocity: velocity.about(start), limit: normal.about(start).times(self.friction) }
    }

    /// The friction of each pair from now on. `known`: a pair that has just started to slip, and the sign of its slip.
    fn frictions(
        &self,
        segment: &Segment,
        teeth: &[Tooth; 2],
        known: Option<(usize, f64)>,
        v: f64,
    ) -> [PairFriction; 2] {
        let mut frictions = [PairFriction::Open; 2];
        let mut undecided = [false; 2];
        for p in (0..2).filter(|&p| segment.contact[p]) {
            let slip = teeth[p].velocity.0[0] - v;
            match known {
                Some((slipping, sign)) if slipping == p => frictions[p] = PairFriction::StartsToSlip(sign, 2),
                _ if slip.abs() <= SLIP_TOLERANCE_M_S => undecided[p] = true,
                _ => frictions[p] = PairFriction::Slipping(slip.signum()),
            }
        }
        let acceleration = |p: usize| teeth[p].velocity.0[1] / segment.duration_s;
        let limit = |p: usize| teeth[p].limit.0[0];
        let decided: f64 = (0..2).map(|p| frictions[p].sign() * limit(p)).sum();
        // Pair p sticks: the other pair, if undecided, slips in the direction in which its tooth moves away from p.
        for p in (0..2).filter(|&p| undecided[p]) {
            let other = 1 - p;
            let parting =
                if undecided[other] { (acceleration(other) - acceleration(p)).signum() } else { 0.0 };
            let needed = acceleration(p) + self.damping_per_s * v - decided - parting * limit(other);
            if needed.abs() <= limit(p) {
                if undecided[other] {
                    frictions[other] = PairFriction::StartsToSlip(parting, 1);
                }
                frictions[p] = PairFriction::Sticking;
                return frictions;
            }
        }
        // No pair sticks: each slips in the direction in which its tooth accelerates away from the rotor.
        let choices = [[-1.0, -1.0], [-1.0, 1.0], [1.0, -1.0], [1.0, 1.0]];
        let consistent = |signs: &[f64; 2]| {
            let pull: f64 = (0..2).filter(|&p| undecided[p]).map(|p| signs[p] * limit(p)).sum();
            let rotor = decided + pull - self.damping_per_s * v;
            (0..2).all(|p| !undecided[p] || (acceleration(p) - rotor) * signs[p] >= 0.0)
        };
        let signs = choices.into_iter().find(consistent).unwrap_or([1.0, 1.0]);
        for p in (0..2).filter(|&p| undecided[p]) {
            frictions[p] = PairFriction::StartsToSlip(signs[p], 1);
        }
        frictions
    }
}

/// Motion between two switchings.
struct Piece {
    speed: Series,
    width: f64,
    /// Whether it reaches the end of the motion asked for.
    whole: bool,
    /// The pair that starts to slip at the end, and the sign of its slip.
    slips: Option<(usize, f64)>,
}

/// Whether teeth and rotor rest on each other.
fn at_rest(system: &System, segment: &Segment, v: f64) -> bool {
    let quiet = |p: usize| {
        !segment.contact[p]
            || Segment::combine(&segment.velocity_m_s, system.teeth[p].lever.as_slice()).bound() < REST_M_S
    };
    v.abs() < REST_M_S && segment.contact != [false, false] && quiet(0) && quiet(1)
}
