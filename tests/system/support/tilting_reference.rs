//! A second program of the tilting rotor, written from the equations and not from the model: vectors of three, impacts
//! at the end of small steps, one generic contact. It is slow and plain.
//!
//! ```text
//! rotor    m z'' = -m g - b z',   m (x, y)'' = 0,   J w_z' = -b_th R_t^2 w_z
//!          I w_x' = -J w_z w_y - b_t w_x,   I w_y' = J w_z w_x - b_t w_y,   eta_x' = -w_y,  eta_y' = w_x
//! modes    g'' + 2 zeta w g' + w^2 g = F sin,   A, tilt about y, tilt about x, B, C
//! tooth k  phi = (1, cos th, sin th, sin 2 th, cos 2 th)
//! contact  w+ >= -e w-,  P >= 0,  complementary, by Gauss-Seidel; then friction within mu P
//! ```

#![expect(clippy::disallowed_methods, reason = "an independent yardstick")]
#![expect(
    clippy::cast_precision_loss,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a few million steps"
)]

use nalgebra::{Matrix2, Matrix3, SVector, Vector2, Vector3};

/// Number of modes: A, both tilting modes, B, C.
const MODES: usize = 5;

/// The values of a motor, in SI units and degrees.
#[derive(Clone, Copy, Debug)]
pub struct ReferenceMotor {
    /// Radial clearance of the hole.
    pub clearance_m: f64,
    /// Friction at the teeth and at the hub.
    pub friction: [f64; 2],
    /// Restitution at the teeth and at the hub.
    pub restitution: [f64; 2],
    /// Damping of the film.
    pub film_n_s_per_m: f64,
    /// Frequency of the stator's tilting modes; their damping ratio is 0.02.
    pub tilt_hz: f64,
    /// Radial exponent of B and C at the teeth.
    pub rocking: f64,
    /// Mode shift.
    pub shift_deg: f64,
    /// What the stator has of its own.
    pub stator: ReferenceStator,
}

/// Where a stator differs from a rigid ring with one mode shift.
#[derive(Clone, Copy, Debug)]
pub struct ReferenceStator {
    /// Shifts of B and C beside the common one.
    pub extra_shift_deg: [f64; 2],
    /// Modal masses of A, tilt, B and C over the stator's mass.
    pub mass_fractions: [f64; 4],
    /// Radial exponents of A and tilt at the teeth.
    pub exponents: [f64; 2],
    /// Difference of the frequencies of the tilting modes over their mean.
    pub split: f64,
}

impl ReferenceStator {
    /// The paper's.
    pub const PAPER: Self = Self {
        extra_shift_deg: [0.0, 0.0],
        mass_fractions: [1.0, 0.5, 0.5, 0.5],
        exponents: [0.0, 1.0],
        split: 0.0,
    };
}

/// What a run showed after its first part.
#[derive(Clone, Copy, Debug, Default)]
pub struct ReferenceRun {
    /// Mean rate, clockwise positive.
    pub rate_rad_s: f64,
    /// Impacts of a single tooth that approach faster than 1 mm/s, per second.
    pub impacts_per_s: f64,
    /// Root mean square of the tilt.
    pub tilt_rms_rad: f64,
}

struct Tooth {
    place: Vector3<f64>,
    /// Height and horizontal displacement per modal coordinate.
    height: SVector<f64, MODES>,
    x: SVector<f64, MODES>,
    y: SVector<f64, MODES>,
}

/// A place where the rotor touches something.
struct Contact {
    normal: Vector3<f64>,
    /// From the rotor's centre of mass.
    arm: Vector3<f64>,
    /// The tooth; `None` at the hub.
    tooth: Option<usize>,
    gap_m: f64,
    impulse: f64,
}

struct Constants {
    mass: f64,
    inverse_inertia: Matrix3<f64>,
    inverse_modal_mass: SVector<f64, MODES>,
    teeth: [Tooth; 4],
}

