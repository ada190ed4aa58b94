//! The report on an open-loop run: the motion in slow motion, the rate, the spectrum.

use super::OpenLoopTrace;
use crate::report::chart::{Axis, Colour, Figure, Panel, Series};
use crate::report::document::Document;
use crate::report::html::HtmlReport;
use crate::run_reports::parts::cost_lines;
use simulation::math::spectrum::LIMIT_HZ;
use simulation::runs::not_modelled::{not_modelled_in_open_loop, of_rotor};
use simulation::runs::simulate::{MotorSample, OpenLoopReport};
use simulation::scene::Scene;

/// The report on the run of `scene`, with its `trace` and its motion up `close`.
pub(crate) fn html_report(
    report: &OpenLoopReport,
    scene: &Scene,
    trace: &OpenLoopTrace,
    close: &[MotorSample],
) -> HtmlReport {
    let panels = slow_motion(close).into_iter().chain([rates(report, trace), spectrum(report, trace)]);
    let not_modelled = std::iter::once(of_rotor(scene).to_owned()).chain(not_modelled_in_open_loop());
    HtmlReport {
        title: title(report),
        verdict: verdict(report),
        asked: asked(report, scene),
        figures: vec![panels.fold(Figure::new(""), Figure::panel)],
        happened: Document::of_lines(report.lines()),
        sure: Document { blocks: Vec::new() }.paragraph(
            "The +- of the rate is the standard deviation of its samples, which are not independent: it is no \
             error of the mean. The vertical motion is chaotic, so that the amplitude of its largest line depends \
             on the length of the record. This is one run with one seed: it gives no spread over seeds.",
        ),
        cost: Document::of_lines(cost_lines(report.duration_s, report.wall_s)),
        not_modelled: not_modelled.collect(),
    }
}

fn title(report: &OpenLoopReport) -> String {
    match report.drive {
        "off" => "The motor without drive".to_owned(),
        drive => format!("The motor under a constant drive in mode {}", drive.to_uppercase()),
    }
}

fn verdict(report: &OpenLoopReport) -> String {
    let collides = report.collision_frequency_hz.map_or_else(
        || "Nothing collides.".to_owned(),
        |hertz| {
            format!(
                "Rotor and teeth collide {:.0} times a second; the largest line is at {hertz:.1} Hz.",
                report.impacts_per_s
            )
        },
    );
    format!(
        "The rotor turns at {:+.3} rad/s, clockwise positive, and {:+.2} degrees in all. {collides}",
        report.rotor_rate_mean_rad_s, report.angle_deg
    )
}

fn asked(report: &OpenLoopReport, scene: &Scene) -> Document {
    Document::of_lines([
        ("drive", format!("{}, amplitude {}", report.drive, report.amplitude)),
        ("rotor", scene.choice("plant.rotor").replace('_', " ")),
        ("time", format!("{} s, of which {} s to settle", report.duration_s, report.settle_s)),
        ("step", format!("{:.4} us, {}", 1e6 * report.step_s, report.precision)),
        ("impacts", report.impacts.replace('_', " ")),
        ("friction", report.friction.to_owned()),
        ("seed", report.seed.to_string()),
    ])
}

/// Mean rate over parts of the run.
fn rates(report: &OpenLoopReport, trace: &OpenLoopTrace) -> Panel {
    let mean =
        [report.settle_s, report.duration_s].map(|time_s| (time_s, report.rotor_rate_mean_rad_s)).to_vec();
    let time = Axis::new("time (s)").within(0.0..report.duration_s);
    Panel::new("Rate of the rotor, mean of each part of the run", time, Axis::new("rate (rad/s)"))
        .series(
            Series::spans(vec![(0.0, report.settle_s)]).colour(Colour::Grey).label("settling, not counted"),
        )
        .series(Series::line(trace.rates_rad_s()).colour(Colour::Blue).label("rate"))
        .series(Series::dashes(mean).colour(Colour::Black).label("mean after settling"))
}

/// Amplitudes of the vertical velocity below the limit of impacts.
fn spectrum(report: &OpenLoopReport, trace: &OpenLoopTrace) -> Panel {
    let lines = trace.spectrum(report.sample_rate_hz).lines;
    let below = lines.iter().skip(1).take_while(|line| line.frequency_hz < LIMIT_HZ);
    let points = below.map(|line| (line.frequency_hz, 1e3 * line.amplitude)).collect();
    let panel = Panel::new(
        "Spectrum of the vertical velocity after settling",
        Axis::new("frequency (Hz)").within(0.0..LIMIT_HZ),
        Axis::new("amplitude (mm/s)"),
    )
    .series(Series::line(points).colour(Colour::Blue).width(1.0).label("rotor"));
    match report.collision_frequency_hz {
        Some(hertz) => panel.series(
            Series::points(vec![(hertz, 1e3 * report.collision_amplitude_m_s)])
                .colour(Colour::Vermilion)
                .width(2.0)
                .label("largest line"),
        ),
        None => panel,
    }
}

/// Height, velocity and rate over some milliseconds, and tilt and shift of a rotor that has them.
fn slow_motion(close: &[MotorSample]) -> Vec<Panel> {
    let (Some(first), Some(last)) = (close.first(), close.last()) else { return Vec::new() };
    let start_s = first.time_s;
    let ms = move |sample: &MotorSample| 1e3 * (sample.time_s - start_s);
    let end_ms = ms(last).max(1e-3);
    let time = || Axis::new(format!("time since {start_s:.4} s (ms)")).within(0.0..end_ms);
    let course = |value: &dyn Fn(&MotorSample) -> f64| -> Series {
        Series::line(close.iter().map(|sample| (ms(sample), value(sample))).collect())
    };
    let tooth = |index: usize| course(&move |sample| 1e6 * sample.tooth_heights_m[index]);
    let [one, two] =
        if first.pose.is_some() { ["tooth 1", "tooth 2"] } else { ["tooth pair 1", "tooth pair 2"] };
    let mut panels = vec![
        Panel::new("In slow motion: the rotor over the teeth", time(), Axis::new("height (um)"))
            .height(280)
            .series(tooth(0).colour(Colour::Green).width(1.0).label(one))
            .series(tooth(1).colour(Colour::Orange).width(1.0).label(two))
            .series(course(&|sample| 1e6 * sample.height_m).colour(Colour::Blue).width(2.0).label("rotor")),
        Panel::new("Its vertical velocity", time(), Axis::new("velocity (mm/s)"))
            .series(course(&|sample| 1e3 * sample.velocity_m_s).label("rotor")),
        Panel::new("Its rate, which steps at each impact", time(), Axis::new("rate (rad/s)"))
            .series(course(&|sample| sample.rate_rad_s).label("rotor")),
    ];
    if first.pose.is_some() {
        let slope =
            |axis: usize| course(&move |sample| sample.pose.map_or(0.0, |pose| 1e3 * pose.slope[axis]));
        let shift =
            |axis: usize| course(&move |sample| sample.pose.map_or(0.0, |pose| 1e6 * pose.shift_m[axis]));
        for (title, unit, along) in [
            ("Its tilt", "slope (mrad)", [slope(0), slope(1)]),
            ("Its shift on the pin", "shift (um)", [shift(0), shift(1)]),
        ] {
            let [x, y] = along;
            panels.push(
                Panel::new(title, time(), Axis::new(unit))
                    .series(x.colour(Colour::Blue).label("along x"))
                    .series(y.colour(Colour::Vermilion).label("along y")),
            );
        }
    }
    panels
}
