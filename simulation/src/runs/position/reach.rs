//! What the response map allows of a move, said before it begins.
//!
//! A move is refused that no drive of the map can make: a tolerance that the finest burst steps over, a mode that turns
//! nothing, or a way that motors of the design may not end by the deadline by bursts, in a mode without cruises. A way
//! by a cruise that they may not end by the deadline gets a note.

use controller::response_map::{Family, direction};
use controller::{Limits, MoveForecast, ResponseMap};
use estimator::Instruments;
use motor_model::DriveMode;

use crate::math::plain_number::plain;
use crate::runs::limits;
use crate::scene::{Scene, SceneError};

/// Tolerance at which the way alone counts, in degrees.
pub(super) const WIDEST_DEG: f64 = 10.0;
/// Halvings of the distance that is searched: to a thousandth.
const HALVINGS: u32 = 10;
/// Families of each mode, longest bursts first.
const FAMILIES: [(DriveMode, &[Family]); 2] = [
    (DriveMode::B, &[Family::Throw, Family::Nudge]),
    (DriveMode::C, &[Family::Stride, Family::Walk, Family::Step]),
];

fn degrees(rad: f32) -> f64 {
    f64::from(rad).to_degrees()
}

/// Two significant digits.
pub(super) fn figure(value: f64) -> String {
    plain(format!("{value:.1e}").parse().unwrap_or(value))
}

/// Checks that a move of `to_deg` to a tolerance of `tolerance_deg` can be made by `map` within `limits`, under
/// `instruments`.
///
/// # Errors
/// When it cannot; the hint names what can.
pub(super) fn check(
    instruments: &Instruments,
    map: &ResponseMap,
    limits: &Limits,
    to_deg: f64,
    tolerance_deg: f64,
) -> Result<(), SceneError> {
    let refused = |conflict, hint| Err(SceneError::Conflict { conflict, hint });
    let has_drives = |mode| map.has_drives(mode, limits.amplitude_max);
    if !has_drives(DriveMode::C) {
        let conflict =
            "by its map mode C does not turn this motor: without its fine steps no target is approached"
                .to_owned();
        return refused(conflict, "check the drive at mode C's frequency, then `commission`".to_owned());
    }
    let Some((shortest_rad, _)) = map.range_rad(Family::Step, limits.amplitude_max) else {
        let conflict = "no family of mode C makes fine steps with this motor".to_owned();
        let hint = "a map of more motors, `response-map --motors 40`; it prints what each drive does";
        return refused(conflict, hint.to_owned());
    };
    let shortest_deg = degrees(shortest_rad);
    if shortest_deg > 2.0 * tolerance_deg {
        let (shortest, tolerance) = (figure(shortest_deg), plain(tolerance_deg));
        let conflict = format!(
            "no family turns this motor by less than {shortest} deg, position.tolerance_deg = {tolerance}"
        );
        return refused(conflict, format!("position.tolerance_deg={}", figure(0.5 * shortest_deg)));
    }
    let round_deg = to_deg - to_deg.signum() * 360.0 * ((to_deg.abs() / 360.0).floor() + 1.0);
    if to_deg > tolerance_deg && !has_drives(DriveMode::B) {
        let conflict = format!(
            "by its map mode B does not turn this motor for certain, and position.to_deg = {} lies clockwise",
            plain(to_deg)
        );
        return refused(conflict, format!("the other way round: --to {}", plain(round_deg)));
    }
    let mode = if to_deg > 0.0 { DriveMode::B } else { DriveMode::C };
    #[expect(clippy::cast_possible_truncation, reason = "the controller computes in f32")]
    let in_time = |deg: f64| {
        let (distance_rad, widest_rad) = (deg.to_radians() as f32, WIDEST_DEG.to_radians() as f32);
        MoveForecast::try_new(instruments, map, limits, distance_rad, widest_rad).is_ok()
    };
    if map.strongest_cruise(mode, limits.amplitude_max).is_some() || in_time(to_deg) {
        return Ok(());
    }
    let way = if mode == DriveMode::B { "clockwise" } else { "counter-clockwise" };
    let longest_deg = FAMILIES
        .into_iter()
        .filter(|(of, _)| *of == mode)
        .flat_map(|(_, families)| families)
        .filter_map(|family| map.range_rad(*family, limits.amplitude_max))
        .map(|(_, longest)| degrees(longest))
        .fold(0.0, f64::max);
    let (mut most_deg, mut too_far_deg) = (0.0, to_deg);
    for _ in 0..HALVINGS {
        let middle_deg = 0.5 * (most_deg + too_far_deg);
        *(if in_time(middle_deg) { &mut most_deg } else { &mut too_far_deg }) = middle_deg;
    }
    let conflict = format!(
        "{way}, no constant drive turns nearly every motor of this design, and bursts turn it by at most {} deg each: \
         position.to_deg = {} takes motors of it longer than the deadline, {} s",
        figure(longest_deg),
        plain(to_deg),
        limits.deadline_nanos / 1_000_000_000
    );
    let hint = format!(
        "at most {} deg {way}, or the other way round: --to {}",
        figure(most_deg.abs()),
        plain(round_deg)
    );
    refused(conflict, hint)
}

