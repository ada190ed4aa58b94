//! The report on calibrations of gyroscopes.

use super::{CalibrationOutcome, Calibrations};
use crate::report::key_figure::KeyFigure;
use crate::studies::study_report::StudyReport;
use simulation::math::count::real;
use simulation::math::statistics::NORMAL_95;

impl Calibrations {
    /// The report on the study.
    pub(crate) fn report(&self) -> StudyReport {
        let first = &self.first.outcome;
        let motors = self.motors + self.beside.iter().map(|other| other.found.motors).sum::<u64>();
        let mut sure = vec![
            "The intervals that a calibration states come from the gyroscope's data sheet, the filter's variances and \
             the residuals, as they would on a real bench. Whether they hold the truth is known because this is a \
             simulation."
                .to_owned(),
        ];
        if self.outcomes.len() < 2 {
            sure.push(
                "This is one calibration: it gives no spread. `--runs 100` calibrates many.".to_owned(),
            );
        }
        StudyReport {
            title: "Calibration of a gyroscope in closed loop".to_owned(),
            verdict: self.verdict(),
            asked: vec![
                ("calibrations", format!("{} gyroscopes on {} motors", self.outcomes.len(), self.motors)),
                ("motor time of each", format!("{:.0} s", first.motor_time_s)),
                ("reference", format!("the angle of the filter {}", self.filter.replace('_', " "))),
            ],
            pictures: vec![("calibrate.svg".to_owned(), self.figure())],
            document: self.document(),
            key_figures: self.all_key_figures(),
            sure,
            motor_s: Some(first.motor_time_s * real(motors)),
        }
    }

    fn verdict(&self) -> String {
        let CalibrationOutcome {
            scale_factor_ppm, scale_factor_sigma_ppm, bias_deg_h, bias_sigma_deg_h, ..
        } = &self.first.outcome;
        let first = format!(
            "Scale factor {scale_factor_ppm:+.1} +- {:.1} ppm, bias {bias_deg_h:+.1} +- {:.1} deg/h (95 %)",
            NORMAL_95 * scale_factor_sigma_ppm,
            NORMAL_95 * bias_sigma_deg_h
        );
        if self.outcomes.len() < 2 {
            let holds = |covers| if covers { "holds" } else { "misses" };
            return format!(
                "{first}: the interval of the scale factor {} the truth, that of the bias {} it.",
                holds(self.first.outcome.covers_scale_factor()),
                holds(self.first.outcome.covers_bias())
            );
        }
        let all = self.summary();
        format!(
            "{first} of the first. Over all {}: errors of {:.2} ppm and {:.2} deg/h rms; {} pairs of intervals hold \
             the truth.",
            all.runs, all.scale_factor_rms_ppm, all.bias_rms_deg_h, all.pair_covered
        )
    }

    /// The figures by which the calibrations are judged, those of the scenes beside the first included.
    pub fn all_key_figures(&self) -> Vec<KeyFigure> {
        let beside = self
            .beside
            .iter()
            .flat_map(|other| other.found.key_figures().into_iter().map(|figure| figure.beside(&other.name)));
        self.key_figures().into_iter().chain(beside).collect()
    }

    /// Of one calibration its intervals, of several their errors.
    fn key_figures(&self) -> Vec<KeyFigure> {
        let all = &self.outcomes;
        if all.len() < 2 {
            let CalibrationOutcome { scale_factor_ppm, bias_deg_h, .. } = self.first.outcome;
            return vec![
                KeyFigure::single("scale factor found", "ppm", scale_factor_ppm),
                KeyFigure::single("bias found", "deg/h", bias_deg_h),
            ];
        }
        let rms = |name, unit, of: fn(&CalibrationOutcome) -> f64| {
            KeyFigure::root_mean_square(name, unit, all.iter().map(of)).lower_is_better()
        };
        let covered = |name, of: fn(&CalibrationOutcome) -> bool| KeyFigure::count(name, all.iter().map(of));
        let figures = [
            rms("error of the scale factor", "ppm rms", |outcome| outcome.scale_factor_error_ppm),
            rms("error of the bias", "deg/h rms", |outcome| outcome.bias_error_deg_h),
            KeyFigure::mean(
                "deviation stated of the scale factor",
                "ppm",
                all.iter().map(|o| o.scale_factor_sigma_ppm),
            ),
            covered(
                "95 % intervals of the scale factor that hold the truth",
                CalibrationOutcome::covers_scale_factor,
            ),
            covered("95 % intervals of the bias that hold the truth", CalibrationOutcome::covers_bias),
            covered("95 % ellipses of both that hold the truth", CalibrationOutcome::covers_pair),
            covered(
                "95 % intervals of the non-linearity that hold the truth",
                CalibrationOutcome::covers_nonlinearity,
            ),
            rms("error of the reference", "mdeg rms", |outcome| outcome.reference_rms_mdeg),
        ];
        figures.map(|figure| figure.of_runs(all.iter().map(|outcome| outcome.number))).to_vec()
    }
}
