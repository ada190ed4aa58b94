//! Settings of the instruments that do not go together, as they are and as they are assumed.

use super::ldv::resolution_m_s;
use crate::math::plain_number::plain;
use crate::scene::faults::FaultKind;
use crate::scene::{Scene, SceneError};
use crate::world::event_clock::EventRate;

/// Longest time from the end of an exposure to the arrival of its frame, in ns: 10 s.
const LATENCY_MAX_NANOS: u64 = 10_000_000_000;
/// Largest jitter per period. Five standard deviations are then half a period, where jitter is cut off.
const JITTER_MAX: f64 = 0.1;

/// Refuses settings of the instruments that do not go together.
///
/// # Errors
/// With both settings, their values, and values that would work.
pub(crate) fn check(scene: &Scene) -> Result<(), SceneError> {
    latency(scene, ["camera.latency_frames", "camera.latency_s", "camera.frame_rate_hz"])?;
    latency(
        scene,
        [
            "estimator.assumed.camera.latency_frames",
            "estimator.assumed.camera.latency_s",
            "estimator.assumed.camera.frame_rate_hz",
        ],
    )?;
    jitter(scene, "camera.period_jitter_s", "camera.frame_rate_hz")?;
    jitter(scene, "ldv.period_jitter_s", "ldv.sample_rate_hz")?;
    marks(scene)?;
    bits(scene, "ldv.bits", "ldv.range_m_s")?;
    bits(scene, "estimator.assumed.ldv.bits", "estimator.assumed.ldv.range_m_s")
}

