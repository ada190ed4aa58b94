//! Momentum and angular momentum over every located contact: inside a step, several at once, sustained or not.
//!
//! A ledger follows each span of flight and the contacts at its end. What the rotor has beyond its free flight, in
//! closed form, is what the contacts gave it, and the stator lost what the teeth gave.
//!
//! ```text
//! m_r dv = sum F,    J dW = sum n . (r x F),    I n x dn' = sum (r x F across n),    M_n dg_n' = -sum phi_n P
//! ```
//!
//! With `n = (-eta_x, -eta_y, 1)` the rotor's axis. F is P along the normal of the rotor's plane at a tooth, of the
//! hole's edge at the pin, and friction along that surface. The teeth pass friction and the sideways part of P on to
//! the frame, the pin takes its own.
#![expect(clippy::disallowed_methods, reason = "an independent yardstick")]

use motor_model::{
    ContactPlace, DriveCommand, DriveMode, Parameter, Real, TiltingContact, TiltingLedger, TiltingMotor,
    TiltingParameter, TiltingSetup, TiltingState,
};
use nalgebra::{Vector2, Vector3};

use super::{Sets, UNEQUAL, own_stator, set_g, slow_in_b};
use crate::support::motors::{epsilon, steps_in};

/// Position and velocities in `f64`.
#[derive(Clone, Copy)]
struct Motion {
    shift: Vector2<f64>,
    slope: Vector2<f64>,
    /// Of the mass centre.
    velocity: Vector3<f64>,
    slope_rate: Vector2<f64>,
    /// Counter-clockwise.
    spin: f64,
    /// Displacements and velocities of modes A, B, C and both tilting modes.
    modes: [(f64, f64); 5],
}

impl Motion {
    fn of<T: Real>(state: &TiltingState<T>) -> Self {
        let flat = |of: Vector2<T>| of.map(Real::to_f64);
        let (g, v) = (state.modes.displacement_m, state.modes.velocity_m_s);
        let (tilt_g, tilt_v) = (state.stator_tilt.displacement_m, state.stator_tilt.velocity_m_s);
        let along = flat(state.shift.velocity_m_s);
        Self {
            shift: flat(state.shift.displacement_m),
            slope: flat(state.tilt.slope),
            velocity: Vector3::new(along.x, along.y, state.rotor.velocity_m_s.to_f64()),
            slope_rate: flat(state.tilt.rate_rad_s),
            spin: -state.rotor.rate_rad_s.to_f64(),
            modes: [(g.x, v.x), (g.y, v.y), (g.z, v.z), (tilt_g.x, tilt_v.x), (tilt_g.y, tilt_v.y)]
                .map(|(g, v)| (g.to_f64(), v.to_f64())),
        }
    }
}

impl Motion {
    /// The largest speed of any part.
    fn speed(&self, radius_m: f64) -> f64 {
        let modes = self.modes.iter().fold(0.0, |most: f64, (_, v)| most.max(v.abs()));
        self.velocity.amax().max(modes).max(radius_m * (self.slope_rate.amax() + self.spin.abs()))
    }
}

/// The constants of a motor.
#[derive(Clone, Copy)]
struct Constants {
    mass: f64,
    /// Modal masses of A, B, C and both tilting modes.
    modal: [f64; 5],
    spin_inertia: f64,
    inertia: f64,
    film: f64,
    tilt_film: f64,
    drag: f64,
    gravity: f64,
    /// Natural frequency in rad/s and damping ratio.
    modes: [(f64, f64); 5],
    tooth_radius: f64,
    half_thickness: f64,
    half_hole: f64,
    pin_radius: f64,
    hole_radius: f64,
    /// Direction of each tooth, and the shapes of the five modes there.
    teeth: [(Vector2<f64>, [f64; 5]); 4],
}

