//! A real board at the other end of a serial line: `host-sim run`, `commission --port`, `jog` and `self-test`.
//!
//! ```text
//! frames: file, pipe, port or simulated plant ---> FrameSource -+      +--> observer: log, live view
//!                                                               v      |
//! board <---- PacedLine: at most the line's rate <---- SerialRun: configure, arm, watch, stop
//!   |                                                           ^
//!   +--- reports, answers, faults: reader thread, BoardSession -+
//! ```
//!
//! | module | what it is |
//! |---|---|
//! | `port` | the port: opened, or why it is not |
//! | `port_reader` | the thread that reads it |
//! | `line_rate` | the time that bytes take on the line, and the share of it that is in use |
//! | `board_pace` | how slow the board is by the host's clock |
//! | `host_clock` | the host's clock, and times of day by it |
//! | `session` | frames of one session, both ways |
//! | [`frame_text`] | camera frames as lines of text |
//! | `time_questions` | the questions that set the clocks, and which of them an answer is to |
//! | `frame_source` | where camera frames come from |
//! | `frames_on_line` | whether the line carries them |
//! | `clock_bound` | how well the board's clock is known, in the board's time |
//! | `told_clock` | what of it the board's filter is told |
//! | `stamp_watch` | whether it stays known as well as that |
//! | `fresh_frames` | which of them are sent: no old one where a newer one waits |
//! | `plant` | the simulated motor under the drive that the board reports: hardware in the loop |
//! | `report_period` | how often a run needs a report |
//! | `report_record` | what the board reports as a record of a run, and the frames that go with it |
//! | `progress` | what is known in the middle of a run, and who sees it |
//! | `description` | what the board is told before a run, and what it keeps of it |
//! | `task` | what is asked of the board, a move, a rate or experiments, and what is seen of it |
//! | `next_step` | what the board does after it has held its target |
//! | `watched_move` | what is seen of a move, and of the steps after it |
//! | `task_filter` | the filter of a task, and the next simpler one for a board without it |
//! | `commissioned` | the experiments that commission the motor, ordered one by one |
//! | `serial_run` | the run: from the first message to the acknowledged stop |
//! | `outcome` | what became of it |
//! | `attendance` | what keeps line and board alive, and the clocks set, while no loop reports |
//! | `jog` | the drive by hand, beside what a simulated motor and the response map say of it |
//! | `self_test` | what a board tells of itself, and what is to be thought of it |
//! | `error` | why it was not made |
//!
//! # The drive goes off
//!
//! Whatever ends the run, the host sends a stop and waits for its acknowledgement. Where the line is gone the board
//! does it alone: 10 ms of its own time after the last frame of the host it switches the drive off and latches.

mod attendance;
mod board_pace;
mod clock_bound;
mod commissioned;
mod description;
mod error;
#[cfg(all(test, unix))]
mod fake_board;
mod frame_source;
pub mod frame_text;
mod frames_on_line;
mod fresh_frames;
mod host_clock;
mod jog;
mod line_rate;
mod next_step;
mod outcome;
mod plant;
mod port;
mod port_reader;
mod progress;
mod report_period;
mod report_record;
mod self_test;
mod serial_run;
mod session;
mod stamp_watch;
mod task;
mod task_filter;
mod time_questions;
mod told_clock;
mod watched_move;

pub use description::{DescriptionFigures, Keeping, keep};
pub use error::SerialError;
pub use frame_source::FrameSource;
#[cfg(test)]
pub(crate) use jog::PreparedJog;
pub use jog::{JogForecast, JogOutcome, SerialJog, VelocityFigures};
pub use next_step::{NextStep, NextStepError};
pub use outcome::{
    ClockFigures, CommissionFigures, CounterFigures, HeldFigures, IdentityFigures, LineFigures, MoveFigures,
    RateFigures, SerialOutcome, SessionFigures, TaskFigures,
};
pub use progress::{Goal, Progress, Watcher};
pub use report_period::{ReportPeriod, ReportPeriodError};
#[cfg(test)]
pub(crate) use self_test::PreparedSelfTest;
pub use self_test::{Finding, SelfTestOutcome, SerialSelfTest};
pub use serial_run::SerialRun;
pub use stamp_watch::ClockDoubt;
pub use task::BoardTask;
