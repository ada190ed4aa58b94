//! The table of readers beside what each command does with a scene.

use std::collections::BTreeSet;

use super::*;
use crate::board::pil;
use crate::board::serial::{BoardTask, FrameSource, PreparedJog, PreparedSelfTest};
use crate::studies::beside::BesideScene;
use crate::studies::fault_campaign::FaultCampaignPlan;
use crate::studies::instrument_grid::InstrumentGridPlan;
use crate::studies::positioning_trials::{self, Strategy};
use crate::studies::shard::Shard;
use crate::studies::{filter_costs, filter_errors, gyroscope_calibration, stator};
use analysis::response_map;
use controller::rate::{Profile, RateHold, RateTuning};
use link::LINE_BAUD;
use motor_model::Time;
use simulation::runs::{closed_loop, commission, position, rate, recording, simulate};
use simulation::scene::Scene;

/// A scene of short runs that has a fault of each instrument, so that the keys of the faults are read.
fn short(sets: &[&str], faulty: bool) -> Scene {
    let faults =
        ["camera.fault=offset", "camera.fault_from_s=1e5", "ldv.fault=stuck", "ldv.fault_from_s=1e5"];
    let faults = if faulty { &faults[..] } else { &[] };
    let sets: Vec<String> = sets.iter().chain(faults).map(|&set| set.to_owned()).collect();
    Scene::of_sets(&sets).unwrap().unread()
}

/// The table says of `command` what was read of `scene`.
#[track_caller]
fn agrees(command: &str, scene: &Scene) {
    agrees_with(Reader::named(command), scene);
}

#[track_caller]
fn agrees_with(reader: &Reader, scene: &Scene) {
    let command = reader.command;
    let stated: BTreeSet<&str> =
        registry().map(|setting| setting.key).filter(|key| reader.reads(key)).collect();
    let read = scene.keys_read();
    let missing: Vec<_> = read.difference(&stated).collect();
    assert!(missing.is_empty(), "{command} reads {missing:?}, which the table leaves out");
    let ignored: Vec<_> = stated.difference(&read).collect();
    assert!(ignored.is_empty(), "{command} does not read {ignored:?}, which the table has");
}

#[test]
fn exact_simulate_reads_what_the_table_says() {
    let scene = short(&["simulate.duration_s=0.01", "simulate.settle_s=0"], false);
    simulate::OpenLoopModel::from_scene(&scene).unwrap();
    simulate::simulate(&simulate::OpenLoopRun::from_scene(&scene).unwrap(), &mut ()).unwrap();
    agrees("simulate", &scene);
}

#[test]
fn exact_position_reads_what_the_table_says() {
    let scene = short(&["position.deadline_s=0.01"], true);
    position::run(&scene, |_| ()).unwrap();
    agrees("position", &scene);
}

/// A motor that nothing turns is commissioned in a few seconds of its time.
#[test]
fn exact_commission_reads_what_the_table_says() {
    let scene = short(&["faults=drive:dead", "plant.step_s=5e-6"], true);
    commission::run(&scene, |_| ()).unwrap();
    agrees("commission", &scene);
}

#[test]
fn exact_pil_reads_what_the_table_says() {
    let scene = short(&["position.deadline_s=0.01"], true);
    pil::preparation(&scene).unwrap();
    position::run(&scene, |_| ()).unwrap();
    agrees_with(&PIL_MOVE, &scene);
    // A real board does the same with the same preparation, and counts from where it is told.
    BoardTask::Move.zero(&scene).unwrap();
    agrees_with(&RUN_MOVE, &scene);
}

/// A board, emulated or real, holds a rate with this preparation, and no other course of it.
#[test]
fn exact_boards_read_what_the_tables_say() {
    let scene = short(&["rate.duration_s=0.5", "plant.step_s=5e-6"], true);
    pil::rate_preparation(&scene).unwrap();
    closed_loop::rate(
        &scene,
        RateHold::new(Profile::dwell(500.0).unwrap(), RateTuning::default(), Time::ZERO),
    )
    .unwrap()
    .next_tick();
    agrees_with(&PIL_RATE, &scene);
    BoardTask::Rate.zero(&scene).unwrap();
    agrees_with(&RUN_RATE, &scene);
    // The table of a command is that of both.
    for (command, of_move, of_rate) in [("run", &RUN_MOVE, &RUN_RATE), ("pil", &PIL_MOVE, &PIL_RATE)] {
        for key in registry().map(|setting| setting.key) {
            let is_read = of_move.reads(key) || of_rate.reads(key);
            assert_eq!(Reader::named(command).reads(key), is_read, "{command} {key}");
        }
    }
}

#[test]
fn exact_rate_reads_what_the_table_says() {
    let scene = short(&["rate.duration_s=0.5", "plant.step_s=5e-6"], true);
    rate::run(&scene, |_| ()).unwrap();
    agrees("rate", &scene);
}

