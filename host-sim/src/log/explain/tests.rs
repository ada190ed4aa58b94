//! Logs that are told in words.

use super::*;

fn story(command: &str, has_filter: bool) -> Story<'_> {
    Story::new(command, has_filter)
}

fn drive(mode: &str, amplitude: f32, frequency_offset_hz: f32) -> LogMessage {
    let (mode, asked_mode) = (mode.to_owned(), mode.to_owned());
    LogMessage::Drive(channels::Drive {
        mode,
        amplitude,
        frequency_offset_hz,
        asked_mode,
        asked_amplitude: amplitude,
    })
}

fn phase(phase: &str) -> LogMessage {
    LogMessage::Task(channels::Task { phase: phase.to_owned() })
}

/// Ten thousand cycles of 3 ms are told in some lines, with their number and their time.
#[test]
fn exact_repeated_cycles_are_told_together() {
    let mut story = story("position", true);
    let health =
        |health: &str, level| LogMessage::Health(channels::Health { health: health.to_owned(), level });
    for cycle in 0..10_000_u32 {
        let at_s = 0.03 * f64::from(cycle);
        story.take(at_s, phase("Waiting"));
        story.take(at_s, health("Unusable(FramesRefused)", 2));
        story.take(at_s + 0.01, phase("Settling(Rest)"));
        story.take(at_s + 0.01, health("Good", 0));
    }
    let events = story.end(Some("whole"));
    assert!(events.len() <= LINES_MAX, "{}", events.len());
    let waiting = events.iter().find(|event| event.sentence.contains("waits for an estimate")).unwrap();
    assert_eq!(waiting.times, 10_000);
    assert!((waiting.lasted_s - 100.0).abs() < 1e-6 && (waiting.until_s - 299.98).abs() < 1e-6);
}

/// What happens some times is told each time.
#[test]
fn exact_a_short_story_is_told_in_full() {
    let mut story = story("position", true);
    for (at_s, word) in [(0.0, "Cruise"), (0.1, "Burst"), (0.2, "Cruise"), (0.3, "Holding")] {
        story.take(at_s, phase(word));
    }
    let events = story.end(Some("whole"));
    let times: Vec<(f64, u64)> = events.iter().map(|event| (event.from_s, event.times)).collect();
    assert_eq!(times, [(0.0, 1), (0.1, 1), (0.2, 1), (0.3, 1), (0.3, 1)]);
    assert_eq!(events[1].sentence, "1 burst, with rest and measuring between");
}

/// A recording has drives, and nothing is said of a filter that did not run; a sweep is one drive.
#[test]
fn exact_a_recording_is_told_by_its_drives() {
    let mut story = story("record", false);
    story.take(0.0, phase("None"));
    for (at_s, mode, amplitude, offset_hz) in
        [(0.0, "B", 1.0, 0.0), (0.2, "off", 0.0, 0.0), (0.3, "C", 0.5, -10.0), (0.4, "C", 0.5, 20.0)]
    {
        story.take(at_s, drive(mode, amplitude, offset_hz));
    }
    let said: Vec<String> = story.end(Some("whole")).into_iter().map(|event| event.sentence).collect();
    let expected = [
        "no controller: the drives are given beforehand",
        "drive: mode B at 1 of full amplitude",
        "drive off",
        "drive: mode C at 0.5 of full amplitude, -10 to +20 Hz from the frequency of the design",
        "the run ends as it should",
    ];
    assert_eq!(said, expected);
}

/// A rate that is given up ends so.
#[test]
fn exact_a_rate_that_is_given_up_is_told() {
    let mut story = story("rate", true);
    story.take(0.0, phase("Rate"));
    story.take(0.068, phase("Stopped(WrongWay)"));
    let events = story.end(Some("whole"));
    let [held, given_up, end] = &events[..] else { panic!("{events:?}") };
    assert_eq!((held.sentence.as_str(), held.until_s), ("the controller holds a rate", 0.068));
    assert!(given_up.sentence.ends_with("turns against the direction asked for"), "{given_up:?}");
    assert_eq!(end.sentence, "the controller has given up, and the run ends");
}
