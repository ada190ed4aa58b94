//! What is to be thought of a board's report on itself.
//!
//! | finding | good when | because |
//! |---|---|---|
//! | amplifier | no error or over-current since it was last armed | after one it stays off |
//! | ticks | none is late or lost | an armed loop does the same work and a filter's besides |
//! | stack | [`STACK_FREE_MIN`] are free | a tick of a loop takes about as many, and beyond the end is a fault |
//! | vibrometer | filters that are told its noise and offset see rest | else they never do |
//! | camera: how many | at least half of its frames come | an angle is then 1.4 times as uncertain |
//! | camera: how old | none is of the future, or older than its latency and 10 ms | a board waits as long for a host |

use std::fmt;

use controller::TICK_NANOS;
use estimator::{Instruments, VibrometerDescription};
use link::SelfTestReport;
use motor_model::math;
use serde::Serialize;
use simulation::math::count::real;

/// Free bytes of stack.
const STACK_FREE_MIN: u32 = 1024;

/// Time in ms by which frames may be older than the camera makes them: that after which an armed board misses its host.
const LATE_MS_MAX: f64 = 10.0;

/// Share of the camera's frames that has to arrive.
const FRAMES_SHARE_MIN: f64 = 0.5;

/// Share of the variance of noise in the mean square by which filters see rest: that of the slower one of two samples.
const SLOWER_OF_TWO: f64 = 0.36;

/// Something that was found.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Finding {
    /// What it is of.
    pub of: &'static str,
    /// Whether it is good.
    pub ok: bool,
    /// What was found.
    pub found: String,
    /// What to do where it is not good.
    pub hint: Option<&'static str>,
}

impl Finding {
    fn good(of: &'static str, found: impl Into<String>) -> Self {
        Self { of, ok: true, found: found.into(), hint: None }
    }

    fn bad(of: &'static str, found: impl Into<String>, hint: &'static str) -> Self {
        Self { of, ok: false, found: found.into(), hint: Some(hint) }
    }

    fn judged(of: &'static str, ok: bool, found: String, hint: &'static str) -> Self {
        if ok { Self::good(of, found) } else { Self::bad(of, found, hint) }
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let verdict = if self.ok { "pass" } else { "FAIL" };
        write!(f, "{:<18} {verdict}: {}", self.of, self.found)?;
        self.hint.map_or(Ok(()), |hint| write!(f, "; hint: {hint}"))
    }
}

/// What is to be thought of `report` with `instruments`, by a clock that is known to `clock_nanos`.
pub(super) fn findings(report: &SelfTestReport, instruments: &Instruments, clock_nanos: f64) -> Vec<Finding> {
    vec![
        amplifier(report),
        ticks(report),
        stack(report),
        vibrometer(report, instruments.vibrometer.as_ref()),
        camera(report, instruments, clock_nanos),
    ]
}

fn amplifier(report: &SelfTestReport) -> Finding {
    let of = "amplifier";
    if report.amplifier_works {
        Finding::good(of, "no error of its pins and no over-current")
    } else {
        let hint = "see the bridge, its supply and its over-current output; a jog tries it again";
        Finding::bad(of, "it has failed or was cut off", hint)
    }
}

fn ticks(report: &SelfTestReport) -> Finding {
    let SelfTestReport { ticks, late_ticks, .. } = *report;
    let hint =
        "the main loop takes longer than a tick without any filter: firmware/BRINGUP.md, clock and deadline";
    Finding::judged("ticks", late_ticks == 0, format!("{late_ticks} of {ticks} late or lost"), hint)
}

fn stack(report: &SelfTestReport) -> Finding {
    let SelfTestReport { stack_bytes_max: used, stack_bytes: all, .. } = *report;
    let of = "stack";
    if all == 0 {
        return Finding::good(of, "not measured on this board");
    }
    let ok = all.saturating_sub(used) >= STACK_FREE_MIN;
    let hint = "fewer filters take less: firmware/BRINGUP.md, building and flashing";
    Finding::judged(of, ok, format!("{used} of {all} bytes used since the start"), hint)
}

