//! The error of the board's clock, of which the filter is told before a run.
//!
//! Frames of a camera are stamped by the host's clock. What the host knows of the board's is a bound, which a line
//! gives again and again: of every eight round trips the shortest counts. In a run the clock is carried on from such an
//! exchange, by a drift that two of them give:
//!
//! ```text
//! bound = 2 pace (round trip / 2 + half a tick)        told = 10, 20, 50, 100 ... or 10,000 us >= bound / sqrt 3
//! ```
//!
//! The pace is the board's time per the host's, of a real board 1 ([`pace_max`]). The value is coarse, so that a board
//! that keeps its description need not be sent another one at the next run on the same line. Exchanges that are known
//! to a tick, by which the board counts, need no word.

use controller::TICK_NANOS;
use simulation::math::clock_sync::BoardClock;
use simulation::math::count::real;
use simulation::scene::Scene;

use super::SerialError;
use super::attendance::set_clocks;
use super::clock_bound::{WITHIN_BOUND, pace_max};
use super::frame_source::FrameSource;
use super::host_clock::{host_nanos, seconds};
use super::session::BoardSession;

/// The key by which a scene tells the error itself.
const KEY: &str = "estimator.assumed.camera.clock_error_s";

/// What may be told, in us, up to the greatest value of the key.
const TOLD_MICROS: [u16; 10] = [10, 20, 50, 100, 200, 500, 1_000, 2_000, 5_000, 10_000];

/// Bound of a clock in a run per that of its exchanges: `1 + 2 / 2` of an exchange that is half as old as the two are
/// apart that give the drift. The run asks twice as often, as the shortest of eight need not be the last one.
const CARRIED: f64 = 2.0;

/// Whether frames of `source` are stamped by the host's clock, and `scene` does not say how well.
pub(super) fn is_asked(source: &FrameSource, scene: &Scene) -> bool {
    // The plant's instants are by the board's clock.
    *source != FrameSource::Plant && !scene.is_set(KEY)
}

/// Asks an unarmed board for its time. Root mean square error of its clock on this line, in us, as it is to be told; 0
/// for nothing. The clocks are set anew by the run: a board that starts anew meanwhile counts anew.
///
/// # Errors
/// When the board does not answer, or its clock is known less well than can be told.
pub(super) fn ask(session: &mut BoardSession) -> Result<u16, SerialError> {
    let begun = host_nanos();
    set_clocks(session)?;
    let clock = session.clock();
    session.forget_clock();
    // No answer was sure to be to its question.
    let unanswered = || SerialError::Unanswered {
        what: "the questions for its time",
        waited_s: (1e3 * seconds(host_nanos() - begun)).round() / 1e3,
    };
    told_micros(&clock.ok_or_else(unanswered)?)
}

/// What is told of a clock that was set by questions one after the other.
fn told_micros(clock: &BoardClock) -> Result<u16, SerialError> {
    let exchange_nanos = pace_max(clock) * clock.exchange_uncertainty_nanos();
    if exchange_nanos <= real(TICK_NANOS) {
        return Ok(0);
    }
    let bound_us = 1e-3 * CARRIED * exchange_nanos;
    let error_us = WITHIN_BOUND * bound_us;
    let told = TOLD_MICROS.into_iter().find(|&told| f64::from(told) >= error_us);
    told.ok_or(SerialError::ClockUnknown { key: KEY, bound_us, error_us })
}

#[cfg(test)]
mod tests {
    use estimator::{CameraDescription, Instruments};
    use simulation::math::clock_sync::{ClockSync, Exchange};

    use super::*;

    /// What is told of a board that counts `ticks` every 100 ms, and of which two exchanges of 8 know the time to half
    /// of `round_trip_us`, the later one, and half of the tenth part of it.
    fn told(round_trip_us: i64, ticks: u64) -> Result<u16, SerialError> {
        let mut sync = ClockSync::default();
        for number in 0..16_u32 {
            let sent_nanos = 100_000_000 * i64::from(number);
            let round_trip_us = if number < 8 { round_trip_us / 10 } else { round_trip_us };
            let received_nanos = sent_nanos + 1000 * round_trip_us;
            sync.add(Exchange { sent_nanos, received_nanos, ticks: u64::from(number) * ticks });
        }
        told_micros(&sync.at(0).unwrap())
    }

