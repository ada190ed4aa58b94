//! The reproduction as pictures: counterparts of the paper's Figs 5 to 7 and 9 to 11, and mode B against the step.
//!
//! Fig. 8 is a record of the experiment. Its counterpart is the simulated motion.

use motor_model::DriveMode;

use super::published::{CASES, PaperSection, Printed, Quantity};
use super::reproduction::{PaperReproduction, SimulatedTrend};
use super::runs::{STEP_S, paper_run};
use super::trend::TrendLine;
use crate::report::chart::{Axis, Colour, Figure, Panel, Series};
use simulation::math::spectrum::{SAMPLE_RATE_HZ, Spectrum, Tail};
use simulation::runs::RunError;
use simulation::runs::simulate::{MotorSample, Observer, simulate};

/// Keeps the samples from `from_s` to `to_s`.
struct Window {
    interval_s: f64,
    from_s: f64,
    to_s: f64,
    samples: Vec<MotorSample>,
}

impl Observer for Window {
    fn interval_s(&self) -> Option<f64> {
        Some(self.interval_s)
    }

    fn observe(&mut self, sample: &MotorSample) -> Result<(), RunError> {
        if sample.time_s >= self.from_s && sample.time_s <= self.to_s {
            self.samples.push(*sample);
        }
        Ok(())
    }
}

/// The samples of a run of the paper from `from_s` to `to_s`.
fn recorded(
    (mode, step_s, seed): (DriveMode, f64, u64),
    interval_s: f64,
    (from_s, to_s): (f64, f64),
) -> Result<Vec<MotorSample>, RunError> {
    let mut window = Window { interval_s, from_s, to_s, samples: Vec::new() };
    simulate(&paper_run(mode, &[], step_s, seed)?, &mut window)?;
    Ok(window.samples)
}

fn points(samples: &[MotorSample], value: impl Fn(&MotorSample) -> (f64, f64)) -> Vec<(f64, f64)> {
    samples.iter().map(value).collect()
}

/// The figure of Table 3 for a mode.
fn printed(mode: DriveMode, quantity: Quantity) -> Option<Printed> {
    let case = CASES.iter().find(|case| case.place == PaperSection::Table3 && case.mode == mode)?;
    case.figures.iter().find(|figure| figure.quantity == quantity).map(|figure| figure.paper)
}

const fn colour(mode: DriveMode) -> Colour {
    match mode {
        DriveMode::B => Colour::Vermilion,
        DriveMode::C => Colour::Blue,
    }
}

impl PaperReproduction {
    /// Every picture, with the name of its file.
    ///
    /// # Errors
    /// When a run fails.
    pub fn pictures(&self) -> Result<Vec<(String, Figure)>, RunError> {
        let mut pictures = vec![
            ("motion_mode_b.svg".to_owned(), motion(DriveMode::B, 0.2, 0.006)?),
            ("motion_mode_c.svg".to_owned(), motion(DriveMode::C, 0.05, 0.003)?),
            ("spin_up.svg".to_owned(), spin_up(self.seeds)?),
            ("spectra.svg".to_owned(), spectra(self.seeds)?),
            ("mode_b_step.svg".to_owned(), self.mode_b_step()),
        ];
        for trend in &self.trends {
            let file = format!("trend_{}.svg", trend.varied.replace(' ', "_"));
            pictures.push((file, trend_picture(trend)));
        }
        Ok(pictures)
    }

    fn mode_b_step(&self) -> Figure {
        let rates =
            self.mode_b_steps.iter().map(|row| (1e6 * row.step_s, row.rate_rad_s.mean, row.rate_rad_s.sd));
        let rates: Vec<_> = rates.collect();
        let mut panel = Panel::new(
            "Rate in mode B",
            Axis::new("step (us)").logarithmic().within(0.08..12.5),
            Axis::new("rate (rad/s)").within(0.0..16.0),
        )
        .height(340);
        if let Some(Printed { mean, sd: Some(sd) }) = printed(DriveMode::B, Quantity::Rate) {
            let band = [0.08, 12.5].map(|x| (x, mean - sd, mean + sd)).to_vec();
            panel =
                panel.series(Series::band(band).colour(Colour::Grey).opacity(0.35).label("paper, \u{b1} sd"));
        }
        let panel = panel
            .series(Series::dashes(vec![(0.08, 1.0), (12.5, 1.0)]).colour(Colour::Black).label("experiment"))
            .series(
                Series::line(rates.iter().map(|point| (point.0, point.1)).collect())
                    .colour(Colour::Vermilion)
                    .opacity(0.4),
            )
            .series(Series::error_bars(rates).colour(Colour::Vermilion).label("ours, \u{b1} sd"));
        Figure::new("Mode B: the published rate is that of a coarse step")
            .caption(
                "An impact at the end of its step comes late. The finer the step, the smaller the effect.",
            )
            .panel(panel)
    }
}

