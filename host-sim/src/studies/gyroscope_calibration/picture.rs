//! The picture of a calibration: gyroscope against reference, the residuals of the fit, Allan deviation, and the
//! intervals of every run.

use motor_model::math;

use super::{Calibration, CalibrationOutcome, Calibrations};
use crate::report::chart::{Axis, Colour, Figure, Panel, Series};
use analysis::gyroscope_fit::FitInterval;
use simulation::math::count::real;
use simulation::math::statistics::NORMAL_95;
use simulation::world::instruments::gyroscope::noise::TimeSpan;

/// The plan in the legend. It asks the full rate of a motor by a rate that none reaches.
const PLAN: &str = "plan, which may ask for more than the motor's full rate";

/// Most runs whose intervals are drawn.
const SHOWN_MAX: usize = 200;

impl Calibration {
    /// The intervals fitted.
    fn fitted(&self) -> Vec<FitInterval> {
        self.intervals.iter().filter(|(_, saturated)| !saturated).map(|(interval, _)| *interval).collect()
    }

    /// Sums of `of` each interval fitted, by the time at which it ends.
    fn sums(&self, of: impl IntoIterator<Item = f64>) -> Vec<(f64, f64)> {
        let mut sum = 0.0;
        let of_each = self.fitted().into_iter().zip(of);
        of_each
            .map(|(interval, of)| {
                sum += of;
                (interval.span.until_s, sum)
            })
            .collect()
    }

    /// Times in which intervals were left out.
    fn left_out(&self) -> Vec<(f64, f64)> {
        let left_out = self.intervals.iter().filter(|(_, saturated)| *saturated);
        left_out.map(|(interval, _)| (interval.span.from_s, interval.span.until_s)).collect()
    }

    /// Gyroscope less reference in each interval fitted, in degrees, and what the fit explains of it.
    fn seen_and_explained(&self) -> (Vec<f64>, Vec<f64>) {
        let fitted = self.fitted();
        let seen = fitted.iter().map(|interval| interval.shown_deg - interval.turned_deg).collect();
        (seen, self.fit.explained_deg(&fitted, &self.unknowns))
    }

    fn before(&self) -> Panel {
        let (seen, explained) = self.seen_and_explained();
        Panel::new("Gyroscope less reference, summed", Axis::new("time (s)"), Axis::new("angle (deg)"))
            .series(Series::line(self.sums(seen)).colour(Colour::Blue).width(2.0).label("seen"))
            .series(Series::dashes(self.sums(explained)).colour(Colour::Vermilion).label("fit"))
    }

    fn after(&self) -> Panel {
        let fit = &self.fit;
        let (seen, explained) = self.seen_and_explained();
        let left_mdeg = seen.iter().zip(explained).map(|(seen, explained)| 1e3 * (seen - explained));
        let fitted = self.fitted();
        // Where intervals are left out, the reference counts at both ends of the gap.
        let mut before: Option<&FitInterval> = None;
        let (mut gaps_deg2, mut coning_deg2) = (0.0, 0.0);
        let mut band = Vec::new();
        let reference_deg2 = |interval: &FitInterval| fit.strengths.reference_deg2(interval);
        for interval in &fitted {
            let TimeSpan { from_s, until_s } = interval.span;
            let adjoins = before.is_some_and(|before| before.span.until_s.total_cmp(&from_s).is_eq());
            if !adjoins {
                gaps_deg2 +=
                    before.map_or(0.0, |before| reference_deg2(before).1) + reference_deg2(interval).0;
            }
            before = Some(interval);
            let whole = TimeSpan { from_s: 0.0, until_s };
            coning_deg2 += fit.strengths.coning_deg2(interval);
            let reference_deg2 = gaps_deg2 + reference_deg2(interval).1;
            let own_deg2 = self.noise.covariance_deg2(whole, whole);
            let half = 1e3 * NORMAL_95 * math::sqrt(own_deg2 + reference_deg2 + coning_deg2);
            band.push((until_s, -half, half));
        }
        let sums = self.sums(left_mdeg);
        Panel::new("What the fit leaves of it", Axis::new("time (s)"), Axis::new("angle (mdeg)"))
            .series(
                Series::band(band)
                    .colour(Colour::Grey)
                    .label("95 % of the noise: gyroscope, reference and coning"),
            )
            .series(Series::line(sums).colour(Colour::Blue))
    }
}

