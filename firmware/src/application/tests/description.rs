//! What the host says of bench, map and move, and what of it is refused.

use controller::response_map::{Family, MapField, MapPlace};
use controller::{Limits, MoveForecast, PositioningTuning, ResponseMap};
use estimator::{CameraDescription, Instruments};
use link::{BurstRecord, MapEnd, MapFault, MapRows, MotorParameterRecord, map_messages};
use motor_model::Parameter;

use super::configured_move::{Configured, Move};
use super::*;

/// L8: a configuration with one value out of bounds is refused as a whole.
#[test]
fn law_a_configuration_out_of_bounds_is_refused_whole() {
    let mut bench = Bench::new();
    bench.exchange(&HostMessage::Hello);
    for (configuration, key) in [
        (Configuration { target_deg: f64::NAN, ..MOVE }, "position.to_deg"),
        (Configuration { target_deg: 1e9, ..MOVE }, "position.to_deg"),
        (Configuration { tolerance_deg: 0.0, ..MOVE }, "position.tolerance_deg"),
        (Configuration { tolerance_deg: f64::INFINITY, ..MOVE }, "position.tolerance_deg"),
        (Configuration { deadline_nanos: u64::MAX, ..MOVE }, "position.deadline_s"),
    ] {
        let refused = fault(BoardFault::OutOfBounds { key: key.try_into().unwrap() });
        assert_eq!(bench.exchange(&HostMessage::Configure(configuration)), refused);
        assert_eq!(bench.exchange(&HostMessage::Arm), fault(BoardFault::NotReady));
    }
    // A refused configuration leaves the previous one in force.
    bench.exchange(&HostMessage::Configure(MOVE));
    bench.exchange(&HostMessage::Configure(Configuration { target_deg: f64::NAN, ..MOVE }));
    assert_eq!(bench.exchange(&HostMessage::Arm), [BoardMessage::Armed]);
    bench.drive();
}

/// L8: what the host says of instruments and motor is refused out of bounds, and serves the configurations that follow
/// until another session.
#[test]
fn law_the_bench_is_described_before_the_move_is_configured() {
    let mut bench = Bench::new();
    bench.exchange(&HostMessage::Hello);
    let Instruments { camera, vibrometer } = Instruments::default();
    let slow = CameraDescription { period_nanos: 5_000_000, shift_m: 5e-6, ..camera };
    let blind = CameraDescription { period_nanos: 0, ..camera };
    let [biased, shifted] = [(f64::NAN, 0.0), (0.0, 0.1)].map(|(mark_bias_m, shift_m)| CameraDescription {
        mark_bias_m,
        shift_m,
        ..camera
    });
    for (message, key) in [
        (HostMessage::Instruments(Instruments { camera: blind, vibrometer }), "camera.frame_rate_hz"),
        (HostMessage::Instruments(Instruments { camera: biased, vibrometer }), "camera.mark_bias_m"),
        (HostMessage::Instruments(Instruments { camera: shifted, vibrometer }), "camera.shift_m"),
        (HostMessage::MotorParameter(MotorParameterRecord { index: 255, value: 1.0 }), "motor"),
        (
            HostMessage::MotorParameter(MotorParameterRecord {
                index: Parameter::RotorMass as u8,
                value: f64::NAN,
            }),
            "motor.rotor_mass_kg",
        ),
    ] {
        let refused = fault(BoardFault::OutOfBounds { key: key.try_into().unwrap() });
        assert_eq!(bench.exchange(&message), refused);
    }
    let instruments = Instruments { camera: slow, vibrometer: None };
    assert_eq!(bench.exchange(&HostMessage::Instruments(instruments)), [BoardMessage::Described]);
    let heavier = MotorParameterRecord { index: Parameter::RotorMass as u8, value: 2e-4 };
    assert_eq!(bench.exchange(&HostMessage::MotorParameter(heavier)), [BoardMessage::Described]);
    assert_eq!(bench.board.bench.instruments, instruments);
    assert!((bench.board.bench.design.get(Parameter::RotorMass) - 2e-4).abs() < f64::EPSILON);
    // The map of Table 1 is for another motor.
    let other = fault(BoardFault::Map(MapFault::OtherDesign));
    assert_eq!(bench.exchange(&HostMessage::Configure(MOVE)), other);
    bench.describe_map(ResponseMap::table_1());
    assert_eq!(bench.board.amplifier().design, MotorParams::nominal(), "a refused move changes no drive");
    assert_eq!(bench.exchange(&HostMessage::Configure(MOVE)), [BoardMessage::Configured]);
    assert_eq!(bench.board.amplifier().design, bench.board.bench.design);
    let Some(Configured::Move(Move { tuning, .. })) = &bench.board.memory.configured else {
        panic!("no move")
    };
    assert_eq!(tuning.frame_wait_nanos, PositioningTuning::new(&instruments).frame_wait_nanos);
    assert_ne!(tuning.frame_wait_nanos, PositioningTuning::default().frame_wait_nanos);
    bench.exchange(&HostMessage::Arm);
    assert_eq!(bench.exchange(&HostMessage::MotorParameter(heavier)), fault(BoardFault::Armed));
    bench.begin();
    assert_eq!(bench.board.bench.instruments, Instruments::default());
}

