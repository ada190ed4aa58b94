//! The most instructions that the operations should take.
//!
//! A driven step without impact always takes the same way through the code; its target is for the longest. The core's
//! prediction and correction are the whole of other crates' filters. A camera frame that is used takes the same, and
//! also the time stamp, the delay and the gate. The loop's targets with the twin's filter are meant for a Cortex-M7,
//! those with the others for a Cortex-M4F. Backlogs of the whole program are held to the longest latency of a loop, at
//! the 1700 instructions a tick of a Cortex-M4F at 170 MHz, and with the twin's filter at the 4800 of a Cortex-M7 at
//! 480 MHz.
//!
//! The targets of a loop's longest tick ask for an impact's work in slices of later ticks. It is not cut: one tick
//! takes it whole, and a latency gives the loop the ticks after it to catch up in.

use std::fmt;

use super::listing::OperationCount;

/// Which figure of a count is held to a limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Statistic {
    /// The average.
    Mean,
    /// The longest.
    Max,
}

/// A limit on an operation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Target {
    /// The operation.
    pub operation: &'static str,
    /// Which of its figures.
    pub statistic: Statistic,
    /// At most so many instructions.
    pub limit: u32,
}

/// All targets.
pub const TARGETS: [Target; 19] = {
    use Statistic::{Max, Mean};
    #[expect(clippy::cast_possible_truncation, reason = "it is 16")]
    const LATENCY_TICKS_MAX: u32 = controller::LATENCY_TICKS_MAX as u32;
    const fn target(operation: &'static str, statistic: Statistic, limit: u32) -> Target {
        Target { operation, statistic, limit }
    }
    [
        target("located_step_aloft", Max, 180),
        target("end_of_step_aloft", Max, 180),
        target("located_step_b", Mean, 300),
        target("located_step_b", Max, 2000),
        target("located_step_c", Mean, 300),
        target("located_step_c", Max, 2000),
        target("located_step_b_0.3", Max, 2000),
        target("located_step_c_0.3", Max, 2000),
        target("located_step_at_rest", Max, 2000),
        target("core_2_predict_and_update", Max, 60),
        target("camera_frame_used", Max, 60),
        target("loop_tick", Max, 1000),
        target("loop_tick_impact_aided", Max, 1500),
        target("loop_tick_twin", Max, 4000),
        target("loop_tick_impact_aided_and_step", Mean, 800),
        target("loop_tick_twin_and_step", Mean, 3500),
        target("program_tick_every_8_latency_at_1700", Max, LATENCY_TICKS_MAX),
        target("program_tick_impact_aided_every_8_latency_at_1700", Max, LATENCY_TICKS_MAX),
        target("program_tick_twin_latency_at_4800", Max, LATENCY_TICKS_MAX),
    ]
};

impl Target {
    /// Whether `count`, which is this target's operation's, meets it.
    pub fn is_met(&self, count: &OperationCount) -> bool {
        let figure = match self.statistic {
            Statistic::Mean => count.mean(),
            Statistic::Max => f64::from(count.max),
        };
        figure <= f64::from(self.limit)
    }
}

impl fmt::Display for Target {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let statistic = match self.statistic {
            Statistic::Mean => "mean",
            Statistic::Max => "max",
        };
        write!(f, "{statistic} <= {}", self.limit)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exact_a_target_is_met_up_to_its_limit() {
        let count = OperationCount { operation: "a".to_owned(), samples: 2, total: 300, max: 200 };
        let met = |statistic, limit| Target { operation: "a", statistic, limit }.is_met(&count);
        assert!(met(Statistic::Mean, 150) && !met(Statistic::Mean, 149));
        assert!(met(Statistic::Max, 200) && !met(Statistic::Max, 199));
    }
}