impl Constants {
    fn of((params, tilting): &Sets) -> Self {
        use Parameter as P;
        use TiltingParameter as Q;
        let (of, own) = (|parameter| params.get(parameter), |parameter| tilting.get(parameter));
        let tau = core::f64::consts::TAU;
        let (mass, stator, thickness) = (of(P::RotorMass), of(P::StatorMass), own(Q::RotorThickness));
        let (outer, pin) = (own(Q::RotorOuterRadius), own(Q::HubPinRadius));
        let a = tau * of(P::ModeAFrequency);
        let tilting = |part: f64| {
            (
                tau * own(Q::StatorTiltFrequency) * (1.0 + part * own(Q::StatorTiltSplit)),
                own(Q::StatorTiltDampingRatio),
            )
        };
        let pair_mass = stator * own(Q::StatorTiltMassFraction);
        let mass_a = stator * of(P::ModeAMassFraction);
        let first = 90.0 - of(P::ToothAngle) - of(P::ModeShift);
        Self {
            mass,
            modal: [
                mass_a,
                stator * of(P::ModeBMassFraction),
                stator * of(P::ModeCMassFraction),
                pair_mass,
                pair_mass,
            ],
            spin_inertia: of(P::RotorInertia),
            inertia: of(P::RotorInertia) / 2.0 + mass * thickness * thickness / 12.0,
            film: of(P::VerticalDamping),
            tilt_film: own(Q::TiltDampingFactor) * of(P::VerticalDamping) * (outer * outer + pin * pin) / 4.0,
            drag: of(P::TangentialDrag) * of(P::ToothRadius) * of(P::ToothRadius),
            gravity: of(P::Gravity),
            modes: [
                (a, of(P::ModeADamping) / (2.0 * mass_a * a)),
                (tau * of(P::ModeBFrequency), of(P::ModeBDampingRatio)),
                (tau * of(P::ModeCFrequency), of(P::ModeCDampingRatio)),
                tilting(-0.5),
                tilting(0.5),
            ],
            tooth_radius: of(P::ToothRadius),
            half_thickness: 0.5 * thickness,
            half_hole: 0.5 * own(Q::HubLength),
            pin_radius: pin,
            hole_radius: pin + own(Q::HubClearance),
            teeth: [(0.0, 0), (90.0, 1), (180.0, 2), (270.0, 3)].map(|(offset, k): (f64, usize)| {
                let angle = (first + offset).to_radians();
                let scale = 1.0 + UNEQUAL.amplitudes[k];
                let (sin, cos) = angle.sin_cos();
                let twice = |extra_deg: f64| 2.0 * (angle - extra_deg.to_radians());
                let (of_b, of_c) =
                    (twice(of(P::ModeBExtraShift)).sin(), twice(own(Q::ModeCExtraShift)).cos());
                (Vector2::new(cos, sin), [1.0, scale * of_b, scale * of_c, cos, sin])
            }),
        }
    }

    /// Free flight, in closed form; modes without a drive.
    fn fly(&self, from: &Motion, time_s: f64) -> Motion {
        let mut to = *from;
        to.shift += from.velocity.xy() * time_s;
        let fall = self.film / self.mass;
        let limit = -self.gravity / fall;
        to.velocity.z += (from.velocity.z - limit) * (-fall * time_s).exp_m1();
        to.spin = from.spin * (-self.drag / self.spin_inertia * time_s).exp();
        let (decay, turn) = (self.tilt_film / self.inertia, self.spin_inertia * from.spin / self.inertia);
        let after = |time_s: f64| {
            let ((sin, cos), kept) = ((turn * time_s).sin_cos(), (-decay * time_s).exp());
            let p = from.slope_rate;
            Vector2::new(cos * p.x - sin * p.y, sin * p.x + cos * p.y) * kept
        };
        to.slope_rate = after(time_s);
        // Simpson's rule: exact to 1e-15 of a step's change.
        to.slope += (from.slope_rate + after(0.5 * time_s) * 4.0 + to.slope_rate) * (time_s / 6.0);
        for ((g, v), (natural, ratio)) in to.modes.iter_mut().zip(self.modes) {
            let damped = natural * (1.0 - ratio * ratio).sqrt();
            let (sin, cos) = (damped * time_s).sin_cos();
            let kept = (-ratio * natural * time_s).exp();
            *v = kept * (*v * cos - (natural * natural * *g + ratio * natural * *v) / damped * sin);
        }
        to
    }
}

/// An impulse, where it acts from the mass centre, and by how much the model's may differ.
struct Impulse {
    force: Vector3<f64>,
    arm: Vector3<f64>,
    left_out: f64,
}

/// What the contacts since the last flight gave.
struct Given {
    /// Where the rotor flew freely.
    free: Motion,
    force: Vector3<f64>,
    /// Moment about the mass centre, along the rotor's axis n and across it, as it changes the slopes.
    about_axis: f64,
    across: Vector2<f64>,
    /// On each mode.
    modal: [f64; 5],
    /// Sum of the impulses.
    total: f64,
    /// By how much the model's force and its moments along n and across it may differ: what it leaves out.
    force_left_out: f64,
    push_left_out: f64,
    left_out: f64,
    contacts: u32,
    /// Impulses of the pin, and tooth friction, along the axis of the stator.
    from_frame: f64,
}