#[derive(Clone, Copy)]
struct State {
    g: SVector<f64, MODES>,
    v: SVector<f64, MODES>,
    place: Vector3<f64>,
    slopes: [f64; 2],
    velocity: Vector3<f64>,
    spin: Vector3<f64>,
}

const MASS: f64 = 46e-6;
const INERTIA: f64 = 4.59e-10;
const STATOR_MASS: f64 = 10.7e-6;
const TOOTH_RADIUS: f64 = 3.063e-3;
const PIN_RADIUS: f64 = 1e-3;
const LENGTH: f64 = 350e-6;
const RIM_RADIUS: f64 = 4.35e-3;
const TOOTH_DEG: f64 = 62.635;
const FREQUENCIES: [f64; 2] = [6300.0, 7460.0];
const DAMPING: [f64; 2] = [0.0063, 0.0075];

impl State {
    /// Velocity of the rotor's material at an arm.
    fn rotor_velocity(&self, arm: &Vector3<f64>) -> Vector3<f64> {
        self.velocity + self.spin.cross(arm)
    }

    fn tooth_velocity(&self, tooth: &Tooth) -> Vector3<f64> {
        Vector3::new(tooth.x.dot(&self.v), tooth.y.dot(&self.v), tooth.height.dot(&self.v))
    }

    /// Velocity of the rotor against what it touches.
    fn slip(&self, constants: &Constants, contact: &Contact) -> Vector3<f64> {
        let other = contact.tooth.map_or(Vector3::zeros(), |k| self.tooth_velocity(&constants.teeth[k]));
        self.rotor_velocity(&contact.arm) - other
    }

    fn push(&mut self, constants: &Constants, arm: &Vector3<f64>, impulse: &Vector3<f64>) {
        self.velocity += impulse / constants.mass;
        self.spin += constants.inverse_inertia * arm.cross(impulse);
    }
}

impl ReferenceMotor {
    fn constants(&self) -> Constants {
        let transverse = 0.5 * INERTIA + MASS * LENGTH * LENGTH / 12.0;
        let lever = (70e-6 + 2.0 * 260e-6) / TOOTH_RADIUS;
        let teeth = core::array::from_fn(|k| {
            let angle = (90.0 - TOOTH_DEG - self.shift_deg + 90.0 * k as f64).to_radians();
            let (sin, cos) = angle.sin_cos();
            let [(sin_b, cos_b), (sin_c, cos_c)] = self
                .stator
                .extra_shift_deg
                .map(|extra_deg| (2.0 * (angle - extra_deg.to_radians())).sin_cos());
            let height = SVector::from([1.0, cos, sin, sin_b, cos_c]);
            // The tip leans against the slope of the ring: along it by d phi / d theta, across it by the exponent.
            let tangential = [-lever * cos_b, lever * sin_c];
            // The same of a ring that tilts, along x and y: a rigid one, and what the exponent is more than 1.
            let [of_a, of_tilt] = self.stator.exponents;
            let (half, bent) = (0.5 * lever, of_tilt - 1.0);
            let across = -half * bent * sin * cos;
            let radial = [3, 4].map(|n: usize| -0.5 * lever * self.rocking * height[n]);
            let along = |of: [f64; 2]| [0, 1].map(|n: usize| radial[n] * of[0] + tangential[n] * of[1]);
            let ([xb, xc], [yb, yc]) = (along([cos, -sin]), along([sin, cos]));
            Tooth {
                place: Vector3::new(TOOTH_RADIUS * cos, TOOTH_RADIUS * sin, 0.0),
                height,
                x: SVector::from([-half * of_a * cos, -half * (1.0 + bent * cos * cos), across, xb, xc]),
                y: SVector::from([-half * of_a * sin, across, -half * (1.0 + bent * sin * sin), yb, yc]),
            }
        });
        let [a, tilt, b, c] = self.stator.mass_fractions;
        Constants {
            mass: MASS,
            inverse_inertia: Matrix3::from_diagonal(&Vector3::new(
                1.0 / transverse,
                1.0 / transverse,
                1.0 / INERTIA,
            )),
            inverse_modal_mass: SVector::from([a, tilt, tilt, b, c]).map(|part| 1.0 / (part * STATOR_MASS)),
            teeth,
        }
    }

