//! The report on a move: its picture, some impacts up close, innovations with their bounds, phases and
//! health, and what the figures are worth.

use super::{PictureTrace, ReportTrace, picture};
use crate::report::chart::{Axis, Colour, Figure, Panel, Series};
use crate::report::document::Document;
use crate::report::html::HtmlReport;
use crate::run_reports::parts::{bench_lines, cost_lines, course, stated_lines};
use simulation::math::count::real;
use simulation::runs::health_words::{self, why_not_good};
use simulation::runs::not_modelled::not_modelled;
use simulation::runs::position::{MoveOutcome, MovePlan};
use simulation::scene::Scene;

/// What a run cost.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MoveCost {
    /// Time that the run took on this machine.
    pub(crate) wall_s: f64,
}

/// The report on the move of `scene`.
pub(crate) fn report(
    scene: &Scene,
    plan: &MovePlan,
    outcome: &MoveOutcome,
    (picture, trace): (&PictureTrace, &ReportTrace),
    cost: MoveCost,
) -> HtmlReport {
    let beside = [impacts(trace), innovations(outcome, trace)];
    let courses = [phases(outcome, trace), health(outcome, trace)];
    let figure =
        picture::panels(outcome, picture).into_iter().chain(beside.into_iter().flatten()).chain(courses);
    HtmlReport {
        title: format!("Move to {} degrees in closed loop", outcome.target_deg),
        verdict: verdict(outcome),
        asked: asked(scene, plan),
        figures: vec![figure.fold(Figure::new(""), Figure::panel)],
        happened: happened(outcome, trace),
        sure: sure(outcome, trace),
        cost: Document::of_lines(cost_lines(outcome.duration_s, cost.wall_s)),
        not_modelled: not_modelled(scene),
    }
}

fn verdict(outcome: &MoveOutcome) -> String {
    let MoveOutcome { final_error_mdeg, target_deg, duration_s, .. } = outcome;
    match (&outcome.reason, outcome.settle_time_s) {
        (Some(reason), _) => format!(
            "Given up after {duration_s:.3} s, {final_error_mdeg:+.2} milli-degrees from {target_deg} degrees: \
             {reason}."
        ),
        (None, Some(settle_s)) => format!(
            "{}: {final_error_mdeg:+.3} milli-degrees from {target_deg} degrees, held from {settle_s:.3} s on.",
            if outcome.ok { "On target" } else { "Held as on target, but off it" }
        ),
        (None, None) => format!("{final_error_mdeg:+.3} milli-degrees from {target_deg} degrees."),
    }
}

fn asked(scene: &Scene, plan: &MovePlan) -> Document {
    let mut lines = vec![
        ("target", format!("{} deg, clockwise positive", plan.target_deg)),
        ("tolerance", format!("{} deg", plan.error_deg)),
        ("deadline", format!("{} s", plan.deadline_s)),
        ("promised before", format!("{:.3} s +- {:.3} s", plan.expected_s, plan.expected_sd_s)),
        ("of it measuring", format!("{:.3} s for {:.0} frames", plan.measuring_s, plan.frames)),
    ];
    lines.extend(bench_lines(scene, &|_| true));
    Document::of_lines(lines)
}

fn happened(outcome: &MoveOutcome, trace: &ReportTrace) -> Document {
    let document = Document::of_lines(outcome.lines());
    document.paragraphs(why_not_good(trace.healths.iter().map(|(_, health)| *health)))
}

fn sure(outcome: &MoveOutcome, trace: &ReportTrace) -> Document {
    let share = |part: u64| 100.0 * real(part) / real(trace.predicted.max(1));
    let sigma = trace.sigma_mdeg.map_or_else(|| "none".to_owned(), |sigma| format!("{sigma:.3} mdeg"));
    let mut lines = vec![
        ("standard deviation of the angle, as reported at the end", sigma),
        ("true error at the end", format!("{:+.3} mdeg", outcome.final_error_mdeg)),
    ];
    lines.extend(stated_lines(&outcome.stated));
    lines.extend([
        (
            "innovations beyond two standard deviations",
            format!(
                "{:.1} % of {} frames; of normal ones 4.6 %",
                share(trace.beyond_2_sigma),
                trace.predicted
            ),
        ),
        ("frames rejected, restarts", format!("{}, {}", trace.rejected, trace.restarted)),
    ]);
    Document::of_lines(lines).paragraph(
        "The truth is known because this is a simulation. This is one move of one motor that the seed draws: it gives \
         no spread. `positioning-trials` moves many.",
    )
}