/// How many contacts were checked.
#[derive(Clone, Copy, Debug, Default)]
struct Checked {
    teeth: u32,
    edges: u32,
    several: u32,
    sustained: u32,
}

/// The account of one run.
struct Account {
    constants: Constants,
    rounding: f64,
    driven: usize,
    step_s: f64,
    from: Option<(Motion, f64)>,
    given: Option<Given>,
    checked: Checked,
}

impl Account {
    /// The normal impulse `p` and the tangential impulses at `place`.
    fn impulse(&self, at: &Motion, place: ContactPlace, p: f64, [t_0, t_1]: [f64; 2]) -> Impulse {
        let c = &self.constants;
        let eta = at.slope;
        if let ContactPlace::Tooth(tooth) = place {
            let (outward, _) = c.teeth[usize::from(tooth)];
            let arm = outward * c.tooth_radius - at.shift;
            let way = Vector2::new(outward.y, -outward.x) * t_0 + outward * t_1;
            let flat = way - eta * p;
            let force = Vector3::new(flat.x, flat.y, p + eta.dot(&way));
            let arm = Vector3::new(arm.x, arm.y, eta.dot(&arm) - c.half_thickness);
            return Impulse { force, arm, left_out: 0.0 };
        }
        let level = if place == ContactPlace::UpperEdge { c.half_hole } else { -c.half_hole };
        let d = at.shift - eta * level;
        let away = d / d.norm();
        let (along, across) = (eta.dot(&away), eta.y * away.x - eta.x * away.y);
        let turn = (c.hole_radius * along * across / d.norm()).clamp(-0.3, 0.3);
        let n = -(away + Vector2::new(-away.y, away.x) * turn).normalize();
        let force = Vector3::new(p * n.x - t_0 * n.y, p * n.y + t_0 * n.x, t_1);
        let arm = n * c.pin_radius - at.shift;
        let arm = Vector3::new(arm.x, arm.y, level - c.hole_radius * along);
        // The normal is a unit vector to the fourth order of its turn.
        Impulse { force, arm, left_out: (p + t_0.abs()) * turn.powi(6) / 3.0 }
    }

    /// Checks what the contacts gave against the motion that followed.
    fn close(&mut self, now: &Motion) {
        let Some(given) = self.given.take() else { return };
        let (c, free) = (&self.constants, &given.free);
        self.checked.several += u32::from(given.contacts > 1);
        let jump = now.velocity - free.velocity;
        let speed = free.speed(c.tooth_radius) + now.speed(c.tooth_radius) + given.total / c.modal[0];
        let rounding = self.rounding * speed * c.mass;
        let off = (jump * c.mass - given.force).amax();
        let within = rounding + given.force_left_out;
        assert!(off <= within, "{off:e} of {within:e}: {}", given.force);
        // Of a mode, and of all that the teeth give to rotor and stator along the axis.
        for (n, ((_, v), (_, free_v))) in now.modes.iter().zip(free.modes).enumerate() {
            if n != self.driven {
                assert!(
                    (c.modal[n] * (v - free_v) + given.modal[n]).abs() <= rounding,
                    "{n}: {v:e} {free_v:e}"
                );
            }
        }
        let stator = c.modal[0] * (now.modes[0].1 - free.modes[0].1);
        let together = c.mass * jump.z + stator - given.from_frame;
        assert!(together.abs() <= 2.0 * rounding, "{together:e} {rounding:e}");
        // About the rotor's axis and across it.
        let spun = c.spin_inertia * (now.spin - free.spin) - given.about_axis;
        let within = given.push_left_out + rounding * c.tooth_radius;
        assert!(spun.abs() <= within, "{spun:e} of {within:e}: {:e}", given.about_axis);
        let off = ((now.slope_rate - free.slope_rate) * c.inertia - given.across).amax();
        let within = given.left_out + rounding * c.tooth_radius;
        assert!(off <= within, "{off:e} of {within:e}: {}", given.across);
    }

    /// What was given so far, from the end of the flight on.
    fn take_given(&mut self) -> Given {
        let (from, time_s) = self.from.expect("a flight before");
        self.given.take().unwrap_or_else(|| Given {
            free: self.constants.fly(&from, time_s),
            force: Vector3::zeros(),
            about_axis: 0.0,
            across: Vector2::zeros(),
            modal: [0.0; 5],
            total: 0.0,
            force_left_out: 0.0,
            push_left_out: 0.0,
            left_out: 0.0,
            contacts: 0,
            from_frame: 0.0,
        })
    }