    /// The places that touch.
    fn contacts(&self, constants: &Constants, state: &State) -> Vec<Contact> {
        let [ex, ey] = state.slopes;
        let mut contacts = Vec::new();
        for (k, tooth) in constants.teeth.iter().enumerate() {
            let (dx, dy) = (tooth.place.x - state.place.x, tooth.place.y - state.place.y);
            let gap_m = state.place.z + ex * dx + ey * dy - tooth.height.dot(&state.g);
            if gap_m <= 0.0 {
                let normal = Vector3::new(-ex, -ey, 1.0).normalize();
                let arm = Vector3::new(dx, dy, -0.5 * LENGTH);
                contacts.push(Contact { normal, arm, tooth: Some(k), gap_m, impulse: 0.0 });
            }
        }
        let hole = PIN_RADIUS + self.clearance_m;
        for level in [-0.5 * LENGTH, 0.5 * LENGTH] {
            let centre = Vector3::new(state.place.x - level * ex, state.place.y - level * ey, 0.0);
            let off = centre.norm();
            if off < 1e-12 {
                continue;
            }
            let out = centre / off;
            let rise = ex * out.x + ey * out.y;
            let gap_m = self.clearance_m - off - 0.5 * hole * rise * rise;
            if gap_m <= 0.0 {
                let place = Vector3::new(state.place.x, state.place.y, 0.0);
                let arm = -PIN_RADIUS * out - place + Vector3::new(0.0, 0.0, level - hole * rise);
                contacts.push(Contact { normal: -out, arm, tooth: None, gap_m, impulse: 0.0 });
            }
        }
        contacts
    }

    /// Normal impulses of all contacts together, then friction.
    fn collide(&self, constants: &Constants, state: &mut State, contacts: &mut [Contact]) {
        let approach: Vec<f64> =
            contacts.iter().map(|contact| contact.normal.dot(&state.slip(constants, contact))).collect();
        if approach.iter().all(|speed| *speed >= 0.0) {
            return;
        }
        let of = |values: &[f64; 2], contact: &Contact| values[usize::from(contact.tooth.is_none())];
        for _ in 0..60 {
            for (index, contact) in contacts.iter_mut().enumerate() {
                let speed = contact.normal.dot(&state.slip(constants, contact));
                let wanted = -of(&self.restitution, contact) * approach[index].min(0.0);
                let couple = contact.arm.cross(&contact.normal);
                let mut mobility = 1.0 / constants.mass + couple.dot(&(constants.inverse_inertia * couple));
                let modal = contact.tooth.map(|k| {
                    let height = constants.teeth[k].height * contact.normal.z;
                    (height, constants.inverse_modal_mass.component_mul(&height))
                });
                mobility += modal.map_or(0.0, |(height, recoil)| height.dot(&recoil));
                let impulse = (contact.impulse - (speed - wanted) / mobility).max(0.0);
                let change = impulse - contact.impulse;
                contact.impulse = impulse;
                state.push(constants, &contact.arm, &(contact.normal * change));
                if let Some((_, recoil)) = modal {
                    state.v -= recoil * change;
                }
            }
        }
        let mut applied = vec![Vector3::zeros(); contacts.len()];
        for _ in 0..20 {
            for (contact, applied) in contacts.iter().zip(&mut applied) {
                let limit = of(&self.friction, contact) * contact.impulse;
                let wanted = *applied + stopping(constants, state, contact);
                let size = wanted.norm();
                let next = if size > limit { wanted * (limit / size) } else { wanted };
                state.push(constants, &contact.arm, &(next - *applied));
                *applied = next;
            }
        }
    }