fn vibrometer(report: &SelfTestReport, described: Option<&VibrometerDescription>) -> Finding {
    let of = "vibrometer";
    let velocity = &report.velocity;
    let Some(described) = described else {
        let converter = if report.has_converter { "not judged" } else { "the board has no converter" };
        return Finding::good(of, format!("the scene has none; {converter}"));
    };
    if !report.has_converter {
        let hint = "--set ldv.installed=no, or a firmware with a converter";
        return Finding::bad(of, "the board has no converter", hint);
    }
    let all = report.ticks.saturating_mul(SelfTestReport::SAMPLES_PER_TICK);
    let beyond = all.saturating_sub(velocity.samples);
    if beyond > 0 {
        let hint =
            "at rest the output lies within the range: see its shift, and the cable to the converter's pin";
        let found = format!("{beyond} of {all} samples at either end of the converter's range, or none");
        return Finding::bad(of, found, hint);
    }
    let (Some(mean_m_s), Some(sd_m_s)) = (velocity.mean_m_s(), velocity.sd_m_s()) else {
        return Finding::bad(of, "no sample", "see that the converter runs");
    };
    if velocity.sum_squares_m2_s2 <= 0.0 {
        let found = format!("all of {} samples are {:.3} mm/s", velocity.samples, 1e3 * mean_m_s);
        return Finding::bad(of, found, "see that the vibrometer has light, and its output a cable");
    }
    let (excess_m_s, excess_max_m_s) = (excess(mean_m_s, sd_m_s, described), excess_max(described));
    let found = format!(
        "{} samples, mean {:+.3} mm/s, standard deviation {:.3} mm/s; beyond what is described {:.3} mm/s, at most \
         {:.3}",
        velocity.samples,
        1e3 * mean_m_s,
        1e3 * sd_m_s,
        1e3 * excess_m_s,
        1e3 * excess_max_m_s
    );
    let hint =
        "let the rotor rest, or describe noise and offset: estimator.assumed.ldv.noise_m_s and .bias_max_m_s";
    Finding::judged(of, excess_m_s <= excess_max_m_s, found, hint)
}

/// Root mean square of what is neither noise nor an offset as described.
fn excess(mean_m_s: f64, sd_m_s: f64, described: &VibrometerDescription) -> f64 {
    let offset_m_s = (mean_m_s.abs() - described.bias_max_m_s).max(0.0);
    let noise_m_s = described.sample_sd_m_s();
    math::sqrt(offset_m_s * offset_m_s + (sd_m_s * sd_m_s - noise_m_s * noise_m_s).max(0.0))
}

/// The most of it with which filters see rest.
fn excess_max(described: &VibrometerDescription) -> f64 {
    let (quiet_m_s, noise_m_s) = (described.quiet_m_s(), described.sample_sd_m_s());
    math::sqrt(quiet_m_s * quiet_m_s - SLOWER_OF_TWO * noise_m_s * noise_m_s)
}

fn camera(report: &SelfTestReport, instruments: &Instruments, clock_nanos: f64) -> Finding {
    let of = "camera";
    let seconds = 1e-9 * real(u64::from(report.ticks) * TICK_NANOS);
    let expected = 1e9 * seconds / real(instruments.camera.period_nanos);
    let frames = report.camera.frames;
    if f64::from(frames) < FRAMES_SHARE_MIN * expected {
        let found = format!("{frames} frames in {seconds} s, {expected:.0} are described");
        return Finding::bad(of, found, "see that its program sends frames, and camera.frame_rate_hz");
    }
    let [youngest_ms, oldest_ms] =
        [report.camera.youngest_nanos, report.camera.oldest_nanos].map(|nanos| 1e-6 * signed(nanos));
    let found = format!("{frames} frames in {seconds} s, {youngest_ms:.3} to {oldest_ms:.3} ms old");
    if youngest_ms < -1e-6 * clock_nanos {
        return Finding::bad(
            of,
            found,
            "frames are stamped with a time to come: see the clock of their program",
        );
    }
    let oldest_max_ms = 1e-6 * real(instruments.camera.latency_nanos) + LATE_MS_MAX;
    let hint =
        "frames come late: see the program of the camera, the load of the machine, and camera.latency_s";
    Finding::judged(of, oldest_ms <= oldest_max_ms, found, hint)
}

#[expect(clippy::cast_precision_loss, reason = "a month of ns is below 2^53")]
fn signed(nanos: i64) -> f64 {
    nanos as f64
}

#[cfg(test)]
mod tests;
