//! What strain of the foil gives the amplitudes that were measured, and in which direction of the field.

use stator::drive::{CommonField, ModeDrive, fields_of_both};
use stator::ensemble::Member;

use super::SolvedStator;
use super::measured_mode::{MeasuredMode, measured};
use simulation::scene::Scene;

/// Strain of the foil in ppm, force in mN, amplitude in um.
const PPM: f64 = 1e-6;

/// How a stator is driven, with the damping and the amplitudes that were measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct DrivenStator {
    /// Modes B and C.
    pub(super) modes: [ModeDrive; 2],
    /// Amplitude at the teeth at resonance per strain, with the field at the best direction of each mode, m.
    pub(super) per_strain_m: [f64; 2],
    /// The two fields that give both amplitudes.
    pub(super) both: [CommonField; 2],
    measured: [MeasuredMode; 2],
}

impl DrivenStator {
    /// From the modes' drives, modal masses and frequencies.
    fn new(
        modes: [ModeDrive; 2],
        masses_kg: [f64; 2],
        frequencies_hz: [f64; 2],
        measured: [MeasuredMode; 2],
    ) -> Self {
        let per_strain_m = [0, 1].map(|mode| {
            let damping = measured[mode].damping_ratio;
            modes[mode].tooth_amplitude_per_strain_m(masses_kg[mode], frequencies_hz[mode], damping)
        });
        let amplitudes = measured.map(|mode| mode.tooth_amplitude_m);
        let both = fields_of_both(amplitudes, per_strain_m, modes.map(|mode| mode.best_field_deg));
        Self { modes, per_strain_m, both, measured }
    }

    /// Of a stator and its design; `None` of a stressed one.
    pub(super) fn of(solved: &SolvedStator) -> Option<Self> {
        let f = &solved.figures;
        let modes = [f.b, f.c];
        let (masses, frequencies) =
            (modes.map(|mode| mode.modal_mass_kg), modes.map(|mode| mode.frequency_hz));
        Some(Self::new(f.drive?, masses, frequencies, solved.measured))
    }

    /// Of a member, with the paper's damping and amplitudes; `None` of a stressed one.
    pub(super) fn of_member(member: &Member) -> Option<Self> {
        let mode = |force: Option<f64>, field: Option<f64>, tooth: Option<f64>| -> Option<ModeDrive> {
            Some(ModeDrive {
                force_per_strain_n: force?,
                best_field_deg: field?,
                tooth_over_amplitude: tooth?,
            })
        };
        let m = member;
        let b = mode(m.force_per_strain_b_n, m.best_field_b_deg, m.tooth_over_amplitude_b)?;
        let c = mode(m.force_per_strain_c_n, m.best_field_c_deg, m.tooth_over_amplitude_c)?;
        let (masses, frequencies) =
            ([m.modal_mass_b_kg, m.modal_mass_c_kg], [m.frequency_b_hz, m.frequency_c_hz]);
        Some(Self::new([b, c], masses, frequencies, measured(&Scene::default())))
    }

    /// Strain that gives mode B its amplitude with the field at an angle, and the amplitude of C with it, m.
    pub(super) fn at(&self, field_deg: f64) -> (f64, f64) {
        let per_strain = |mode: usize| {
            let drive = &self.modes[mode];
            self.per_strain_m[mode] * (drive.force_at_n(field_deg) / drive.force_per_strain_n).abs()
        };
        let strain = self.measured[0].tooth_amplitude_m / per_strain(0);
        (strain, strain * per_strain(1))
    }

    /// In words, with the field of the drawing.
    pub(super) fn lines(&self, field_deg: f64) -> Vec<(&'static str, String)> {
        let ([b, c], [one, other]) = (self.modes, self.both);
        let milli = |force: f64| 1e3 * PPM * force;
        let (strain, amplitude_c) = self.at(field_deg);
        let both = |field: CommonField| format!("{:.1} deg, {:.1} ppm", field.field_deg, field.strain / PPM);
        vec![
            (
                "force of the foil on B, on C",
                format!("{:.2}, {:.2} mN/ppm", milli(b.force_per_strain_n), milli(c.force_per_strain_n)),
            ),
            (
                "best direction of the field for B, for C",
                format!("{:.1}, {:.1} deg", b.best_field_deg, c.best_field_deg),
            ),
            (
                "field and strain that give B and C their amplitudes",
                format!("{}; {}", both(one), both(other)),
            ),
            (
                "strain for the amplitude of B in the field of the drawing",
                format!("{:.1} ppm at {field_deg} deg, C then {:.2} um", strain / PPM, 1e6 * amplitude_c),
            ),
        ]
    }

    /// For programs.
    pub(super) fn json(&self, field_deg: f64) -> serde_json::Value {
        let pair = |pair: [f64; 2]| serde_json::json!({ "b": pair[0], "c": pair[1] });
        let (strain, amplitude_c_m) = self.at(field_deg);
        let both = self
            .both
            .map(|field| serde_json::json!({ "field_deg": field.field_deg, "strain": field.strain }));
        serde_json::json!({
            "force_per_strain_n": pair(self.modes.map(|mode| mode.force_per_strain_n)),
            "best_field_deg": pair(self.modes.map(|mode| mode.best_field_deg)),
            "tooth_amplitude_per_strain_m": pair(self.per_strain_m),
            "fields_of_both_amplitudes": both,
            "at_field": { "field_deg": field_deg, "strain": strain, "tooth_amplitude_c_m": amplitude_c_m },
        })
    }
}
