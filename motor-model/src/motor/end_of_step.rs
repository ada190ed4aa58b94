//! One impact, and the rule that finds impacts at the end of the step.

use super::{Impacts, Motion, Motor};
use crate::energy::Ledger;
use crate::impact::Impact;
use crate::math::Real;
use crate::modes::Forcing;
use crate::rotor::RotorJump;
use crate::teeth::ToothPair;

impl<T: Real> Motor<T> {
    /// The paper's rule: a contact is found at the end of the step, the deeper pair first.
    ///
    /// The rotor is then lifted out of the tooth. Otherwise a rotor at rest would sink a little deeper in every step.
    /// The energy of the lift has a line of its own in the ledger.
    pub(super) fn impacts_at_end<L: Ledger<T>>(
        &self,
        forcing: &Forcing<T>,
        motion: &mut Motion<T>,
        [first, second]: [T; 2],
        impacts: &mut Impacts<T>,
        ledger: &mut L,
    ) {
        let [tooth_0, tooth_1] = &self.teeth;
        let (zero, one) = ((0, tooth_0, first), (1, tooth_1, second));
        let [deeper, other] = if second < first { [one, zero] } else { [zero, one] };
        for (pair, tooth, gap_m) in [deeper, other] {
            if gap_m <= T::zero() {
                self.impact(pair, tooth, gap_m, T::zero(), forcing, motion, impacts, ledger);
            }
        }
        let (_, _, deepest_m) = deeper;
        motion.rotor.height_m -= deepest_m;
        ledger.lift(-deepest_m);
    }

    /// One impact, if tooth and rotor approach. Returns the jump of the rotor's velocities.
    #[expect(clippy::too_many_arguments, reason = "what an impact is made of")]
    pub(super) fn impact<L: Ledger<T>>(
        &self,
        pair: u8,
        tooth: &ToothPair<T>,
        gap_m: T,
        before_end_s: T,
        forcing: &Forcing<T>,
        motion: &mut Motion<T>,
        impacts: &mut Impacts<T>,
        ledger: &mut L,
    ) -> Option<RotorJump<T>> {
        let approach_m_s = tooth.vertical_velocity(&motion.modes) - motion.rotor.velocity_m_s;
        if approach_m_s <= T::zero() {
            return None;
        }
        let before = *motion;
        let impulse = self.impact_law.apply(tooth, approach_m_s, &mut motion.modes, &mut motion.rotor);
        let impact = Impact {
            pair,
            before_end_s,
            approach_m_s,
            normal_impulse_n_s: impulse.normal_n_s,
            slip_m_s: impulse.slip_m_s,
            tangential_impulse_n_s: impulse.tangential_n_s,
            gap_m,
        };
        ledger.impact(&before.under(forcing), &motion.under(forcing), &impact);
        // The callers apply at most as many impacts as fit.
        let _ = impacts.push(impact);
        Some(impulse.jump)
    }

    /// Applies the rule of the end of the step to a contact that the search missed by rounding or at a graze.
    pub(super) fn missed_impact_at_end<L: Ledger<T>>(
        &self,
        forcing: &Forcing<T>,
        motion: &mut Motion<T>,
        impacts: &mut Impacts<T>,
        ledger: &mut L,
    ) {
        let gaps_m = self.gaps_m(&motion.modes, &motion.rotor);
        let [first, second] = gaps_m;
        if (first < T::zero() || second < T::zero()) && impacts.is_empty() {
            self.impacts_at_end(forcing, motion, gaps_m, impacts, ledger);
        }
    }
}
