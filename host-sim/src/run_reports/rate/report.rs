//! The report on a held rate: its picture, health, and what the figures are worth.

use super::picture;
use crate::report::chart::Figure;
use crate::report::document::Document;
use crate::report::html::HtmlReport;
use crate::run_reports::parts::{bench_lines, cost_lines, course, stated_lines};
use simulation::runs::health_words::{self, why_not_good};
use simulation::runs::not_modelled::not_modelled;
use simulation::runs::rate::{RateOutcome, RatePoint, SETTLE_S};
use simulation::scene::Scene;

/// The report on the rate of `scene`, which was drawn by `points`.
pub(crate) fn report(scene: &Scene, outcome: &RateOutcome, points: &[RatePoint], wall_s: f64) -> HtmlReport {
    let end_s = scene.number("rate.duration_s");
    let healths: Vec<(f64, String)> =
        points.iter().map(|point| (point.time_s, health_words::words(point.health))).collect();
    let health = course("Health of the estimate, every 5 ms", end_s, &healths);
    let panels = picture::panels(points).into_iter().chain([health]);
    HtmlReport {
        title: format!("Rate of {} degrees a second in closed loop", outcome.rate_deg_s),
        verdict: format!(
            "The mean rate is {:+.4} degrees a second for {:+.4} asked for over {:.2} s{}.",
            outcome.mean_deg_s,
            outcome.asked_deg_s,
            outcome.measured_s,
            outcome.off(3)
        ),
        asked: asked(scene),
        figures: vec![panels.fold(Figure::new(""), Figure::panel)],
        happened: Document::of_lines(outcome.lines())
            .paragraphs(why_not_good(points.iter().map(|point| point.health))),
        sure: sure(outcome),
        cost: Document::of_lines(cost_lines(end_s, wall_s)),
        not_modelled: not_modelled(scene),
    }
}

fn asked(scene: &Scene) -> Document {
    let mut lines = vec![
        ("rate", format!("{} deg/s, clockwise positive", scene.number("rate.deg_s"))),
        ("profile", scene.choice("rate.profile").replace('_', " ")),
        ("length", format!("{} s", scene.number("rate.duration_s"))),
        ("left out to settle", format!("{SETTLE_S} s at the start and after each step of a staircase")),
    ];
    lines.extend(bench_lines(scene, &|_| true));
    Document::of_lines(lines)
}

fn sure(outcome: &RateOutcome) -> Document {
    Document::of_lines(stated_lines(&outcome.stated)).paragraph(
        "The truth is known because this is a simulation. The error of the mean is the error of the angle over the \
         time, so that a longer run measures it better. This is one run of one motor that the seed draws: it gives no \
         spread.",
    )
}