/// The bench is changed after the move was configured, so that the move is refused when the stop configures it anew: a
/// motor that is not the map's. Its filter has measured, so the board does not arm it again.
#[test]
fn law_a_stop_that_cannot_configure_the_move_anew_leaves_none() {
    let mut bench = Bench::new();
    bench.exchange(&HostMessage::Hello);
    assert_eq!(bench.exchange(&HostMessage::Configure(MOVE)), [BoardMessage::Configured]);
    let value = 1.001 * MotorParams::nominal().get(Parameter::ALL[0]);
    let other = HostMessage::MotorParameter(MotorParameterRecord { index: 0, value });
    assert_eq!(bench.exchange(&other), [BoardMessage::Described]);
    assert_eq!(bench.exchange(&HostMessage::Arm), [BoardMessage::Armed]);
    bench.drive();
    assert_eq!(bench.exchange(&HostMessage::Stop), [BoardMessage::Stopped]);
    assert_eq!(bench.exchange(&HostMessage::Arm), fault(BoardFault::NotReady));
    assert!(bench.off());
}

/// L8: a question is answered for the bench that was described, moves nothing and configures nothing. A question that
/// no configuration could be is refused as that would be, and so is any while armed.
#[test]
fn dual_the_forecast_is_that_of_the_bench_that_was_described() {
    let mut bench = Bench::new();
    bench.exchange(&HostMessage::Hello);
    let ask = |bench: &mut Bench, question| bench.exchange(&HostMessage::Forecast(question));
    let camera = CameraDescription { period_nanos: 5_000_000, ..CameraDescription::default() };
    let slow = Instruments { camera, vibrometer: None };
    for instruments in [Instruments::default(), slow] {
        bench.exchange(&HostMessage::Instruments(instruments));
        for (tolerance_deg, deadline_nanos) in [(0.02, 30_000_000_000), (0.001, 1_000_000_000)] {
            let limits = Limits { deadline_nanos, ..Limits::default() };
            #[expect(clippy::cast_possible_truncation, reason = "the controller computes in f32")]
            let [far_rad, fine_rad] = [MOVE.target_deg, tolerance_deg].map(|deg| deg.to_radians() as f32);
            let map = ResponseMap::table_1();
            let own = MoveForecast::try_new(&instruments, map, &limits, far_rad, fine_rad);
            let answer = BoardMessage::Forecast(own.map(Into::into).map_err(Into::into));
            let question = Configuration { tolerance_deg, deadline_nanos, ..MOVE };
            assert_eq!(ask(&mut bench, question), [answer]);
        }
    }
    assert!(bench.off());
    assert_eq!(bench.exchange(&HostMessage::Arm), fault(BoardFault::NotReady));
    let key = "position.to_deg".try_into().unwrap();
    let nowhere = Configuration { target_deg: f64::NAN, ..MOVE };
    assert_eq!(ask(&mut bench, nowhere), fault(BoardFault::OutOfBounds { key }));
    let heavier = MotorParameterRecord { index: Parameter::RotorMass as u8, value: 2e-4 };
    bench.exchange(&HostMessage::MotorParameter(heavier));
    assert_eq!(ask(&mut bench, MOVE), fault(BoardFault::Map(MapFault::OtherDesign)));
    bench.begin();
    assert_eq!(ask(&mut bench, MOVE), fault(BoardFault::Armed));
    assert!(bench.board.is_armed());
}

/// The rows of Table 1 under every drive turned by a part more: another map.
fn other_map() -> ResponseMap {
    let table_1 = ResponseMap::table_1();
    let longer = |family| -> Vec<_> {
        let mut bursts = table_1.bursts(family).to_vec();
        for burst in &mut bursts {
            burst.turn_rad *= 1.25;
        }
        bursts
    };
    let bursts = Family::ALL.map(longer);
    let tables = bursts.each_ref().map(Vec::as_slice);
    ResponseMap::try_new(*table_1.design(), table_1.cruises(), tables, 0.5).unwrap()
}