/// Velocity and height of the rotor, and a detail with the teeth. Counterpart of Figs 5 and 6.
fn motion(mode: DriveMode, length_s: f64, detail_s: f64) -> Result<Figure, RunError> {
    let end_s = 2.0;
    let start_s = end_s - length_s;
    let samples = recorded((mode, STEP_S, 1), 10e-6, (start_s, end_s))?;
    // The detail starts in the middle of the record.
    let detail_from_s = start_s + 0.5 * length_s;
    let detail = recorded((mode, STEP_S, 1), STEP_S, (detail_from_s, detail_from_s + detail_s))?;
    let milliseconds = |time_s: f64| 1e3 * (time_s - start_s);
    let time = || Axis::new("time (ms)").within(0.0..1e3 * length_s);
    let detail_time =
        Axis::new("time (ms)").within(milliseconds(detail_from_s)..milliseconds(detail_from_s + detail_s));
    let detail_span = || {
        let span = vec![(milliseconds(detail_from_s), milliseconds(detail_from_s + detail_s))];
        Series::spans(span).colour(Colour::Orange).opacity(0.3)
    };
    let tooth = |index: usize| points(&detail, |s| (milliseconds(s.time_s), 1e6 * s.tooth_heights_m[index]));
    let figure = Figure::new(format!("Mode {mode:?}: the rotor on the vibrating teeth"))
        .caption(format!(
            "Paper's friction law, step 1 us, seed 1; time from {start_s:.2} s after the drive came on."
        ))
        .panel(
            Panel::new("Vertical velocity", time(), Axis::new("velocity (mm/s)"))
                .series(detail_span())
                .series(
                    Series::line(points(&samples, |s| (milliseconds(s.time_s), 1e3 * s.velocity_m_s)))
                        .colour(colour(mode))
                        .width(1.0),
                ),
        )
        .panel(
            Panel::new("Height above the teeth at rest", time(), Axis::new("height (um)"))
                .series(detail_span().label("detail below"))
                .series(
                    Series::line(points(&samples, |s| (milliseconds(s.time_s), 1e6 * s.height_m)))
                        .colour(colour(mode)),
                ),
        )
        .panel(
            Panel::new("Detail: flight and impacts", detail_time, Axis::new("height (um)"))
                .height(280)
                .series(Series::line(tooth(0)).colour(Colour::Green).width(1.0).label("tooth pair 1"))
                .series(Series::line(tooth(1)).colour(Colour::Grey).width(1.0).label("tooth pair 2"))
                .series(
                    Series::line(points(&detail, |s| (milliseconds(s.time_s), 1e6 * s.height_m)))
                        .colour(colour(mode))
                        .width(2.0)
                        .label("rotor"),
                ),
        );
    Ok(figure)
}

/// Mean over the seeds of records with the same times.
fn mean_of(runs: &[Vec<(f64, f64)>]) -> Vec<(f64, f64)> {
    let Some((first, others)) = runs.split_first() else { return Vec::new() };
    let count = runs.iter().fold(0.0, |count, _| count + 1.0);
    let sum = |index: usize, y: f64| {
        others.iter().filter_map(|run| run.get(index)).fold(y, |sum, point| sum + point.1)
    };
    first.iter().enumerate().map(|(index, &(x, y))| (x, sum(index, y) / count)).collect()
}

/// Length of the spin-up that is shown.
const SPIN_UP_S: f64 = 0.6;

/// Mean rate between samples, from the angle turned. The rate itself jumps at each impact.
fn mean_rates(samples: &[MotorSample]) -> Vec<(f64, f64)> {
    let between = |pair: &[MotorSample]| {
        let (from, to) = (pair[0], pair[1]);
        let turned_rad = (to.angle_deg - from.angle_deg).to_radians();
        (0.5 * (from.time_s + to.time_s), turned_rad / (to.time_s - from.time_s))
    };
    std::iter::once((0.0, 0.0)).chain(samples.windows(2).map(between)).collect()
}

/// Rate from standstill. Counterpart of Fig. 7.
fn spin_up(seeds: u64) -> Result<Figure, RunError> {
    let rates = |mode, step_s| -> Result<Vec<Vec<(f64, f64)>>, RunError> {
        (1..=seeds)
            .map(|seed| Ok(mean_rates(&recorded((mode, step_s, seed), 5e-3, (0.0, SPIN_UP_S))?)))
            .collect()
    };
    let mut figure = Figure::new("Spin-up from standstill").caption(format!(
        "Rate over each 5 ms: {seeds} runs drawn faintly, and their mean. Clockwise is positive; only the drive \
         differs."
    ));
    for mode in [DriveMode::B, DriveMode::C] {
        let sign = if mode == DriveMode::B { 1.0 } else { -1.0 };
        let title = format!("Mode {mode:?}");
        let mut panel =
            Panel::new(title, Axis::new("time (s)").within(0.0..SPIN_UP_S), Axis::new("rate (rad/s)"))
                .height(270);
        if let Some(Printed { mean, sd: Some(sd) }) = printed(mode, Quantity::Rate) {
            let band = [0.0, SPIN_UP_S].map(|x| (x, sign * mean - sd, sign * mean + sd)).to_vec();
            panel =
                panel.series(Series::band(band).colour(Colour::Grey).opacity(0.4).label("paper, \u{b1} sd"));
        }
        let runs = rates(mode, STEP_S)?;
        for run in &runs {
            panel = panel.series(Series::line(run.clone()).colour(colour(mode)).opacity(0.18).width(0.8));
        }
        if mode == DriveMode::B {
            let coarse = mean_of(&rates(mode, 10.0 * STEP_S)?);
            panel = panel.series(Series::line(coarse).colour(Colour::Purple).width(1.6).label("step 10 us"));
        }
        panel = panel.series(Series::line(mean_of(&runs)).colour(colour(mode)).width(1.8).label("step 1 us"));
        figure = figure.panel(panel);
    }
    Ok(figure)
}

