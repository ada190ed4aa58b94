//! The account of energy of the tilting motor closes, and no contact at the pin gains energy.

use motor_model::{
    DriveCommand, DriveMode, Freedom, ImpactRule, Real, TiltingContact, TiltingEnergyLedger, TiltingLedger,
    TiltingMotor, TiltingParameter, TiltingSetup, TiltingState,
};

use super::{Sets, UNEQUAL, own_stator, slow_in_b, tilting};
use crate::support::closeness::{Within, assert_close};
use crate::support::motors::{changed, epsilon, steps_in};

/// B, off, C at half drive, C at 0.3, off.
fn schedule() -> [(DriveCommand, f64); 5] {
    [
        (DriveCommand::full(DriveMode::B), 0.1),
        (DriveCommand::OFF, 0.03),
        (DriveCommand::saturating(DriveMode::C, 0.5), 0.04),
        (DriveCommand::saturating(DriveMode::C, 0.3), 0.02),
        (DriveCommand::OFF, 0.02),
    ]
}

/// Runs the schedule and checks the balance.
fn check<T: Real>((params, tilting): &Sets, setup: &TiltingSetup, within: f64) {
    let motor = TiltingMotor::<T>::try_new(params, tilting, setup).expect("valid");
    let mut ledger = TiltingEnergyLedger::try_new(params, tilting, setup).expect("valid");
    let mut state = TiltingState::<T>::default();
    for (command, time_s) in schedule() {
        for _ in 0..steps_in(time_s, setup.step_s) {
            motor.step_with(&mut state, command, &mut ledger);
        }
    }
    let flows = ledger.flows();
    let imbalance = (ledger.stored_j(&state) - flows.net_j()) / flows.turnover_j();
    assert_close(imbalance, 0.0, Within::absolute(within), format_args!("{setup:?} {flows:?}"));
    assert!(
        flows.normal_loss_j > 0.0 && flows.friction_loss_j > 0.0 && flows.squeeze_film_j > 0.0,
        "{setup:?} {flows:?}"
    );
}

/// In `f64` to the error of the quadrature, 1e-10 of a term, and rounding.
#[test]
fn law_energy_account_closes() {
    let other = (changed(&[]), tilting(&[(TiltingParameter::PinSlope, 5e-3)]));
    for sets in [slow_in_b(), other, own_stator()] {
        for impact_rule in [ImpactRule::EndOfStep, ImpactRule::Located] {
            for freedom in [Freedom::Full, Freedom::WithoutShift, Freedom::HeightOnly] {
                for step_s in [1e-6, 5e-6] {
                    let setup = TiltingSetup {
                        impact_rule,
                        freedom,
                        variation: UNEQUAL,
                        ..TiltingSetup::with_step(step_s)
                    };
                    check::<f64>(&sets, &setup, 1e-9);
                }
            }
        }
    }
}

/// In `f32` each step rounds by half a unit; all one way they add up to `epsilon / (2 zeta w h)` of the turnover, as
/// for the height-only motor.
#[test]
fn law_energy_account_closes_in_f32_to_rounding() {
    for step_s in [1e-6, 5e-6] {
        let setup = TiltingSetup { variation: UNEQUAL, ..TiltingSetup::with_step(step_s) };
        check::<f32>(&slow_in_b(), &setup, epsilon::<f32>() / (249.4 * step_s));
    }
}

/// Watches the instants at which only the pin is met.
#[derive(Default)]
struct Watch {
    at_pin: u32,
    elsewhere: u32,
    gained_m2_s2: f64,
    instants: u32,
    most_gained_m2_s2: f64,
}

impl Watch {
    /// Closes the account of an instant.
    fn close(&mut self) {
        if self.at_pin > 0 && self.elsewhere == 0 {
            self.instants += 1;
            self.most_gained_m2_s2 = self.most_gained_m2_s2.max(self.gained_m2_s2);
        }
        (self.at_pin, self.elsewhere, self.gained_m2_s2) = (0, 0, 0.0);
    }
}

impl TiltingLedger<f64> for Watch {
    const RECORDS: bool = true;
    fn motion(&mut self, _: &TiltingState<f64>, _: f64) {
        self.close();
    }
    fn contact(&mut self, contact: &TiltingContact<f64>, opening: f64, slip_after: [f64; 2], _: [f64; 2]) {
        // A sustained contact may press the rotor back to the surface.
        if contact.place.is_hub() && !contact.sustained {
            self.at_pin += 1;
        } else {
            self.elsewhere += 1;
        }
        let normal = 0.5 * contact.normal_impulse_n_s * (opening - contact.approach_m_s);
        let along: f64 = (contact.tangential_impulse_n_s.iter())
            .zip(contact.slip_m_s.iter().zip(slip_after))
            .map(|(impulse, (before, after))| 0.5 * impulse * (before + after))
            .sum();
        self.gained_m2_s2 += (normal + along) / (0.5 * 46e-6);
    }
    fn moved(&mut self, _: &TiltingState<f64>, _: &TiltingState<f64>) {}
}

/// No impact at the pin alone gives the rotor energy: its square speed gains less than rounding.
#[test]
fn law_no_contact_at_the_pin_gains_energy() {
    let (params, tilting) = slow_in_b();
    for impact_rule in [ImpactRule::EndOfStep, ImpactRule::Located] {
        let setup = TiltingSetup { impact_rule, variation: UNEQUAL, ..TiltingSetup::with_step(1e-6) };
        let motor = TiltingMotor::<f64>::try_new(&params, &tilting, &setup).expect("valid");
        let (mut state, mut watch) = (TiltingState::default(), Watch::default());
        for _ in 0..200_000 {
            motor.step_with(&mut state, DriveCommand::full(DriveMode::B), &mut watch);
        }
        assert!(watch.instants > 100);
        assert!(watch.most_gained_m2_s2 < 1e-15, "{:e}", watch.most_gained_m2_s2);
    }
}
