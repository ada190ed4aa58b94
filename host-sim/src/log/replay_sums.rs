//! The figures of a replay, beside those recorded.

use std::fmt;

use estimator::{Estimate, Health, Innovation, Verdict};
use motor_model::{Angle, Time};
use serde::Serialize;

use super::channels;
use crate::report::key_figure::KeyFigure;
use crate::report::table::Table;
use simulation::math::count::real;
use simulation::math::statistics::MeanSquare;
use simulation::runs::stated_errors::{StatedErrorCounts, StatedErrors, hundredths_or_dash};

/// What one filter made of a log: the one that was recorded, or the one that was replayed.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FilterFigures {
    /// Its name; `none` if nothing was recorded.
    pub filter: String,
    /// Estimates at logged ticks.
    pub estimates: u64,
    /// Root mean square of estimated less true angle over the logged ticks; `null` where the log has no truth. That of
    /// the run itself is over all ticks.
    pub rms_error_mdeg: Option<f64>,
    /// Errors beside what is stated; `null` where the log has no truth.
    pub stated: Option<StatedErrors>,
    /// Frames used.
    pub frames_used: u64,
    /// Frames refused.
    pub frames_refused: u64,
    /// Starts and restarts.
    pub starts: u64,
    /// Mean of the innovation squared over its variance, of the frames used: 1 in a consistent filter.
    pub nis: Option<f64>,
}

/// What a replay found.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Replayed {
    /// The command that was logged.
    pub logged_command: String,
    /// Length of the log.
    pub duration_s: f64,
    /// What was recorded.
    pub recorded: FilterFigures,
    /// What was computed now.
    pub replayed: FilterFigures,
    /// Recorded estimates and innovations that were computed to the last bit.
    pub same: u64,
    /// Those that were not.
    pub different: u64,
    /// When the first of them was.
    pub first_different_s: Option<f64>,
    /// The largest difference of an estimated angle.
    pub largest_difference_mdeg: f64,
    /// Where the log is damaged; `null` if it is whole.
    pub damage: Option<String>,
}

/// The sums of one filter.
#[derive(Clone, Copy, Debug, Default)]
struct FilterSums {
    estimates: u64,
    errors: u64,
    square_mdeg2: MeanSquare,
    stated: StatedErrorCounts,
    used: u64,
    refused: u64,
    starts: u64,
    nis: f64,
    nis_count: u64,
}

impl FilterSums {
    fn estimate(&mut self, estimate: &Estimate<f32>, health: Health, truth: Option<Angle>) {
        self.estimates += 1;
        if let Some(truth) = truth {
            self.errors += 1;
            self.square_mdeg2.add(1e3 * estimate.angle.minus(truth).degrees());
            self.stated.add(estimate, health, truth);
        }
    }

    fn innovation(&mut self, verdict: &str, normalised_squared: Option<f64>) {
        match verdict {
            "Used" => {
                self.used += 1;
                if let Some(nis) = normalised_squared {
                    self.nis += nis;
                    self.nis_count += 1;
                }
            }
            "Restarted" => self.starts += 1,
            _ => self.refused += 1,
        }
    }

    fn figures(&self, filter: String) -> FilterFigures {
        let known = self.errors > 0;
        FilterFigures {
            filter,
            estimates: self.estimates,
            rms_error_mdeg: known.then(|| self.square_mdeg2.root()),
            stated: known.then(|| self.stated.figures()),
            frames_used: self.used,
            frames_refused: self.refused,
            starts: self.starts,
            nis: (self.nis_count > 0).then(|| self.nis / real(self.nis_count)),
        }
    }
}

/// The sums of a replay.
#[derive(Clone, Copy, Debug)]
pub(super) struct ReplaySums {
    recorded: FilterSums,
    replayed: FilterSums,
    recorded_health: Health,
    same: u64,
    different: u64,
    first_different: Option<Time>,
    largest_mdeg: f64,
}

impl Default for ReplaySums {
    fn default() -> Self {
        Self {
            recorded: FilterSums::default(),
            replayed: FilterSums::default(),
            recorded_health: Health::Waiting,
            same: 0,
            different: 0,
            first_different: None,
            largest_mdeg: 0.0,
        }
    }
}

fn same_bits(one: &Estimate<f32>, other: &Estimate<f32>) -> bool {
    let bits = |estimate: &Estimate<f32>| {
        let Estimate { at, angle, rate_rad_s, angle_rad2, angle_rate_rad2_s, rate_rad2_s2, resting } =
            *estimate;
        let floats = [rate_rad_s, angle_rad2, angle_rate_rad2_s, rate_rad2_s2].map(f32::to_bits);
        (at, angle, floats, resting)
    };
    bits(one) == bits(other)
}

impl ReplaySums {
    /// The health of the recorded estimates from now on: good at level 0.
    pub(super) fn recorded_health(&mut self, level: u32) {
        self.recorded_health = if level == 0 { Health::Good } else { Health::Waiting };
    }

    fn compare(&mut self, at: Time, same: bool) {
        if same {
            self.same += 1;
        } else {
            self.different += 1;
            self.first_different = self.first_different.or(Some(at));
        }
    }

