extern crate std;

use std::vec::Vec;

use super::*;

/// Rows come back from their records, and the messages hold all of them, in the order of the map.
#[test]
fn dual_the_messages_hold_the_map() {
    let map = ResponseMap::table_1();
    let (mut cruises, mut bursts) = (Vec::new(), [const { Vec::<Burst>::new() }; Family::ALL.len()]);
    let messages: Vec<_> = map_messages(map).collect();
    assert_eq!(messages.first(), Some(&HostMessage::MapBegin));
    for message in &messages {
        match message {
            HostMessage::MapRows(MapRows::Cruises(rows)) => {
                cruises.extend(rows.iter().map(|row| row.cruise().unwrap()));
            }
            HostMessage::MapRows(MapRows::Bursts { family, rows }) => {
                bursts[family.value().unwrap() as usize].extend(rows.iter().map(Burst::from));
            }
            _ => (),
        }
    }
    let Some(HostMessage::MapEnd(end)) = messages.last() else { panic!("no end") };
    assert_eq!(usize::from(end.rows), cruises.len() + bursts.iter().map(Vec::len).sum::<usize>());
    let tables = bursts.each_ref().map(Vec::as_slice);
    assert_eq!(ResponseMap::try_new(*map.design(), &cruises, tables, end.step_walk_correlation), Ok(*map));
}

/// Each number of what was learnt has its place on the wire: value before variance, families in their order, mode B
/// before mode C. It comes back from there.
#[test]
fn exact_what_was_learnt_has_its_places() {
    let factor = |number: u8| LearntFactor { value: f32::from(number), variance: f32::from(number) + 0.5 };
    let offset = |number: u8| ResonanceOffset { hz: f32::from(number), hz2: f32::from(number) + 0.5 };
    let learnt = LearntFactors {
        bursts: Family::ALL.map(|family| factor(family as u8)),
        step_walk_covariance: -1.0,
        rates: [10, 11].map(factor),
        resonances: [20, 21].map(offset),
    };
    let record = LearntRecord {
        factors: [[0.0, 0.5], [1.0, 1.5], [2.0, 2.5], [3.0, 3.5], [4.0, 4.5], [10.0, 10.5], [11.0, 11.5]],
        step_walk_covariance: -1.0,
        resonances: [[20.0, 20.5], [21.0, 21.5]],
    };
    assert_eq!(LearntRecord::from(learnt), record);
    assert_eq!(LearntFactors::from(record), learnt);
}

#[test]
fn exact_a_cruise_has_a_mode() {
    let record = CruiseRecord::from(&ResponseMap::table_1().cruises()[0]);
    assert!(record.cruise().is_some());
    assert_eq!(CruiseRecord { mode: None.into(), ..record }.cruise(), None);
    assert_eq!(CruiseRecord { mode: Coded::from_number(9), ..record }.cruise(), None);
}

/// A fault names table, row and number as a map's file does.
#[test]
fn exact_a_fault_names_table_row_and_number() {
    let steps = ResponseMap::table_1().bursts(Family::Step);
    let mut rows = [steps[0], steps[1], steps[2]];
    rows[2].turn_rad = f32::NAN;
    let none: &[Burst] = &[];
    let refused =
        ResponseMap::try_new(*ResponseMap::table_1().design(), &[], [&rows, none, none, none, none], 0.0);
    let fault = MapFault::from(refused.unwrap_err());
    assert_eq!(std::format!("{fault}"), "step row 3: turn_rad is outside its bounds");
}