/// Vertical velocity and rate over some impacts.
fn impacts(trace: &ReportTrace) -> Vec<Panel> {
    let (Some(first), Some(last)) = (trace.close.first(), trace.close.last()) else { return Vec::new() };
    let start_s = first.at_s;
    let ms = |at_s: f64| 1e3 * (at_s - start_s);
    let end_ms = ms(last.at_s).max(0.1);
    let driven_ms =
        trace.close.iter().take_while(|tick| tick.driven).last().map_or(0.0, |tick| ms(tick.at_s));
    let time = || Axis::new(format!("time since {start_s:.5} s (ms)")).within(0.0..end_ms);
    let on = || Series::spans(vec![(0.0, driven_ms)]).colour(Colour::Orange).label("drive on");
    let rates = trace.close.iter().map(|tick| (ms(tick.at_s), tick.rate_rad_s)).collect();
    let truth = trace.close.iter().map(|tick| (ms(tick.at_s), 1e3 * tick.velocity_m_s)).collect();
    let within = |points: &[(f64, f64)]| -> Vec<(f64, f64)> {
        let points = points.iter().map(|(at_s, velocity_m_s)| (ms(*at_s), 1e3 * velocity_m_s));
        points.filter(|(at_ms, _)| (0.0..=end_ms).contains(at_ms)).collect()
    };
    let samples = within(&trace.samples);
    let velocity =
        Panel::new("Impacts up close: vertical velocity of the rotor", time(), Axis::new("velocity (mm/s)"))
            .series(on())
            .series(Series::line(truth).colour(Colour::Blue).width(1.5).label("truth"));
    let velocity = if samples.is_empty() {
        velocity
    } else {
        velocity.series(Series::points(samples).colour(Colour::Vermilion).width(-1.0).label("vibrometer"))
    };
    let velocity = velocity.series(
        Series::points(within(&trace.impacts)).colour(Colour::Black).width(2.0).label("after an impact"),
    );
    vec![
        velocity,
        Panel::new("The same impacts: rate of the rotor", time(), Axis::new("rate (rad/s)"))
            .series(on())
            .series(Series::line(rates).colour(Colour::Blue).width(1.5).label("truth")),
    ]
}

/// Innovations of the camera within two standard deviations as predicted.
fn innovations(outcome: &MoveOutcome, trace: &ReportTrace) -> Vec<Panel> {
    if trace.frames.is_empty() {
        return Vec::new();
    }
    let band = trace
        .frames
        .iter()
        .map(|frame| (frame.at_s, -2.0 * frame.sigma_mdeg, 2.0 * frame.sigma_mdeg))
        .collect();
    let of = |used: bool| -> Vec<(f64, f64)> {
        let frames = trace.frames.iter().filter(|frame| frame.used == used);
        frames.map(|frame| (frame.at_s, frame.innovation_mdeg)).collect()
    };
    let mut sigmas: Vec<f64> = trace.frames.iter().map(|frame| frame.sigma_mdeg).collect();
    sigmas.sort_by(f64::total_cmp);
    // The first frames are far less certain than the rest.
    let range = 6.0 * sigmas[sigmas.len() * 9 / 10].max(1e-6);
    let panel = Panel::new(
        "Innovations of the camera: measured less predicted",
        Axis::new("time (s)").within(0.0..outcome.duration_s),
        Axis::new("innovation (mdeg)").within(-range..range),
    )
    .series(Series::band(band).colour(Colour::Blue).label("two standard deviations, as predicted"))
    .series(Series::line(of(true)).colour(Colour::Black).width(1.0).label("frames used"));
    let refused = of(false);
    vec![if refused.is_empty() {
        panel
    } else {
        panel.series(Series::points(refused).colour(Colour::Vermilion).label("frames not used"))
    }]
}

fn phases(outcome: &MoveOutcome, trace: &ReportTrace) -> Panel {
    let changes: Vec<(f64, String)> =
        trace.phases.iter().map(|(at, name)| (*at, (*name).to_owned())).collect();
    course("What the controller did", outcome.duration_s, &changes)
}

fn health(outcome: &MoveOutcome, trace: &ReportTrace) -> Panel {
    let changes: Vec<(f64, String)> =
        trace.healths.iter().map(|(at, health)| (*at, health_words::words(*health))).collect();
    course("Health of the estimate", outcome.duration_s, &changes)
}