    /// Runs from rest for `time_s` in steps of `step_s` at full drive in mode B (0) or C (1), and reports on what
    /// comes after `settle_s`.
    pub fn run(
        &self,
        mode: usize,
        step_s: f64,
        (settle_s, time_s): (f64, f64),
        phase_rad: f64,
    ) -> ReferenceRun {
        let constants = self.constants();
        let apart_hz = 0.5 * self.stator.split * self.tilt_hz;
        let hz = [2150.0, self.tilt_hz - apart_hz, self.tilt_hz + apart_hz, FREQUENCIES[0], FREQUENCIES[1]];
        let a_damping =
            22.5e-3 / (2.0 * self.stator.mass_fractions[0] * STATOR_MASS * core::f64::consts::TAU * hz[0]);
        let damping = [a_damping, 0.02, 0.02, DAMPING[0], DAMPING[1]];
        let free: [Matrix2<f64>; MODES] =
            core::array::from_fn(|n| free_oscillation(core::f64::consts::TAU * hz[n], damping[n], step_s));
        let shape = (2.0 * TOOTH_DEG.to_radians()).sin_cos();
        let amplitude = [20.72e-6 / shape.0.abs(), 1.81e-6 / shape.1.abs()][mode];
        let driven = 3 + mode;
        let drive_rad_s = core::f64::consts::TAU * hz[driven];
        let transverse = 0.5 * INERTIA + MASS * LENGTH * LENGTH / 12.0;
        let tilt_film = self.film_n_s_per_m * (RIM_RADIUS * RIM_RADIUS + PIN_RADIUS * PIN_RADIUS) / 4.0;
        let kept = [
            (-self.film_n_s_per_m / MASS * step_s).exp(),
            (-tilt_film / transverse * step_s).exp(),
            (-4.3e-11 * TOOTH_RADIUS * TOOTH_RADIUS / INERTIA * step_s).exp(),
        ];
        let falling = -MASS * 9.81 / self.film_n_s_per_m;
        let mut state = State {
            g: SVector::zeros(),
            v: SVector::zeros(),
            place: Vector3::new(1e-7, 0.0, 2e-6),
            slopes: [1e-5 * phase_rad.cos(), 1e-5 * phase_rad.sin()],
            velocity: Vector3::zeros(),
            spin: Vector3::zeros(),
        };
        let steps = (time_s / step_s).round() as u64;
        let settled = (settle_s / step_s).round() as u64;
        let (mut turned, mut tilt2, mut impacts) = (0.0, 0.0, 0_u64);
        for step in 0..steps {
            let steady = |step: u64| {
                let (sin, cos) = (drive_rad_s * step as f64 * step_s + phase_rad).sin_cos();
                (amplitude * cos, -amplitude * drive_rad_s * sin)
            };
            let (before, after) = (steady(step), steady(step + 1));
            for (n, free) in free.iter().enumerate() {
                let (from, to) = if n == driven { (before, after) } else { ((0.0, 0.0), (0.0, 0.0)) };
                // From rest: the steady motion is what the free motion is measured from.
                let moved =
                    free * Vector2::new(state.g[n] - from.0, state.v[n] - from.1) + Vector2::new(to.0, to.1);
                (state.g[n], state.v[n]) = (moved[0], moved[1]);
            }
            let vertical = falling + (state.velocity.z - falling) * kept[0];
            state.place.z += 0.5 * (state.velocity.z + vertical) * step_s;
            state.velocity.z = vertical;
            state.place.x += state.velocity.x * step_s;
            state.place.y += state.velocity.y * step_s;
            let turn = INERTIA * state.spin.z / transverse * step_s;
            let (sin, cos) = turn.sin_cos();
            let next = Matrix2::new(cos, -sin, sin, cos) * Vector2::new(state.spin.x, state.spin.y) * kept[1];
            state.slopes[0] -= 0.5 * (state.spin.y + next.y) * step_s;
            state.slopes[1] += 0.5 * (state.spin.x + next.x) * step_s;
            state.spin = Vector3::new(next.x, next.y, state.spin.z * kept[2]);
            let mut contacts = self.contacts(&constants, &state);
            if step >= settled {
                let fast = |contact: &&Contact| {
                    contact.tooth.is_some() && contact.normal.dot(&state.slip(&constants, contact)) < -1e-3
                };
                impacts += contacts.iter().filter(fast).count() as u64;
            }
            if !contacts.is_empty() {
                self.collide(&constants, &mut state, &mut contacts);
                lift(&constants, &mut state, &contacts);
            }
            if step >= settled {
                turned -= state.spin.z * step_s;
                tilt2 += state.slopes[0].powi(2) + state.slopes[1].powi(2);
            }
        }
        let counted = (steps - settled) as f64;
        ReferenceRun {
            rate_rad_s: turned / (counted * step_s),
            impacts_per_s: impacts as f64 / (counted * step_s),
            tilt_rms_rad: (tilt2 / counted).sqrt(),
        }
    }
}