    /// Adds what became of a frame, and whether that is as recorded.
    pub(super) fn innovation(
        &mut self,
        at: Time,
        innovation: &Innovation<f32>,
        recorded: Option<&channels::Innovation>,
        same: bool,
    ) {
        let verdict = match innovation.verdict {
            Verdict::Used => "Used",
            Verdict::Restarted => "Restarted",
            Verdict::Rejected(_) => "Rejected",
        };
        self.replayed.innovation(verdict, innovation.normalised_squared().map(f64::from));
        if let Some(recorded) = recorded {
            let nis = f64::from(recorded.normalised_squared);
            self.recorded.innovation(&recorded.verdict, nis.is_finite().then_some(nis));
            self.compare(at, same);
        }
    }

    /// Adds an estimate at a logged tick.
    pub(super) fn estimate(
        &mut self,
        at: Time,
        estimate: Option<&Estimate<f32>>,
        health: Health,
        recorded: Option<&Estimate<f32>>,
        truth: Option<Angle>,
    ) {
        if let Some(estimate) = estimate {
            self.replayed.estimate(estimate, health, truth);
        }
        if let Some(recorded) = recorded {
            self.recorded.estimate(recorded, self.recorded_health, truth);
            self.compare(at, estimate.is_some_and(|estimate| same_bits(estimate, recorded)));
            if let Some(estimate) = estimate {
                let off_mdeg = 1e3 * estimate.angle.minus(recorded.angle).degrees();
                self.largest_mdeg = self.largest_mdeg.max(off_mdeg.abs());
            }
        }
    }

    /// The figures of a log that ends at `end`; the names are those of the recorded and the replayed filter.
    pub(super) fn figures(
        &self,
        command: &str,
        (recorded, replayed): (String, &str),
        end: Time,
        damage: Option<String>,
    ) -> Replayed {
        let seconds = |time: Time| time.seconds_since(Time::ZERO);
        Replayed {
            logged_command: command.to_owned(),
            duration_s: seconds(end),
            recorded: self.recorded.figures(recorded),
            replayed: self.replayed.figures(replayed.to_owned()),
            same: self.same,
            different: self.different,
            first_different_s: self.first_different.map(seconds),
            largest_difference_mdeg: self.largest_mdeg,
            damage,
        }
    }
}

impl Replayed {
    /// The figures by which the replayed filter is judged. The log is the same whatever replays it, so that each is one
    /// value without a measure of its chance. None names the filter, so that two filters can be compared.
    pub fn key_figures(&self) -> Vec<KeyFigure> {
        let FilterFigures { rms_error_mdeg, stated, frames_refused, starts, nis, .. } = &self.replayed;
        let figures = [
            rms_error_mdeg
                .map(|mdeg| KeyFigure::single("error of the angle", "mdeg rms", mdeg).lower_is_better()),
            stated
                .and_then(|stated| stated.beyond_3_sigma)
                .map(|share| KeyFigure::single("beyond 3 sigma", "%", 100.0 * share)),
            stated.map(|stated| {
                let count = real(stated.good_beyond_5_sigma);
                KeyFigure::single("estimates called good beyond 5 sigma", "", count).lower_is_better()
            }),
            nis.map(|nis| KeyFigure::single("mean NIS of frames used", "", nis)),
            Some(KeyFigure::single("frames refused", "", real(*frames_refused))),
            Some(KeyFigure::single("starts and restarts", "", real(*starts))),
        ];
        figures.into_iter().flatten().collect()
    }

    fn verdict(&self) -> String {
        let Self { same, different, largest_difference_mdeg, .. } = self;
        match self.first_different_s {
            None if *same == 0 => "nothing to compare with: the log has no estimates".to_owned(),
            None => format!("all {same} estimates and innovations have the recorded bits"),
            Some(first_s) => format!(
                "{different} of {} estimates and innovations differ, from {first_s:.5} s on, by \
                 {largest_difference_mdeg:.3} mdeg at most",
                same + different
            ),
        }
    }
}

impl fmt::Display for Replayed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "log                {}, {:.4} s", self.logged_command, self.duration_s)?;
        writeln!(f, "compared           {}", self.verdict())?;
        if let Some(damage) = &self.damage {
            writeln!(f, "damage             {damage}; read up to there")?;
        }
        let mut table = Table::new(&["", "recorded", "replayed"]);
        let filters = [&self.recorded, &self.replayed];
        let mut row = |name: &str, cell: &dyn Fn(&FilterFigures) -> String| {
            table.push([vec![name.to_owned()], filters.map(cell).to_vec()].concat());
        };
        let or_dash = |value: Option<String>| value.unwrap_or_else(|| "-".to_owned());
        row("filter", &|of| of.filter.clone());
        row("estimates at logged ticks", &|of| of.estimates.to_string());
        if self.replayed.stated.is_some() {
            row("their error rms, mdeg", &|of| or_dash(of.rms_error_mdeg.map(|mdeg| format!("{mdeg:.3}"))));
            row("beyond 3 sigma, %", &|of| {
                hundredths_or_dash(
                    of.stated.and_then(|stated| stated.beyond_3_sigma).map(|share| 100.0 * share),
                )
            });
            row("good and beyond 5 sigma", &|of| {
                or_dash(of.stated.map(|stated| stated.good_beyond_5_sigma.to_string()))
            });
        }
        row("mean NIS of frames used", &|of| or_dash(of.nis.map(|nis| format!("{nis:.3}"))));
        row("frames used", &|of| of.frames_used.to_string());
        row("frames refused", &|of| of.frames_refused.to_string());
        row("starts and restarts", &|of| of.starts.to_string());
        f.write_str(&table.text())
    }
}