    fn begin<T: Real>(&mut self, state: &TiltingState<T>) {
        self.close(&Motion::of(state));
        self.from = Some((Motion::of(state), 0.0));
    }
}

impl<T: Real> TiltingLedger<T> for Account {
    const RECORDS: bool = true;

    fn motion(&mut self, state: &TiltingState<T>, part: T) {
        let from = Motion::of(state);
        self.close(&from);
        self.from = Some((from, part.to_f64() * self.step_s));
    }

    fn contact(&mut self, contact: &TiltingContact<T>, _: T, _: [T; 2], _: [T; 2]) {
        let mut given = self.take_given();
        let p = contact.normal_impulse_n_s.to_f64();
        let along = contact.tangential_impulse_n_s.map(Real::to_f64);
        let Impulse { force, arm, left_out } = self.impulse(&given.free, contact.place, p, along);
        given.force_left_out += left_out;
        given.force += force;
        let (moment, eta) = (arm.cross(&force), given.free.slope);
        let about_axis = moment.z - eta.dot(&moment.xy());
        given.about_axis += about_axis;
        given.across += Vector2::new(-moment.y, moment.x) + Vector2::new(-eta.y, eta.x) * about_axis;
        given.total += p + along[0].abs() + along[1].abs();
        given.contacts += 1;
        given.from_frame += force.z;
        // First order in the slopes: a gap reckons with the lever of the middle of the underside, half a thickness from
        // the mass centre, and tilt does not take part in friction's moment about the axis. Second order: the rest.
        let (steep, c) = (given.free.slope.norm(), &self.constants);
        let rubbed = along[0].hypot(along[1]);
        let lever = arm.norm();
        given.left_out += steep * (c.half_thickness * p + lever * rubbed + steep * lever * (p + rubbed));
        if let ContactPlace::Tooth(tooth) = contact.place {
            let (_, shape) = c.teeth[usize::from(tooth)];
            for (sum, phi) in given.modal.iter_mut().zip(shape) {
                *sum += phi * p;
            }
            given.from_frame -= p;
            self.checked.teeth += 1;
        } else {
            // The push at an edge passes the rotor's axis at this distance at most.
            given.push_left_out += 0.5 * c.hole_radius * steep * steep * p;
            self.checked.edges += 1;
        }
        self.checked.sustained += u32::from(contact.sustained);
        self.given = Some(given);
    }

    fn moved(&mut self, _: &TiltingState<T>, after: &TiltingState<T>) {
        let (after, mut given) = (Motion::of(after), self.take_given());
        (given.free.shift, given.free.slope) = (after.shift, after.slope);
        self.given = Some(given);
    }
}

/// Six tenths of a second in each mode, and then to rest. In an instant up to 40 sweeps over 8 normal impulses, once
/// more without restitution, and 20 over both directions of friction round by half a unit each, 480 units; a span and
/// an instant may come together.
fn check<T: Real>(sets: &Sets, step_s: f64) {
    for (mode, driven) in [(DriveMode::B, 1), (DriveMode::C, 2)] {
        let setup = TiltingSetup { variation: UNEQUAL, ..TiltingSetup::with_step(step_s) };
        let motor = TiltingMotor::<T>::try_new(&sets.0, &sets.1, &setup).expect("valid");
        let mut account = Account {
            constants: Constants::of(sets),
            rounding: 1000.0 * epsilon::<T>(),
            driven,
            step_s,
            from: None,
            given: None,
            checked: Checked::default(),
        };
        let mut state = TiltingState::<T>::default();
        for (command, time_s) in [(DriveCommand::full(mode), 0.6), (DriveCommand::OFF, 0.2)] {
            for _ in 0..steps_in(time_s, step_s) {
                account.begin(&state);
                motor.step_with(&mut state, command, &mut account);
            }
        }
        let checked = account.checked;
        let what = format!("{mode:?} {step_s} {checked:?}");
        assert!(checked.teeth > 100 && checked.several > 100 && checked.sustained > 100, "{what}");
        assert!(mode == DriveMode::C || checked.edges > 100, "{what}");
    }
}

#[test]
fn law_momentum_and_angular_momentum_over_every_located_contact() {
    for sets in [slow_in_b(), set_g(), own_stator()] {
        check::<f64>(&sets, 1e-6);
        check::<f64>(&sets, 5e-6);
        check::<f32>(&sets, 5e-6);
    }
    // The constants of all three are in the last.
    check::<f32>(&own_stator(), 1e-6);
}