/// `exp(A t)` of a damped oscillator, for position and velocity.
fn free_oscillation(rad_s: f64, ratio: f64, step_s: f64) -> Matrix2<f64> {
    let damped = rad_s * (1.0 - ratio * ratio).sqrt();
    let (sin, cos) = (damped * step_s).sin_cos();
    let decay = (-ratio * rad_s * step_s).exp();
    let skew = ratio * rad_s / damped;
    decay * Matrix2::new(cos + skew * sin, sin / damped, -rad_s * rad_s / damped * sin, cos - skew * sin)
}

/// The impulse that would stop the tangential slip of a contact by itself.
fn stopping(constants: &Constants, state: &State, contact: &Contact) -> Vector3<f64> {
    let first = contact.normal.cross(&Vector3::new(0.0, 1.0, 0.3)).normalize();
    let tangents = [first, contact.normal.cross(&first)];
    let slip = state.slip(constants, contact);
    let mobility = |a: &Vector3<f64>, b: &Vector3<f64>| {
        let couple = constants.inverse_inertia * contact.arm.cross(b);
        a.dot(b) / constants.mass + contact.arm.cross(a).dot(&couple)
    };
    let [a, b] = &tangents;
    let matrix = Matrix2::new(mobility(a, a), mobility(a, b), mobility(b, a), mobility(b, b));
    let wanted = -Vector2::new(a.dot(&slip), b.dot(&slip));
    let impulse = matrix.try_inverse().expect("two directions of a rigid body") * wanted;
    a * impulse[0] + b * impulse[1]
}

/// Moves the rotor out of what it has entered, as a push would.
fn lift(constants: &Constants, state: &mut State, contacts: &[Contact]) {
    let couples: Vec<Vector3<f64>> =
        contacts.iter().map(|contact| contact.arm.cross(&contact.normal)).collect();
    let mut pushes = vec![0.0; contacts.len()];
    let (mut shift, mut turn) = (Vector3::zeros(), Vector3::zeros());
    for _ in 0..20 {
        for (index, contact) in contacts.iter().enumerate() {
            let couple = constants.inverse_inertia * couples[index];
            let gap = contact.gap_m + contact.normal.dot(&shift) + couples[index].dot(&turn);
            let mobility = 1.0 / constants.mass + couples[index].dot(&couple);
            let next = (pushes[index] - gap / mobility).max(0.0_f64);
            let change = next - pushes[index];
            pushes[index] = next;
            shift += contact.normal * (change / constants.mass);
            turn += couple * change;
        }
    }
    state.place += shift;
    state.slopes[0] -= turn.y;
    state.slopes[1] += turn.x;
}