/// A note for a move, expected to take `expected_s`, that motors of the scene's design may not end by the deadline: its
/// time in a motor of the mean rate and in one that is two standard deviations slower. `None` if even the slow one ends
/// in time, or if the move is made by bursts, which take less than a cruise at the mean rate.
///
/// # Errors
/// When the response map is for another design.
pub fn note(scene: &Scene, expected_s: f64) -> Result<Option<String>, SceneError> {
    let (to_deg, deadline_s) = (scene.number("position.to_deg"), scene.number("position.deadline_s"));
    let mode = if to_deg > 0.0 { DriveMode::B } else { DriveMode::C };
    let map = scene.response_map()?;
    Ok(map.strongest_cruise(mode, limits::of_move(scene).amplitude_max).and_then(|cruise| {
        let mean = degrees(direction(mode) * cruise.rate_rad_s);
        let slow = mean - 2.0 * degrees(cruise.rate_sd_rad_s);
        let [mean_s, slow_s] = [mean, slow].map(|rate| to_deg.abs() / rate.max(0.0));
        let slow = if slow_s.is_finite() {
            format!("up to {} s in slow ones", figure(slow_s))
        } else {
            "and slow ones never end it".to_owned()
        };
        (slow_s > deadline_s && mean_s <= expected_s).then(|| {
            format!(
                "note: this way takes {} s at the mean rate of the design's motors, {slow}; \
                 position.deadline_s = {}",
                figure(mean_s),
                plain(deadline_s)
            )
        })
    }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use controller::response_map::{Burst, Cruise};

    /// The map of Table 1 with other cruises and steps.
    fn map(cruises: &[Cruise], steps: &[Burst]) -> ResponseMap {
        let table_1 = ResponseMap::table_1();
        let bursts =
            Family::ALL.map(|family| if family == Family::Step { steps } else { table_1.bursts(family) });
        ResponseMap::try_new(*table_1.design(), cruises, bursts, 0.0).unwrap()
    }

    fn refused(map: &ResponseMap, to_deg: f64, tolerance_deg: f64) -> Option<String> {
        check(&Instruments::default(), map, &Limits::default(), to_deg, tolerance_deg)
            .err()
            .map(|error| error.one_line())
    }

    #[test]
    fn exact_the_map_of_table_1_allows_every_move() {
        for to_deg in [0.0, 1e-3, 90.0, -90.0, 360_000.0, -360_000.0] {
            assert_eq!(refused(ResponseMap::table_1(), to_deg, 1e-4), None);
        }
        assert_eq!(note(&Scene::default(), 1.0).unwrap(), None);
    }

    #[test]
    fn exact_a_tolerance_below_the_finest_burst_is_refused_with_the_one_that_can_be_met() {
        let table_1 = ResponseMap::table_1();
        let coarse = map(table_1.cruises(), &table_1.bursts(Family::Step)[8..]);
        assert_eq!(
            refused(&coarse, 90.0, 1e-3).unwrap(),
            "error: no family turns this motor by less than 0.0023 deg, position.tolerance_deg = 0.001; hint: \
             position.tolerance_deg=0.0012"
        );
        assert_eq!(refused(&coarse, 90.0, 2e-3), None);
        assert!(refused(&map(table_1.cruises(), &[]), 90.0, 1.0).is_some());
    }

    /// A map without one mode: of a motor whose mode is dead.
    fn without(mode: DriveMode) -> ResponseMap {
        let table_1 = ResponseMap::table_1();
        let cruises: Vec<Cruise> =
            table_1.cruises().iter().filter(|cruise| cruise.mode != mode).copied().collect();
        let bursts =
            Family::ALL.map(|family| if family.mode() == mode { &[] } else { table_1.bursts(family) });
        ResponseMap::try_new(*table_1.design(), &cruises, bursts, 0.0).unwrap()
    }

    #[test]
    fn exact_a_mode_without_drives_is_refused_with_what_can_be_done() {
        let without_b = without(DriveMode::B);
        for (to_deg, round) in [(90.0, "-270"), (0.01, "-359.99"), (1.5e-3, "-359.9985"), (450.0, "-270")] {
            let refusal = refused(&without_b, to_deg, 1e-3).unwrap();
            let words =
                format!("position.to_deg = {to_deg} lies clockwise; hint: the other way round: --to {round}");
            assert!(
                refusal.starts_with("error: by its map mode B does not") && refusal.ends_with(&words),
                "{refusal}"
            );
        }
        for to_deg in [-90.0, 0.0, 1e-3] {
            assert_eq!(refused(&without_b, to_deg, 1e-3), None);
        }
        for to_deg in [90.0, -90.0] {
            let refusal = refused(&without(DriveMode::C), to_deg, 1e-3).unwrap();
            assert!(refusal.contains("mode C does not turn this motor"), "{refusal}");
        }
    }

    /// Without cruises a way of throws or strides is limited by the deadline of 60 s, and the way that is named instead
    /// can be made.
    #[test]
    fn law_a_way_by_bursts_beyond_the_deadline_is_refused_with_the_one_that_is_not() {
        let none = map(&[], ResponseMap::table_1().bursts(Family::Step));
        for sign in [1.0, -1.0] {
            assert_eq!(refused(&none, sign * 360.0, 1e-3), None);
            let refusal = refused(&none, sign * 360_000.0, 1e-3).unwrap();
            let round = format!("--to {}", -360.0 * sign);
            assert!(refusal.contains("60 s") && refusal.contains(&round), "{refusal}");
            let named = refusal.split("at most ").nth(2).unwrap().split(' ').next().unwrap();
            let most_deg: f64 = named.parse().unwrap();
            // Two digits are printed of it.
            assert_eq!(refused(&none, sign * 0.95 * most_deg, 1e-3), None, "{refusal}");
            assert!(refused(&none, sign * 1.06 * most_deg, 1e-3).is_some(), "{refusal}");
        }
        assert!(refused(&none, 36_037.0, 1e-3).unwrap().contains("--to -323"));
    }

    /// 360,000 degrees at 15.14 rad/s take 415 s, and 492 s at 12.774.
    #[test]
    fn exact_a_way_that_may_take_longer_than_the_deadline_is_noted() {
        let mut scene = Scene::default();
        scene.set("position.to_deg", "360000").unwrap();
        let text = note(&scene, 420.0).unwrap().unwrap();
        assert!(text.contains("takes 410 s") || text.contains("takes 420 s"), "{text}");
        assert!(text.contains("up to 490 s"), "{text}");
        // By bursts, in less time than by a cruise.
        assert_eq!(note(&scene, 400.0).unwrap(), None);
        scene.set("position.deadline_s", "500").unwrap();
        assert_eq!(note(&scene, 420.0).unwrap(), None);
    }
}