/// L8: the loop plans by the map that came, bit by bit, until another session.
#[test]
fn dual_the_map_that_came_is_the_one_that_was_sent() {
    let mut bench = Bench::new();
    bench.exchange(&HostMessage::Hello);
    bench.describe_map(&other_map());
    let plans_by = |bench: &Bench, map: &ResponseMap| bench.board.memory.map.map() == Ok(map);
    assert!(plans_by(&bench, &other_map()));
    assert_eq!(bench.exchange(&HostMessage::Configure(MOVE)), [BoardMessage::Configured]);
    bench.exchange(&HostMessage::Arm);
    bench.drive();
    assert_eq!(bench.exchange(&HostMessage::MapBegin), fault(BoardFault::Armed));
    assert!(plans_by(&bench, &other_map()), "armed, it stays");
    bench.exchange(&HostMessage::Hello);
    assert!(plans_by(&bench, ResponseMap::table_1()));
}

/// L8: a map that has begun takes the place of the one before it. Nothing is configured until it is complete.
#[test]
fn law_an_incomplete_map_drives_nothing() {
    let mut bench = Bench::new();
    bench.exchange(&HostMessage::Hello);
    bench.exchange(&HostMessage::Configure(MOVE));
    let messages: Vec<_> = map_messages(&other_map()).collect();
    let (Some(HostMessage::MapEnd(end)), Some(HostMessage::MapRows(MapRows::Cruises(first)))) =
        (messages.last(), messages.get(1))
    else {
        panic!("a map begins with cruises and has an end")
    };
    let incomplete = |rows| fault(BoardFault::Map(MapFault::Incomplete { rows }));
    // Rows, or an end, without a begin.
    assert_eq!(bench.exchange(&messages[1]), incomplete(0));
    assert_eq!(bench.exchange(&HostMessage::MapEnd(*end)), incomplete(0));
    assert_eq!(bench.exchange(&HostMessage::MapBegin), [BoardMessage::Described]);
    assert_eq!(bench.exchange(&HostMessage::Arm), fault(BoardFault::NotReady), "the old move is dropped");
    assert_eq!(bench.exchange(&messages[1]), [BoardMessage::Described]);
    let rows = u8::try_from(first.len()).unwrap();
    // The other rows were lost on the line.
    assert_eq!(bench.exchange(&HostMessage::MapEnd(*end)), incomplete(rows));
    assert_eq!(bench.exchange(&HostMessage::Configure(MOVE)), incomplete(rows));
    assert_eq!(bench.exchange(&HostMessage::Arm), fault(BoardFault::NotReady));
    bench.describe_map(&other_map());
    assert_eq!(bench.exchange(&HostMessage::Configure(MOVE)), [BoardMessage::Configured]);
}

/// L8: rows that are refused are named by table, row and number, and leave the rows before them.
#[test]
fn law_rows_out_of_bounds_are_refused_by_name() {
    let mut bench = Bench::new();
    bench.exchange(&HostMessage::Hello);
    bench.exchange(&HostMessage::MapBegin);
    let steps: Vec<BurstRecord> =
        ResponseMap::table_1().bursts(Family::Step).iter().map(BurstRecord::from).collect();
    let rows = |family: Family, rows: &[BurstRecord]| {
        HostMessage::MapRows(MapRows::Bursts { family: family.into(), rows: rows.iter().copied().collect() })
    };
    let refused = |fault| [BoardMessage::Fault(BoardFault::Map(fault))];
    assert_eq!(bench.exchange(&rows(Family::Step, &steps[..2])), [BoardMessage::Described]);
    let table = MapPlace::Bursts(Family::Step).into();
    let no_number = BurstRecord { turn_rad: f32::NAN, ..steps[2] };
    assert_eq!(
        bench.exchange(&rows(Family::Step, &[no_number])),
        refused(MapFault::OutOfBounds { table, row: 3, field: MapField::Turn.into() })
    );
    assert_eq!(
        bench.exchange(&rows(Family::Step, &[steps[2], steps[0]])),
        refused(MapFault::Unordered { table, row: 4, field: MapField::Turn.into() })
    );
    let no_family =
        MapRows::Bursts { family: link::Coded::from_number(200), rows: [steps[2]].into_iter().collect() };
    assert_eq!(bench.exchange(&HostMessage::MapRows(no_family)), refused(MapFault::Unknown));
    // As many as there is room for, and one more.
    let row = |n: u16| BurstRecord { turn_rad: 0.1 * f32::from(n + 1), ..steps[0] };
    for first in [0, 8] {
        let eight: Vec<_> = (first..first + 8).map(row).collect();
        assert_eq!(bench.exchange(&rows(Family::Walk, &eight)), [BoardMessage::Described]);
    }
    let walk = MapPlace::Bursts(Family::Walk).into();
    assert_eq!(bench.exchange(&rows(Family::Walk, &[row(16)])), refused(MapFault::TooMany { table: walk }));
    let end = |rows, step_walk_correlation| HostMessage::MapEnd(MapEnd { rows, step_walk_correlation });
    assert_eq!(bench.exchange(&end(18, 1.5)), refused(MapFault::Correlation));
    assert_eq!(bench.exchange(&end(18, 0.5)), [BoardMessage::Described]);
}
