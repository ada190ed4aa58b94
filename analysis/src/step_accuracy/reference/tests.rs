//! The reference against closed forms, conservation laws, a brute-force integration and the fixed step.

mod bouncing;
mod fixed_step;
mod rotation;
mod sustained_contact;

use motor_model::params::Parameter;
use motor_model::{AmplitudeVariation, MotorParams};

use super::Reference;
use super::events::{ContactEvent, ContactEventKind, ReferenceObserver};

/// Nominal parameters with changes.
fn params(changes: &[(Parameter, f64)]) -> MotorParams {
    changes
        .iter()
        .fold(MotorParams::nominal(), |params, &(parameter, value)| params.with(parameter, value).unwrap())
}

/// A motor without variation.
fn reference(params: &MotorParams) -> Reference {
    Reference::try_new(params, &AmplitudeVariation::default()).unwrap()
}

/// A rotor of 1 ug on a stator of 1 kg: rigid to 3e-9. No squeeze film.
fn rigid(changes: &[(Parameter, f64)]) -> MotorParams {
    let mut params = params(changes);
    let rigid =
        [(Parameter::StatorMass, 1.0), (Parameter::RotorMass, 1e-9), (Parameter::VerticalDamping, 0.0)];
    for (parameter, value) in rigid {
        params = params.with(parameter, value).unwrap();
    }
    params
}

/// Records every event.
#[derive(Default)]
struct Events(Vec<ContactEvent>);

impl ReferenceObserver for Events {
    fn event(&mut self, event: &ContactEvent) {
        self.0.push(*event);
    }
}

impl Events {
    /// Times and speeds of approach of the impacts.
    fn impacts(&self) -> Vec<(f64, f64)> {
        let impacts = self.0.iter().filter_map(|event| match event.kind {
            ContactEventKind::Impact { approach_m_s, .. } => Some((event.time_s, approach_m_s)),
            _ => None,
        });
        impacts.collect()
    }

    /// The instant of the first event of a kind.
    fn first(&self, kind: ContactEventKind) -> Option<f64> {
        self.0.iter().find(|event| event.kind == kind).map(|event| event.time_s)
    }
}
