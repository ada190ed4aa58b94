extern crate std;

use std::vec::Vec;

use super::*;

fn map() -> &'static ResponseMap {
    ResponseMap::table_1()
}

/// Planning inverts each family, so the turn must rise along it. Steps and walks must repeat far better than
/// motors agree.
#[test]
fn law_families_rise_and_the_fine_ones_repeat() {
    for family in Family::ALL {
        for pair in map().bursts(family).windows(2) {
            assert!(pair[0].turn_rad < pair[1].turn_rad, "{family:?} {pair:?}");
            assert!(pair[0].amplitude <= pair[1].amplitude && pair[0].ticks <= pair[1].ticks);
        }
    }
    for family in [Family::Step, Family::Walk] {
        for burst in map().bursts(family) {
            assert!(burst.repeat_sd_rad < 0.2 * burst.motors_sd_rad, "{family:?} {burst:?}");
        }
    }
}

/// Neighbouring families overlap.
#[test]
fn law_every_distance_has_a_burst() {
    for chain in [&[Family::Step, Family::Walk, Family::Stride][..], &[Family::Nudge, Family::Throw]] {
        for pair in chain.windows(2) {
            let (_, longest) = map().range_rad(pair[0], 1.0).unwrap();
            let (shortest, _) = map().range_rad(pair[1], 1.0).unwrap();
            assert!(shortest <= longest, "{pair:?}");
        }
    }
}

#[test]
fn exact_interpolation_between_two_bursts() {
    let [first, second, ..] = map().bursts(Family::Step) else { unreachable!() };
    let half = map().burst(Family::Step, 0.5 * (first.turn_rad + second.turn_rad), 1.0).unwrap();
    assert!((half.amplitude - 0.5 * (first.amplitude + second.amplitude)).abs() < 1e-6);
    assert_eq!(half.ticks, first.ticks);
    let throws = map().bursts(Family::Throw);
    let wanted = 0.3 * throws[0].turn_rad + 0.7 * throws[1].turn_rad;
    let between = map().burst(Family::Throw, wanted, 1.0).unwrap();
    let ticks = 0.3 * throws[0].ticks as f32 + 0.7 * throws[1].ticks as f32;
    assert!((between.ticks as f32 - ticks).abs() <= 0.5);
    // A whole number of ticks, and the turn that belongs to it.
    let per_tick = (throws[1].turn_rad - throws[0].turn_rad) / (throws[1].ticks - throws[0].ticks) as f32;
    assert!((between.turn_rad - wanted).abs() <= 0.51 * per_tick);
    let belongs = throws[0].turn_rad + (between.ticks - throws[0].ticks) as f32 * per_tick;
    assert!((between.turn_rad - belongs).abs() < 1e-3 * per_tick, "{between:?}");
}

#[test]
fn exact_beyond_the_ends_the_ends_and_weaker_if_limited() {
    let walks = map().bursts(Family::Walk);
    assert_eq!(map().burst(Family::Walk, 1e9, 1.0).unwrap(), walks[walks.len() - 1]);
    assert_eq!(map().burst(Family::Walk, 0.0, 1.0).unwrap(), walks[0]);
    assert_eq!(map().burst(Family::Throw, 1.0, 0.5), None);
    assert_eq!(map().range_rad(Family::Throw, 0.5), None);
    assert!(map().range_rad(Family::Step, 0.5).unwrap().1 < map().range_rad(Family::Step, 1.0).unwrap().1);
    assert!(map().burst(Family::Step, 1e9, 0.5).unwrap().amplitude <= 0.5);
    assert!(map().strongest_cruise(DriveMode::C, 1.0).unwrap().amplitude > 0.99);
    assert!(map().strongest_cruise(DriveMode::C, 0.55).unwrap().amplitude <= 0.55);
    assert_eq!(map().strongest_cruise(DriveMode::B, 0.0), None);
}

/// Both modes, one of them alone, and none; from rest to twice the highest rate, from 0 to 100 degrees.
#[test]
fn dual_a_cruise_and_its_coast_are_those_that_a_search_of_all_rows_finds() {
    let [b, c] = [DriveMode::B, DriveMode::C].map(|mode| map().cruises_of(mode));
    assert_eq!([b, c].concat(), map().cruises());
    for rows in [map().cruises(), b, c, &[]] {
        let found = ResponseMap::try_new(*map().design(), rows, [&[]; Family::ALL.len()], 0.0).unwrap();
        for mode in [DriveMode::B, DriveMode::C] {
            let of_mode: Vec<&Cruise> = rows.iter().filter(|cruise| cruise.mode == mode).collect();
            for deg_s in 0..2000_u16 {
                let rate_rad_s = f32::from(deg_s).to_radians();
                let next = of_mode.iter().find(|cruise| cruise.rate_rad_s.abs() >= rate_rad_s);
                let coast_s = next.or(of_mode.last()).map_or(0.0, |cruise| cruise.coast_s);
                let coast_rad = found.coast_rad(mode, rate_rad_s);
                assert_eq!(coast_rad.to_bits(), (rate_rad_s * coast_s).to_bits(), "{mode:?} {deg_s}");
            }
            for (limit, root) in [0.2, 0.55, 1.0].into_iter().flat_map(|x| (0..100_u16).map(move |n| (x, n)))
            {
                let remaining_rad = (0.01 * f32::from(root) * f32::from(root)).to_radians();
                let turns = |cruise: &&&Cruise| cruise.amplitude <= limit && cruise.turns_every_motor();
                let has_room = |cruise: &&&Cruise| cruise.room_rad() <= remaining_rad;
                let roomy = of_mode.iter().filter(turns).rfind(has_room);
                let expected = roomy.or(of_mode.iter().find(turns)).map(|cruise| **cruise);
                assert_eq!(found.cruise_within(mode, limit, remaining_rad), expected);
                for amplitude in [0.0, 0.3, 0.5, 1.0] {
                    let weaker = found.cruise_weaker_than(amplitude, mode, limit, remaining_rad);
                    assert_eq!(weaker, expected.filter(|cruise| cruise.amplitude < amplitude));
                }
            }
        }
    }
}
