//! What became of a held rate, in numbers and in words.

use std::fmt;

use controller::rate::RateStop;
use serde::Serialize;

use super::keeping_up::behind;
use super::{PromisedRange, RateRange};
use crate::runs::rotor_tilt::TiltFigures;
use crate::runs::stated_errors::{StatedErrors, hundredths_or_dash};

/// Why the drive was switched off for good, in words.
pub fn reason(stop: RateStop) -> &'static str {
    match stop {
        RateStop::Stuck => "it does not turn the rotor",
        RateStop::WrongWay => "the rotor turns against the direction asked for",
        RateStop::EndOfTravel => "the rotor would leave the travel",
        RateStop::DrivenTooLong => "it was on for as long as is allowed",
        RateStop::NoEstimate => "there was no estimate that may be used for too long",
    }
}

/// Why no rate was held.
pub(super) const NO_REFERENCE: &str = "there was no estimate that may be used: the drive stayed off";

/// What became of a held rate.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RateOutcome {
    /// Rate asked for.
    pub rate_deg_s: f64,
    /// Profile.
    pub profile: &'static str,
    /// Time after settling.
    pub measured_s: f64,
    /// Mean rate asked for in that time; for a staircase both ways, of its magnitude.
    pub asked_deg_s: f64,
    /// True mean rate in that time.
    pub mean_deg_s: f64,
    /// Mean rate per the one asked for, less 1, in percent: negative of a rotor that is too slow, either way; `null` of
    /// a rate of 0.
    pub mean_error_percent: Option<f64>,
    /// Root mean square of the true angle less the reference; `null` without a reference.
    pub following_rms_deg: Option<f64>,
    /// Root mean square of the true rate less the one asked for.
    pub ripple_rms_deg_s: f64,
    /// Root mean square of the estimated less the true angle; `null` without an estimate.
    pub estimate_rms_mdeg: Option<f64>,
    /// The same beside what the filter states, after settling.
    #[serde(flatten)]
    pub stated: StatedErrors,
    /// Tilt and shift in the whole run; left out of a rotor that does not tilt.
    #[serde(flatten)]
    pub tilt: Option<TiltFigures>,
    /// How often the estimate was lost in the whole run: each time the reference begins anew where the rotor then is.
    pub reference_losses: u32,
    /// Why the drive was switched off for good; left out if it was not.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stopped: Option<String>,
    /// The same in words, or why the rate was not held; left out of one that was held to the end.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reason: Option<&'static str>,
    /// When that was, in s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stopped_s: Option<f64>,
    /// Mean rate in deg/s, clockwise positive, in all the time behind, of a motor that did not keep up in the end
    /// ([`super::KeepingUp`]); left out of one that did.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reached_deg_s: Option<f64>,
    /// The filter that ran.
    pub filter: &'static str,
    /// Share of the time at full drive: near 1 the motor cannot do more.
    pub saturated: f64,
    /// The range that the map promised before the run.
    #[serde(rename = "promised_reach")]
    pub promised: PromisedRange,
    /// The true range of this motor, without its faults.
    #[serde(rename = "reach")]
    pub range: RateRange,
    /// Whether the scene has faults, which that range leaves out.
    #[serde(skip)]
    pub has_faults: bool,
    /// Seed of the run.
    pub seed: u64,
}

impl RateOutcome {
    /// Whether the motor can hold what was asked for.
    fn is_within_range(&self) -> bool {
        self.range.holds_profile(self.rate_deg_s, self.profile)
    }

    /// How far the mean rate is off, with a colon before it and `decimals` behind the point; empty of a rate of 0.
    pub fn off(&self, decimals: usize) -> String {
        self.mean_error_percent.map_or_else(String::new, |percent| format!(": {percent:+.decimals$} % off"))
    }

    /// The outcome in words: what is said, and of what.
    pub fn lines(&self) -> Vec<(&'static str, String)> {
        let mean = format!(
            "{:+.4} deg/s for {:+.4} over {:.2} s{}",
            self.mean_deg_s,
            self.asked_deg_s,
            self.measured_s,
            self.off(4)
        );
        let following = self.following_rms_deg.map_or_else(|| "-".to_owned(), |deg| format!("{deg:.3}"));
        let mut lines = vec![
            ("rate", format!("{:+.2} deg/s, {}, seed {}", self.rate_deg_s, self.profile, self.seed)),
            ("true mean rate", mean),
            ("following", format!("{following} deg rms off the reference angle")),
        ];
        if self.reference_losses > 0 {
            let losses = self.reference_losses;
            lines.push(("reference", format!("begun anew {losses} times, since the estimate was lost")));
        }
        lines.extend(self.reason.map(|why| match (self.stopped_s, self.reached_deg_s) {
            (Some(at_s), _) => ("drive", format!("off for good after {at_s:.3} s: {why}")),
            (None, Some(reached_deg_s)) => ("not held", behind(why, reached_deg_s)),
            (None, None) => ("reason", why.to_owned()),
        }));
        lines.push(("ripple", format!("{:.1} deg/s rms", self.ripple_rms_deg_s)));
        lines.push(("filter", self.filter.to_owned()));
        lines.push(("estimator error", format!("{} mdeg rms", hundredths_or_dash(self.estimate_rms_mdeg))));
        lines.extend(self.tilt.as_ref().map(|tilt| ("rotor", tilt.to_string())));
        lines.push(("at full drive", format!("{:.1} % of the time", 100.0 * self.saturated)));
        lines.push(("by its map", self.promised.to_string()));
        let RateRange { clockwise_deg_s, counter_clockwise_deg_s } = self.range;
        let beyond = if self.is_within_range() { "" } else { ": the rate asked for is beyond it" };
        let without = if self.has_faults { " without its faults" } else { "" };
        let range = format!("{counter_clockwise_deg_s:+.0} to {clockwise_deg_s:+.0} deg/s{without}{beyond}");
        lines.push(("this motor reaches", range));
        lines
    }
}

impl fmt::Display for RateOutcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.lines().iter().try_for_each(|(what, said)| writeln!(f, "{what:<19}{said}"))
    }
}