impl Calibrations {
    /// The picture.
    pub(crate) fn figure(&self) -> Figure {
        let CalibrationOutcome {
            seed,
            serial,
            scale_factor_ppm,
            scale_factor_sigma_ppm,
            bias_deg_h,
            bias_sigma_deg_h,
            ..
        } = &self.first.outcome;
        let figure = Figure::new("Calibration of a gyroscope in closed loop")
            .caption(format!(
                "Motor drawn by seed {seed}, gyroscope {serial}: scale factor {scale_factor_ppm:+.1} +- {:.1} ppm, \
                 bias {bias_deg_h:+.1} +- {:.1} deg/h (95 %)",
                NORMAL_95 * scale_factor_sigma_ppm,
                NORMAL_95 * bias_sigma_deg_h
            ))
            .panel(self.rates())
            .panel(self.first.before())
            .panel(self.first.after())
            .panel(self.allan())
            .panel(self.budget_panel());
        if self.outcomes.len() < 2 {
            return figure;
        }
        figure
            .panel(self.intervals("Scale factor of every run: error and 95 % interval", "error (ppm)", |o| {
                (o.scale_factor_error_ppm, o.scale_factor_sigma_ppm, o.covers_scale_factor())
            }))
            .panel(self.intervals("Bias of every run", "error (deg/h)", |o| {
                (o.bias_error_deg_h, o.bias_sigma_deg_h, o.covers_bias())
            }))
    }

    fn rates(&self) -> Panel {
        let asked = |time_s: f64| self.schedule.rate_deg_s(time_s);
        let middles = self.first.rates_deg_s.iter().map(|&(time_s, _)| (time_s, asked(time_s)));
        let asked = middles.collect();
        Panel::new(
            "Rate: the plan, and what the gyroscope shows (means of 50 ms)",
            Axis::new("time (s)"),
            Axis::new("rate (deg/s)"),
        )
        .series(Series::spans(self.first.left_out()).colour(Colour::Vermilion).label("saturated, left out"))
        .series(
            Series::line(self.first.rates_deg_s.clone()).colour(Colour::Blue).width(0.8).label("gyroscope"),
        )
        .series(Series::steps(asked).colour(Colour::Black).label(PLAN))
    }

    fn allan(&self) -> Panel {
        let seen = self.allan_deg_h.iter().map(|&(span_s, seen, _)| (span_s, seen)).collect();
        let model = self.allan_deg_h.iter().map(|&(span_s, _, model)| (span_s, model)).collect();
        Panel::new(
            "Allan deviation, an hour at rest",
            Axis::new("span of the mean (s)").logarithmic(),
            Axis::new("deviation (deg/h)").logarithmic(),
        )
        .series(Series::line(model).colour(Colour::Black).label("model"))
        .series(Series::points(seen).colour(Colour::Blue).label("samples"))
    }

    /// Errors with their intervals by run; those that miss the truth have a colour of their own.
    fn intervals(
        &self,
        title: &str,
        unit: &str,
        of: impl Fn(&CalibrationOutcome) -> (f64, f64, bool),
    ) -> Panel {
        let bars = |covered: bool| {
            let shown = (0_u32..).zip(self.outcomes.iter().take(SHOWN_MAX));
            let bar = |(run, outcome): (u32, &CalibrationOutcome)| {
                let (error, sigma, holds) = of(outcome);
                (holds == covered).then_some((f64::from(run), error, NORMAL_95 * sigma))
            };
            shown.filter_map(bar).collect::<Vec<_>>()
        };
        let end = real(self.outcomes.len().min(SHOWN_MAX));
        Panel::new(title, Axis::new("run (number)").within(-1.0..end), Axis::new(unit))
            .series(
                Series::error_bars(bars(true))
                    .colour(Colour::Blue)
                    .opacity(0.6)
                    .width(0.8)
                    .label("holds the truth"),
            )
            .series(Series::error_bars(bars(false)).colour(Colour::Vermilion).label("misses it"))
            .series(Series::line(vec![(-1.0, 0.0), (end, 0.0)]).colour(Colour::Black).width(0.8))
    }
}
