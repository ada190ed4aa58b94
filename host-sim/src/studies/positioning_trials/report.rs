//! The report on the trials: how far off the moves end, how sure that is, and beside what.

use super::{PositioningTrial, PositioningTrials, StrategyTrials, TrialSummary};
use crate::report::key_figure::KeyFigure;
use crate::studies::positioning_trials::tables::{millidegrees, name_of};
use crate::studies::study_report::StudyReport;

impl PositioningTrials {
    /// The report on the study.
    pub(crate) fn report(&self) -> StudyReport {
        let summary = self.trials.summary();
        let all = std::iter::once(&self.trials)
            .chain(&self.others)
            .chain(self.beside.iter().map(|other| &other.found));
        let durations_s = all.flat_map(|trials| &trials.trials).map(|trial| trial.duration_s);
        StudyReport {
            title: "Positioning trials".to_owned(),
            verdict: verdict(&summary),
            asked: vec![
                ("moves", format!("{}, each of a motor and to a target of its own", summary.trials)),
                ("tolerance", format!("{} deg", self.tolerance_deg)),
                ("beside", format!("{} strategies and filters, {} scenes", self.others.len(), self.beside.len())),
            ],
            pictures: vec![("positioning-trials.svg".to_owned(), self.figure())],
            document: self.document(),
            key_figures: self.key_figures(),
            sure: vec![
                "The truth is known because this is a simulation. The intervals are of the moves that might have been \
                 drawn; they say nothing of motors outside the tolerances."
                    .to_owned(),
            ],
            motor_s: Some(durations_s.sum()),
        }
    }

    /// The figures by which the trials are judged.
    pub fn key_figures(&self) -> Vec<KeyFigure> {
        let mut figures = of_trials(&self.trials);
        for trials in &self.others {
            figures.extend(of_trials(trials));
        }
        for other in &self.beside {
            figures.extend(of_trials(&other.found).into_iter().map(|figure| figure.beside(&other.name)));
        }
        figures
    }
}

fn verdict(summary: &TrialSummary) -> String {
    let failed = match summary.failures {
        0 => "none failed".to_owned(),
        count => format!("{count} failed"),
    };
    format!(
        "Of {} moves {failed}; 95 % end within {} milli-degrees of the target, the worst {}. The median takes {:.2} s \
         to settle.",
        summary.trials,
        millidegrees(summary.p95_mdeg),
        millidegrees(summary.max_mdeg),
        summary.median_settle_s
    )
}

/// The key figures of one strategy on one filter.
fn of_trials(trials: &StrategyTrials) -> Vec<KeyFigure> {
    let errors = || trials.trials.iter().map(|trial| trial.final_error_mdeg.abs());
    let settled = || trials.trials.iter().map(|trial| trial.settle_s);
    let estimates = trials.trials.iter().map(|trial| trial.rms_estimate_error_mdeg);
    let count =
        |name, holds: fn(&PositioningTrial) -> bool| KeyFigure::count(name, trials.trials.iter().map(holds));
    let figures = [
        count("moves that failed", PositioningTrial::failed),
        count("moves held as on target, but off it", PositioningTrial::reached_but_off),
        KeyFigure::quantile("final error, median", "mdeg", errors(), 500),
        KeyFigure::quantile("final error, 95 % within", "mdeg", errors(), 950),
        KeyFigure::quantile("final error, 99.9 % within", "mdeg", errors(), 999),
        KeyFigure::quantile("time to settle, median", "s", settled(), 500),
        KeyFigure::quantile("time to settle, 95 % within", "s", settled(), 950),
        KeyFigure::root_mean_square("error of the estimate on the way", "mdeg rms", estimates),
    ];
    let numbers = || trials.trials.iter().map(|trial| trial.number);
    figures.map(|figure| figure.of(name_of(trials)).of_runs(numbers()).lower_is_better()).to_vec()
}