fn latency(scene: &Scene, [frames, seconds, rate]: [&'static str; 3]) -> Result<(), SceneError> {
    let (late_frames, rate_hz) = (scene.integer(frames), scene.number(rate));
    let late_nanos = EventRate::from_hz(rate_hz).span_nanos(late_frames) + scene.nanos(seconds);
    if late_nanos <= LATENCY_MAX_NANOS {
        return Ok(());
    }
    #[expect(clippy::cast_precision_loss, reason = "at most 1e11 ns")]
    let late_s = 1e-9 * late_nanos as f64;
    Err(SceneError::Conflict {
        conflict: format!(
            "{frames} = {late_frames} at {rate} = {} Hz and {seconds} = {} s are a latency of {} s, more than 10 s",
            plain(rate_hz),
            plain(scene.number(seconds)),
            plain(late_s)
        ),
        hint: format!("fewer {frames}"),
    })
}

fn jitter(scene: &Scene, jitter: &'static str, rate: &'static str) -> Result<(), SceneError> {
    let (jitter_s, rate_hz) = (scene.number(jitter), scene.number(rate));
    let most_s = JITTER_MAX / rate_hz;
    if jitter_s <= most_s * (1.0 + 1e-9) {
        return Ok(());
    }
    Err(SceneError::Conflict {
        conflict: format!(
            "{jitter} = {} s is more than a tenth of the period at {rate} = {} Hz",
            plain(jitter_s),
            plain(rate_hz)
        ),
        hint: format!("at most {} s", plain(most_s)),
    })
}

/// A fault of a mark is one of several marks, and of one that there is.
fn marks(scene: &Scene) -> Result<(), SceneError> {
    let marks = scene.integer("camera.marks");
    let fault = scene.choice("camera.mark_fault");
    let faulty = (fault != "none").then(|| scene.integer("camera.faulty_mark"));
    let by_key = faulty.map(|faulty| {
        let names = [format!("camera.mark_fault = {fault}"), format!("camera.faulty_mark = {faulty}")];
        (faulty, names)
    });
    let by_words = scene.fault_words();
    let by_words = by_words.iter().filter_map(|fault| match fault.kind {
        FaultKind::Mark(faulty, _) => Some((u64::from(faulty), [fault.to_string(), format!("mark{faulty}")])),
        _ => None,
    });
    for (faulty, [fault, mark]) in by_key.into_iter().chain(by_words) {
        let (conflict, hint) = if marks < 2 {
            let conflict = format!("{fault} is a fault of one of several marks, and camera.marks = 1");
            (conflict, "camera.marks=3; the fault of a single mark is camera.fault".to_owned())
        } else if faulty > marks {
            (format!("{mark} is none of camera.marks = {marks} marks"), format!("1 to {marks}"))
        } else {
            continue;
        };
        return Err(SceneError::Conflict { conflict, hint });
    }
    Ok(())
}

fn bits(scene: &Scene, bits: &'static str, range: &'static str) -> Result<(), SceneError> {
    let (number, range_m_s) = (scene.integer(bits), scene.number(range));
    let conflict = match number {
        0 => return Ok(()),
        1..6 => format!("{bits} = {number} is neither 0, for no steps, nor 6 to 24"),
        _ if resolution_m_s(range_m_s, number) > 0.0 => return Ok(()),
        _ => format!("{bits} = {number} needs a range, and {range} = {} is none", plain(range_m_s)),
    };
    Err(SceneError::Conflict { conflict, hint: format!("for example {bits}=12 with {range}=0.1") })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn checked(sets: &[&str]) -> Result<(), String> {
        let sets: Vec<String> = sets.iter().map(|&set| set.to_owned()).collect();
        check(&Scene::of_sets(&sets).unwrap()).map_err(|error| error.one_line())
    }

    #[test]
    fn exact_refusals_name_both_settings() {
        for (sets, words) in [
            (&["ldv.bits=12"][..], ["ldv.bits = 12", "ldv.range_m_s = 0"]),
            (&["ldv.bits=5", "ldv.range_m_s=1"], ["ldv.bits = 5", "6 to 24"]),
            (
                &["ldv.range_m_s=1", "ldv.bits=12", "estimator.assumed.ldv.range_m_s=0"],
                ["estimator.assumed.ldv.bits = 12", "estimator.assumed.ldv.range_m_s = 0"],
            ),
            (
                &["camera.frame_rate_hz=10", "camera.latency_frames=100", "camera.latency_s=0.1"],
                ["camera.latency_frames = 100", "camera.latency_s = 0.1"],
            ),
            (&["camera.marks=1", "camera.mark_fault=lost"], ["camera.mark_fault = lost", "camera.marks = 1"]),
            (
                &["camera.marks=3", "camera.mark_fault=false", "camera.faulty_mark=4"],
                ["camera.faulty_mark = 4", "camera.marks = 3"],
            ),
            (&["camera.marks=1", "faults=mark1:lost@1.."], ["mark1:lost@1..", "camera.marks = 1"]),
            (&["camera.marks=3", "faults=ldv:lost mark4:stuck"], ["mark4 ", "camera.marks = 3"]),
            (&["camera.period_jitter_s=1.1e-5"], ["camera.period_jitter_s", "camera.frame_rate_hz = 10000"]),
            (&["ldv.period_jitter_s=1e-6"], ["ldv.period_jitter_s", "ldv.sample_rate_hz"]),
        ] {
            let line = checked(sets).unwrap_err();
            assert!(words.iter().all(|word| line.contains(word)), "{sets:?}: {line}");
        }
    }

    #[test]
    fn exact_what_goes_together_is_taken() {
        for sets in [
            &[][..],
            &["ldv.bits=6", "ldv.range_m_s=0.02"],
            &["ldv.bits=24", "ldv.range_m_s=100"],
            &["camera.frame_rate_hz=10", "camera.latency_frames=90", "camera.latency_s=1"],
            &["camera.mark_fault=exchanged", "camera.faulty_mark=2"],
            &["faults=mark2:false:1e-5, mark1:stuck"],
            &["camera.period_jitter_s=1e-5"],
            &["camera.frame_rate_hz=10", "camera.period_jitter_s=0.01"],
        ] {
            assert_eq!(checked(sets), Ok(()), "{sets:?}");
        }
    }
}
