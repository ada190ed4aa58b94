extern crate std;

use std::vec;

use super::*;

fn map() -> &'static ResponseMap {
    ResponseMap::table_1()
}

fn with(cruises: &[Cruise], changed: Family, rows: &[Burst]) -> Result<ResponseMap, MapError> {
    let bursts = Family::ALL.map(|family| if family == changed { rows } else { map().bursts(family) });
    ResponseMap::try_new(*map().design(), cruises, bursts, map().step_walk_correlation())
}

/// The map compiled in keeps the rules, and its rows give it again.
#[test]
fn exact_the_rows_of_table_1_are_its_map() {
    assert_eq!(with(map().cruises(), Family::Step, map().bursts(Family::Step)).as_ref(), Ok(map()));
    assert_eq!(*map().design(), MotorParams::nominal());
}

#[test]
fn exact_empty_families_are_allowed_and_drive_nothing() {
    let empty = with(&[], Family::Nudge, &[]).unwrap();
    assert_eq!((empty.cruises().len(), empty.burst(Family::Nudge, 1e-3, 1.0)), (0, None));
    assert_eq!(empty.strongest_cruise(DriveMode::B, 1.0), None);
    assert_eq!(empty.bursts(Family::Step), map().bursts(Family::Step));
}

#[test]
fn exact_each_number_out_of_its_bounds_is_named() {
    type Change = fn(&mut Burst, f32);
    type CruiseChange = fn(&mut Cruise, f32);
    let cases: [(MapField, Change); 4] = [
        (MapField::Amplitude, |burst, value| burst.amplitude = value),
        (MapField::Turn, |burst, value| burst.turn_rad = value),
        (MapField::MotorsSd, |burst, value| burst.motors_sd_rad = value),
        (MapField::RepeatSd, |burst, value| burst.repeat_sd_rad = value),
    ];
    for (field, change) in cases {
        for value in [f32::NAN, f32::INFINITY, -1.0] {
            let mut rows = map().bursts(Family::Walk).to_vec();
            change(&mut rows[3], value);
            let error = with(map().cruises(), Family::Walk, &rows).unwrap_err();
            let MapError::OutOfBounds { place, row, field: named, .. } = error else { panic!("{error}") };
            assert_eq!((place, row, named), (MapPlace::Bursts(Family::Walk), 4, field), "{error}");
        }
    }
    let cases: [(MapField, CruiseChange); 5] = [
        (MapField::Amplitude, |cruise, value| cruise.amplitude = value),
        (MapField::Rate, |cruise, value| cruise.rate_rad_s = value),
        (MapField::RateSd, |cruise, value| cruise.rate_sd_rad_s = value),
        (MapField::Coast, |cruise, value| cruise.coast_s = value),
        (MapField::CoastSd, |cruise, value| cruise.coast_sd_rad = value),
    ];
    for (field, change) in cases {
        for value in [f32::NAN, f32::INFINITY, -1.0] {
            let mut cruises = map().cruises().to_vec();
            change(&mut cruises[2], value);
            let error = with(&cruises, Family::Step, &[]).unwrap_err();
            let MapError::OutOfBounds { place, row, field: named, .. } = error else { panic!("{error}") };
            assert_eq!((place, row, named), (MapPlace::Cruises, 3, field), "{error}");
        }
    }
    for value in [f32::NAN, 1.5] {
        let bursts = Family::ALL.map(|family| map().bursts(family));
        let error = ResponseMap::try_new(*map().design(), &[], bursts, value).unwrap_err();
        assert!(matches!(error, MapError::Correlation { .. }), "{error}");
    }
}

#[test]
fn exact_rows_out_of_order_are_named() {
    let mut rows = map().bursts(Family::Throw).to_vec();
    rows.swap(4, 5);
    let error = with(map().cruises(), Family::Throw, &rows).unwrap_err();
    let MapError::Unordered { place, row, field, .. } = error else { panic!("{error}") };
    assert_eq!((place, row, field), (MapPlace::Bursts(Family::Throw), 6, MapField::Turn));

    let mut cruises = map().cruises().to_vec();
    cruises.swap(0, 1);
    let error = with(&cruises, Family::Throw, &[]).unwrap_err();
    let MapError::Unordered { place, row, field, .. } = error else { panic!("{error}") };
    assert_eq!((place, row, field), (MapPlace::Cruises, 2, MapField::Rate));

    let mut cruises = map().cruises().to_vec();
    cruises.reverse();
    let error = with(&cruises[6..8], Family::Throw, &[]).unwrap_err();
    assert_eq!(error, MapError::ModesMixed { row: 2 });
}

#[test]
fn exact_more_rows_than_there_is_room_for_are_refused() {
    let rows = vec![map().bursts(Family::Step)[0]; BURSTS_MAX + 1];
    let expected =
        MapError::TooMany { place: MapPlace::Bursts(Family::Step), count: BURSTS_MAX + 1, max: BURSTS_MAX };
    assert_eq!(with(&[], Family::Step, &rows), Err(expected));
    let cruises = vec![map().cruises()[0]; CRUISES_MAX + 1];
    assert!(matches!(with(&cruises, Family::Step, &[]), Err(MapError::TooMany { .. })));
}