#[test]
fn exact_record_reads_what_the_table_says() {
    let scene = short(&["record.schedule=b:1 for 0.01", "plant.step_s=5e-6"], true);
    assert!(recording::run(&scene, &mut ()).unwrap().is_continue());
    agrees("record", &scene);
}

/// The plant is that of a recording; the map that forecasts, and what the board is told, are of the motor alone.
#[test]
fn exact_jog_and_self_test_read_what_the_table_says() {
    let scene = short(&["plant.step_s=5e-6"], true);
    PreparedJog::of(&scene).unwrap();
    agrees("jog", &scene);
    let scene = short(&["plant.step_s=5e-6"], true);
    PreparedSelfTest::of(&scene, &FrameSource::Plant, LINE_BAUD).unwrap();
    agrees("self-test", &scene);
}

#[test]
fn exact_calibrate_reads_what_the_table_says() {
    let scene = short(&["calibrate.duration_s=2", "calibrate.rest_s=0.05", "plant.step_s=5e-6"], true);
    gyroscope_calibration::CalibrationPlan::new(&scene, 1, 1).unwrap().run(&|| ()).unwrap();
    agrees("calibrate", &scene);
}

#[test]
fn exact_estimate_reads_what_the_table_says() {
    let scene = short(&["plant.step_s=5e-6"], true);
    filter_errors::FilterErrorsPlan::new(&scene, 1).unwrap().run(&|_| ()).unwrap();
    agrees("estimate", &scene);
}

#[test]
fn exact_filters_reads_what_the_table_says() {
    let scene = short(&["plant.step_s=5e-6"], true);
    filter_costs::FilterCostsPlan::new(&scene, 1, 1).unwrap().run(None, &|| ()).unwrap();
    agrees("filters", &scene);
}

#[test]
fn exact_positioning_trials_reads_what_the_table_says() {
    let seed = (0..1000).find(|seed| positioning_trials::target(*seed).1.abs() < 0.01).unwrap();
    let scene = short(&[&format!("seed={seed}"), "plant.step_s=5e-6"], true);
    positioning_trials::PositioningTrialsPlan::new(&scene, Strategy::Planned, 1)
        .unwrap()
        .run(&|_| ())
        .unwrap();
    agrees("positioning-trials", &scene);
}

#[test]
fn exact_response_map_reads_what_the_table_says() {
    let scene = short(&[], false);
    response_map::ResponseMapCampaign::new(&scene, 1).unwrap();
    agrees("response-map", &scene);
}

#[test]
fn exact_instruments_reads_what_the_table_says() {
    let scene = short(&["plant.step_s=5e-6"], true);
    let one = Shard { index: 1, count: 32 };
    InstrumentGridPlan::new(&scene, 1, "10,000 frames/s", one).run(&|| ()).unwrap();
    agrees("instruments", &scene);
}

#[test]
fn exact_faults_reads_what_the_table_says() {
    let scene = short(&["plant.step_s=5e-6"], true);
    let scenes = vec![BesideScene { name: String::new(), scene: scene.clone() }];
    FaultCampaignPlan::new(scenes, 1, Shard::ALL).run(&|| ()).unwrap();
    agrees("faults", &scene);
}

#[test]
fn exact_stator_reads_what_the_table_says() {
    let scene = short(&[], false);
    stator::drawing(&scene);
    stator::wanted(&scene);
    stator::given_motor(&scene);
    agrees("stator", &scene);
}

#[test]
fn exact_refusals_name_the_key_and_its_readers() {
    let refused = |command: &str, key| Reader::named(command).admit(key).unwrap_err().one_line();
    assert_eq!(
        refused("simulate", "plant.friction"),
        "error: simulate does not read plant.friction; hint: position, commission, rate, record, calibrate, estimate, \
         filters, positioning-trials, instruments, faults, response-map, pil, run, jog, self-test read it; simulate \
         reads simulate.friction"
    );
    assert_eq!(
        refused("response-map", "plant.step_s"),
        "error: response-map sets plant.step_s itself; hint: position, commission, rate, record, calibrate, estimate, \
         filters, positioning-trials, instruments, faults, pil, run, jog, self-test read it"
    );
    assert_eq!(
        refused("position", "calibrate.steps"),
        "error: position does not read calibrate.steps; hint: calibrate reads it"
    );
    assert_eq!(
        refused("positioning-trials", "position.to_deg"),
        "error: positioning-trials sets position.to_deg itself; hint: position, pil, run read it"
    );
    let refused = |reader: &Reader, key| reader.admit(key).unwrap_err().one_line();
    assert_eq!(
        refused(&RUN_RATE, "rate.profile"),
        "error: run --deg-s does not read rate.profile; hint: rate reads it"
    );
    assert_eq!(
        refused(&RUN_MOVE, "rate.deg_s"),
        "error: run without --deg-s does not read rate.deg_s; hint: rate, pil, run read it"
    );
}

#[test]
fn exact_every_key_has_a_reader() {
    for setting in registry() {
        assert!(readers_of(setting.key).next().is_some(), "{}", setting.key);
    }
}
