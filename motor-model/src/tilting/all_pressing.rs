//! The normal impulses of up to four contacts that all press: what holds a rotor at rest on its teeth.
//!
//! With the compliances `D_ij`, the change of the speed along contact i's normal per impulse along contact j's:
//!
//! ```text
//! D P = -(w- + b)          every contact parts with -b: the complementarity of `contact_set`, where P >= 0
//! D = L diag(d) L^T        L: unit lower triangular
//! ```
//!
//! Teeth press independently, since the stator yields: `D` is positive definite, and P the only solution.

use super::contact::Mobility;
use super::contact_set::Solved;
use crate::math::Real;

/// Most contacts.
pub(super) const MOST: usize = 4;
/// A pivot below this share of its contact's own compliance: the others move that contact as they move themselves, and
/// how they share the impulse is not determined.
const DEPENDENT: f64 = 1e-4;

/// The normal impulses of `contacts`, of which there are at most [`MOST`], where no impulse acts yet; 0 for the places
/// that are left. `None` where a contact would have to pull, and where the normals depend on each other.
pub(super) fn impulses_if_all_press<T: Real>(
    contacts: &[Solved<T>],
    mobility: &Mobility<T>,
) -> Option<[T; MOST]> {
    let (zero, dependent) = (T::zero(), T::from_f64(DEPENDENT));
    let (first, second, third, fourth) =
        (contacts.first(), contacts.get(1), contacts.get(2), contacts.get(3));
    // A contact that is not there is one of its own, which nothing has to move.
    let own = |of: Option<&Solved<T>>| of.map_or(T::one(), |solved| solved.contact.normal.compliance);
    let asked = |of: Option<&Solved<T>>| of.map_or(zero, |solved| -(solved.speed_before + solved.bias));
    let between = |a: Option<&Solved<T>>, b: Option<&Solved<T>>| match (a, b) {
        (Some(a), Some(b)) => a.contact.normal.coupling(&b.contact.normal, mobility),
        _ => zero,
    };
    let per = |pivot: T, own: T| (pivot > dependent * own).then(|| T::one() / pivot);
    let (d_0, d_1, d_2, d_3) = (own(first), own(second), own(third), own(fourth));
    let (c_0, c_1, c_2, c_3) = (asked(first), asked(second), asked(third), asked(fourth));
    // Columns `m = d l` of `L diag(d)`.
    let per_0 = per(d_0, zero)?;
    let (m_10, m_20, m_30) = (between(second, first), between(third, first), between(fourth, first));
    let (l_10, l_20, l_30) = (m_10 * per_0, m_20 * per_0, m_30 * per_0);
    let per_1 = per(d_1 - l_10 * m_10, d_1)?;
    let (m_21, m_31) = (between(third, second) - l_20 * m_10, between(fourth, second) - l_30 * m_10);
    let (l_21, l_31) = (m_21 * per_1, m_31 * per_1);
    let per_2 = per(d_2 - l_20 * m_20 - l_21 * m_21, d_2)?;
    let m_32 = between(fourth, third) - l_30 * m_20 - l_31 * m_21;
    let l_32 = m_32 * per_2;
    let per_3 = per(d_3 - l_30 * m_30 - l_31 * m_31 - l_32 * m_32, d_3)?;
    // L y = c, then L^T P = y / d.
    let y_1 = c_1 - l_10 * c_0;
    let y_2 = c_2 - l_20 * c_0 - l_21 * y_1;
    let y_3 = c_3 - l_30 * c_0 - l_31 * y_1 - l_32 * y_2;
    let p_3 = y_3 * per_3;
    let p_2 = y_2 * per_2 - l_32 * p_3;
    let p_1 = y_1 * per_1 - l_21 * p_2 - l_31 * p_3;
    let p_0 = c_0 * per_0 - l_10 * p_1 - l_20 * p_2 - l_30 * p_3;
    let impulses = [p_0, p_1, p_2, p_3];
    impulses.iter().all(|&impulse| impulse >= zero).then_some(impulses)
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector2;
    use proptest::prelude::*;

    use super::*;
    use crate::params::{MotorParams, TiltingParams};
    use crate::tilting::contact::{ContactPlace, Velocities};
    use crate::tilting::contact_set::ContactSet;
    use crate::tilting::{TiltingMotor, TiltingSetup, TiltingState};

    const TEETH: [ContactPlace; 4] =
        [ContactPlace::Tooth(0), ContactPlace::Tooth(1), ContactPlace::Tooth(2), ContactPlace::Tooth(3)];

    fn motor() -> TiltingMotor<f64> {
        let (params, tilting) = (MotorParams::nominal(), TiltingParams::nominal());
        TiltingMotor::try_new(&params, &tilting, &TiltingSetup::with_step(1e-6)).unwrap()
    }

    /// A rotor whose height falls, and whose rim moves along x and y, at these speeds in m/s.
    fn velocities_of([down, along, across]: [f64; 3]) -> Velocities<f64> {
        let mut velocities = Velocities::zero();
        velocities.rotor.rise = -down;
        velocities.rotor.slope = Vector2::new(along, across) / 3e-3;
        velocities
    }

    /// The contacts at `places` of such a rotor, tilted and shifted.
    fn falling(motor: &TiltingMotor<f64>, places: &[ContactPlace], speeds: [f64; 3]) -> ContactSet<f64> {
        let mut state = TiltingState::<f64>::default();
        state.tilt.slope = Vector2::new(1e-3, -2e-3);
        state.shift.displacement_m = Vector2::new(2e-6, 1e-6);
        let motion = state.motion();
        let velocities = velocities_of(speeds);
        let mut set = ContactSet::new();
        for &place in places {
            let contact = motor.contact_at(&motion, place).unwrap();
            let bias = contact.restitution * contact.normal.speed(&velocities).min(0.0);
            set.add(contact, bias, &velocities);
        }
        set
    }

    proptest! {
        /// The definition of complementarity: each contact that is found to press parts with minus its bias, to 1e-12
        /// of the largest speed, 5,000 roundings. Where `None` is returned for contacts that do not depend on each
        /// other, some contact of the linear solution pulls, and sweeps find one that carries nothing.
        #[test]
        fn law_every_contact_presses_and_parts_as_asked(
            number in 2_usize..5, down in 0.0..0.1_f64, along in -0.1..0.1_f64, across in -0.1..0.1_f64,
        ) {
            let motor = motor();
            let speeds = [down, along, across];
            let (mut set, before) = (falling(&motor, &TEETH[..number], speeds), velocities_of(speeds));
            let pressing = impulses_if_all_press(&set.contacts, &motor.mobility);
            let mut velocities = before;
            set.sweep_normals(&motor.mobility, &mut velocities, false, None);
            let Some(impulses) = pressing else {
                prop_assert!(set.contacts.iter().any(|solved| solved.normal_n_s == 0.0));
                return Ok(());
            };
            let mut after = before;
            for (solved, impulse) in set.contacts.iter().zip(impulses) {
                prop_assert!(impulse >= 0.0);
                solved.contact.normal.push(impulse, &motor.mobility, &mut after);
            }
            for (solved, impulse) in set.contacts.iter().zip(impulses) {
                let parts = solved.contact.normal.speed(&after) + solved.bias;
                prop_assert!(parts.abs() < 1e-13, "{parts:e}");
                // Sweeps end when no impulse changes by more than 1e-13 of the largest; each leaves a part.
                let largest = impulses.iter().fold(0.0, |largest, impulse| impulse.max(largest));
                prop_assert!((solved.normal_n_s - impulse).abs() <= 1e-11 * largest);
            }
            prop_assert!(impulses[number..].iter().all(|&impulse| impulse == 0.0));
        }
    }

    /// Two contacts at either side of one tooth, which share the impulse of a rotor that falls straight down. They
    /// depend on each other as the square of their distance over the tooth's radius: within 2 um nearly, at 2 mm not.
    #[test]
    fn contacts_that_depend_on_each_other_are_left_to_sweeps() {
        let motor = motor();
        let [tooth, ..] = motor.teeth();
        let across = Vector2::new(-tooth.outward.y, tooth.outward.x);
        let velocities = velocities_of([0.1, 0.0, 0.0]);
        let are_found = |beside_m: f64| {
            let mut set = ContactSet::new();
            for side in [-1.0, 1.0] {
                let mut motion = TiltingState::<f64>::default().motion();
                motion.shift.displacement_m = across * (side * beside_m);
                let contact = motor.contact_at(&motion, ContactPlace::Tooth(0)).unwrap();
                set.add(contact, 0.0, &velocities);
            }
            impulses_if_all_press(&set.contacts, &motor.mobility).is_some()
        };
        assert!(are_found(1e-3) && !are_found(1e-6));
    }
}
