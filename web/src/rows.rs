//! What the page draws of a run: rows of samples, and impacts.

use motor_model::{DriveMode, Parameter, Time, math};
use simulation::runs::closed_loop::{ClosedLoop, PositioningMoment};
use simulation::runs::record::{Impact, health_level};
use simulation::runs::simulate::FAST_APPROACH_M_S;
use simulation::world::plant::Plant;

use crate::columns::{IMPACT, ROW};

/// Most impacts that are kept until they are taken.
pub const IMPACTS_MAX: usize = 256;

const MICRO: f64 = 1e6;
const MILLI: f64 = 1e3;

/// Rows and impacts that were not taken yet, and the row under way.
#[derive(Debug)]
pub struct Rows {
    samples: Vec<f64>,
    impacts: Vec<f64>,
    strongest: f32,
    impact_count: u32,
    impulse_n_s: f64,
    frame: Frame,
}

/// What is shown of the last frame of a row.
#[derive(Clone, Copy, Debug)]
struct Frame {
    innovation_mdeg: f64,
    sd_mdeg: f64,
    used: f64,
    shift_um: [f64; 2],
}

impl Frame {
    const NONE: Self =
        Self { innovation_mdeg: f64::NAN, sd_mdeg: f64::NAN, used: f64::NAN, shift_um: [f64::NAN; 2] };
}

impl Rows {
    /// None yet.
    pub fn new() -> Self {
        Self {
            samples: Vec::new(),
            impacts: Vec::new(),
            strongest: 0.0,
            impact_count: 0,
            impulse_n_s: 0.0,
            frame: Frame::NONE,
        }
    }

    /// The rows, one after the other.
    pub fn take_rows(&mut self) -> Vec<f64> {
        std::mem::take(&mut self.samples)
    }

    /// The impacts, the last ones of many.
    pub fn take_impacts(&mut self) -> Vec<f64> {
        std::mem::take(&mut self.impacts)
    }

    /// Adds a tick to the row under way.
    pub fn add(&mut self, closed_loop: &ClosedLoop, moment: &PositioningMoment) {
        let applied = moment.report.applied;
        let amplitude = match applied.mode() {
            Some(DriveMode::B) => applied.amplitude(),
            Some(DriveMode::C) => -applied.amplitude(),
            None => 0.0,
        };
        if amplitude.abs() > self.strongest.abs() {
            self.strongest = amplitude;
        }
        let plant = closed_loop.plant();
        let rises = |impact: &&Impact| impact.velocity_m_s[1] - impact.velocity_m_s[0] > FAST_APPROACH_M_S;
        for impact in closed_loop.impacts().iter().filter(rises) {
            let impulse_n_s = impact.impulse_n_s(plant.params().get(Parameter::RotorMass));
            self.impact_count += 1;
            self.impulse_n_s += impulse_n_s;
            if self.impacts.len() >= IMPACTS_MAX * IMPACT.len() {
                self.impacts.drain(..IMPACT.len());
            }
            let (seconds, tooth) = (impact.at.seconds_since(Time::ZERO), nearest_tooth(plant));
            self.impacts.extend([seconds, MICRO * impulse_n_s, impact.kick_rad_s(), tooth]);
        }
        if let Some(innovation) = moment.report.camera {
            let record = closed_loop.record(moment);
            let shift_m = record.marked.map_or([f64::NAN; 2], |marked| marked.shift_m);
            self.frame = Frame {
                innovation_mdeg: mdeg(innovation.innovation_rad),
                sd_mdeg: mdeg(math::sqrt_f32(innovation.variance_rad2)),
                used: if record.is_refused() { 0.0 } else { 1.0 },
                shift_um: shift_m.map(|m| MICRO * m),
            };
        }
    }

    /// Ends the row with `moment`, and begins the next one.
    pub fn end_row(&mut self, plant: &Plant, moment: &PositioningMoment) {
        let estimate = moment.report.estimate;
        let of = |value: Option<f64>| value.unwrap_or(f64::NAN);
        let tilt = moment.tilt.map_or([[0.0; 2]; 2], |tilt| [tilt.pose.slope, tilt.pose.shift_m]);
        let [[slope_x, slope_y], [shift_x, shift_y]] = tilt;
        let [tooth_0, tooth_1, tooth_2, tooth_3] = plant.tooth_heights_m().map(|m| MICRO * m);
        let row: [f64; ROW.len()] = [
            moment.seconds(),
            moment.angle.degrees(),
            moment.rate_rad_s,
            of(moment.estimate_error_mdeg()),
            of(estimate.map(|estimate| mdeg(math::sqrt_f32(estimate.angle_rad2)))),
            of(estimate.map(|estimate| estimate.rate_rad_s.into())),
            self.strongest.into(),
            health_level(moment.report.health).into(),
            MICRO * plant.height_m(),
            tooth_0,
            tooth_1,
            tooth_2,
            tooth_3,
            MILLI * slope_x,
            MILLI * slope_y,
            MICRO * shift_x,
            MICRO * shift_y,
            self.frame.innovation_mdeg,
            self.frame.sd_mdeg,
            self.frame.used,
            self.frame.shift_um[0],
            self.frame.shift_um[1],
            self.impact_count.into(),
            MICRO * self.impulse_n_s,
        ];
        self.samples.extend(row);
        (self.strongest, self.impact_count, self.impulse_n_s) = (0.0, 0, 0.0);
        self.frame = Frame::NONE;
    }
}

/// An angle in milli-degrees.
fn mdeg(rad: f32) -> f64 {
    MILLI * f64::from(rad).to_degrees()
}

/// The tooth with the smallest gap to the rotor.
fn nearest_tooth(plant: &Plant) -> f64 {
    let radius_m = plant.params().get(Parameter::ToothRadius);
    let first_deg = plant.params().effective_tooth_angle_deg();
    let [slope_x, slope_y] = plant.tilt().map_or([0.0; 2], |tilt| tilt.pose.slope);
    let gap_m = |number: u8, height_m: f64| {
        let (sine, cosine) = math::sin_cos((first_deg + 90.0 * f64::from(number)).to_radians());
        radius_m * (slope_x * cosine + slope_y * sine) - height_m
    };
    let gaps =
        (0_u8..).zip(plant.tooth_heights_m()).map(|(number, height_m)| (number, gap_m(number, height_m)));
    let nearest = gaps.min_by(|(_, one), (_, other)| one.total_cmp(other));
    nearest.map_or(f64::NAN, |(number, _)| number.into())
}