/// Spectra of velocity and height. Counterpart of Fig. 9.
fn spectra(seeds: u64) -> Result<Figure, RunError> {
    let mut figure = Figure::new("Spectra of the rotor's vertical motion").caption(format!(
        "20 kHz, last 16,384 samples, mean removed, no window: {seeds} runs drawn faintly, and their mean amplitude."
    ));
    for (mode, limit_hz) in [(DriveMode::B, 400.0), (DriveMode::C, 1500.0)] {
        let samples: Result<Vec<Vec<MotorSample>>, _> = (1..=seeds)
            .map(|seed| recorded((mode, STEP_S, seed), 1.0 / SAMPLE_RATE_HZ, (0.5, 2.0)))
            .collect();
        let samples = samples?;
        let lines = |value: fn(&MotorSample) -> f64| -> Vec<Vec<(f64, f64)>> {
            let spectrum = |run: &Vec<MotorSample>| -> Spectrum {
                let mut tail = Tail::default();
                for sample in run {
                    tail.push(value(sample));
                }
                tail.spectrum(SAMPLE_RATE_HZ)
            };
            let shown = |run: &Vec<MotorSample>| {
                let lines =
                    spectrum(run).lines.into_iter().skip(1).take_while(|line| line.frequency_hz <= limit_hz);
                lines.map(|line| (line.frequency_hz, line.amplitude)).collect()
            };
            samples.iter().map(shown).collect()
        };
        let frequency = printed(mode, Quantity::CollisionFrequency);
        for (what, runs) in [
            ("velocity (mm/s)", lines(|sample| 1e3 * sample.velocity_m_s)),
            ("height (um)", lines(|sample| 1e6 * sample.height_m)),
        ] {
            let title = format!("Mode {mode:?}: {}", what.split(' ').next().unwrap_or(what));
            let mut panel =
                Panel::new(title, Axis::new("frequency (Hz)").within(0.0..limit_hz), Axis::new(what))
                    .height(205);
            if let Some(Printed { mean, sd: Some(sd) }) = frequency {
                let span = Series::spans(vec![(mean - sd, mean + sd)]).colour(Colour::Grey).opacity(0.35);
                panel = panel.series(span.label("paper's collision frequency, \u{b1} sd"));
            }
            for run in &runs {
                panel = panel.series(Series::line(run.clone()).colour(colour(mode)).opacity(0.16).width(0.7));
            }
            figure = figure.panel(
                panel.series(Series::line(mean_of(&runs)).colour(colour(mode)).width(1.5).label("ours")),
            );
        }
    }
    Ok(figure)
}

/// Frequency and rate against a parameter. Counterpart of Figs 10 and 11.
fn trend_picture(trend: &SimulatedTrend) -> Figure {
    let axis = format!("{} ({})", trend.varied, trend.trend.unit.0);
    let mut figure = Figure::new(format!("Mode C against {}", trend.varied))
        .caption(format!(
            "Counterpart of the paper's Fig. {}: mean and sd over the seeds, and the straight line through the means.",
            trend.picture
        ));
    for TrendLine { quantity, unit, points, line, paper_rises, .. } in &trend.courses {
        let bars = points.iter().map(|(x, spread)| (*x, spread.mean, spread.sd)).collect();
        let ends = [points.first(), points.last()].into_iter().flatten();
        let fit = ends.map(|(x, _)| (*x, line.intercept + line.slope * x)).collect();
        let says = if *paper_rises { "rises" } else { "falls" };
        let mut words = quantity.to_string();
        words.replace_range(..1, &words[..1].to_uppercase());
        let panel = Panel::new(
            format!("{words}: the paper says it {says}"),
            Axis::new(axis.clone()),
            Axis::new(format!("{quantity} ({unit})")),
        )
        .height(280)
        .series(
            Series::line(fit)
                .colour(Colour::Grey)
                .width(1.6)
                .label(format!("line, r = {:.3}", line.correlation).replace('-', "\u{2212}")),
        )
        .series(Series::error_bars(bars).colour(Colour::Blue).label("ours, \u{b1} sd"));
        figure = figure.panel(panel);
    }
    figure
}