    /// The shorter window does not count. A round trip of 10 us is known to a tick: nothing is told. 11 us: 10.5 us
    /// twice over `sqrt 3` are 12.1 us. Of 163 us `168 / sqrt 3 = 97.0` are 100 us, of 169 us 100.5 are 200 us.
    #[test]
    fn exact_what_is_told_is_the_next_coarse_value() {
        for (round_trip_us, micros) in [
            (0, 0),
            (10, 0),
            (11, 20),
            (163, 100),
            (169, 200),
            (1_000, 1_000),
            (5_000, 5_000),
            (17_300, 10_000),
        ] {
            assert_eq!(told(round_trip_us, 10_000).unwrap(), micros, "{round_trip_us}");
        }
    }

    /// A tenth of the pace makes a tenth of it, with the little by which the pace is not known.
    #[test]
    fn exact_a_slow_board_s_clock_is_told_in_its_own_time() {
        assert_eq!((told(10_000, 10_000).unwrap(), told(10_000, 1_000).unwrap()), (10_000, 1_000));
    }

    /// What the key takes is told, and no more: 20 ms twice in half of the round trip are beyond it.
    #[test]
    fn exact_a_clock_beyond_the_key_is_refused_with_value_and_bounds() {
        let most = *TOLD_MICROS.last().unwrap();
        let takes = |clock_sd_micros: u16| {
            let camera = CameraDescription { clock_sd_micros, ..CameraDescription::default() };
            Instruments { camera, vibrometer: None }.checked().is_ok()
        };
        assert!(takes(most) && !takes(most + 1));
        let refused = told(20_000, 10_000).unwrap_err();
        let expected = "the board's clock is known to 20010 us on this line: \
                        estimator.assumed.camera.clock_error_s = 0.011553 is out of bounds, 0 to 0.01 s";
        assert_eq!(refused.to_string(), expected);
        let hint = refused.hint().unwrap();
        assert!(hint.contains("shorter round trips") && hint.contains(KEY), "{hint}");
        assert_eq!(refused.exit_code(), 2);
    }

    /// A board that takes 2 ms to answer: its clock is known to 1 ms and half a tick, so that `2.01 ms / sqrt 3 = 1.16
    /// ms` are the least. The run sets the clocks anew.
    #[cfg(unix)]
    #[test]
    fn exact_an_unarmed_board_is_asked_as_often_as_begins_a_run() {
        use link::{BoardMessage, Counters, HostMessage};

        use crate::board::serial::fake_board::FakeBoard;
        use crate::board::serial::serial_run::FIRST_QUESTIONS;

        let (mut session, mut board) = FakeBoard::with_session();
        let board = std::thread::spawn(move || {
            let asked: Vec<HostMessage> = (0..FIRST_QUESTIONS)
                .map(|_| {
                    let asked = board.hears();
                    std::thread::sleep(std::time::Duration::from_millis(2));
                    let ticks = u64::try_from(host_nanos()).unwrap() / TICK_NANOS;
                    board.says(ticks, &BoardMessage::Counters(Counters::default()));
                    asked
                })
                .collect();
            (board, asked)
        });
        // On a machine that is busy an answer may take far longer.
        let told = ask(&mut session);
        let (_, asked) = board.join().unwrap();
        assert!(matches!(told, Ok(2_000..) | Err(SerialError::ClockUnknown { .. })), "{told:?}");
        assert!(asked.iter().all(|asked| *asked == HostMessage::Count), "{asked:?}");
        assert!(session.clock().is_none());
    }

    /// Frames of the plant are stamped by the board's clock; the key of a scene wins, whatever it says.
    #[test]
    fn exact_who_asks_for_the_clock() {
        let scene = |sets: &[String]| Scene::of_sets(sets).unwrap();
        let (plain, told) = (scene(&[]), scene(&[format!("{KEY}=0")]));
        for source in ["-", "tcp:localhost:5000", "frames.txt"].map(FrameSource::named) {
            assert!(is_asked(&source, &plain) && !is_asked(&source, &told), "{source:?}");
        }
        assert!(!is_asked(&FrameSource::Plant, &plain));
    }
}
