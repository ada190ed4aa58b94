//! The closed loop on motors that nobody has tuned it for.

use crate::closeness::assert_between;
use crate::command::{folder, json, number, run_on};

const SEEDS: u32 = 20;
/// The default tolerance, 1 milli-degree, is kept with 95 % confidence; what all of 20 keep is twice that.
const WORST_MDEG: f64 = 2.0;

/// Moves 20 drawn motors by `degrees` and checks what the plant, not the estimate, says of each.
fn check_moves(degrees: f64, settle_max_s: f64) {
    let folder = folder();
    let to = degrees.to_string();
    let mut within = 0;
    for seed in 1..=SEEDS {
        let seed = seed.to_string();
        let moved = json(folder.path(), &["position", "--to", &to, "--seed", &seed, "--format", "json"]);
        let what = format!("{to} degrees, seed {seed}");
        assert_between(number(&moved, "final_error_mdeg"), -WORST_MDEG, WORST_MDEG, &what);
        // Three witnesses: the error, the angle and the target must agree, to the unit of an angle, 8.4e-5 milli-degrees.
        let off_deg = number(&moved, "final_angle_true_deg") - number(&moved, "target_deg");
        assert_between(1e3 * off_deg - number(&moved, "final_error_mdeg"), -1e-4, 1e-4, &what);
        assert_between(number(&moved, "settle_time_s"), 1e-3, settle_max_s, &what);
        assert_between(number(&moved, "rms_estimate_error_mdeg"), 0.3, 25.0, &what);
        assert_between(number(&moved, "drive_switches"), 2.0, 60.0, &what);
        within += u32::from(moved["ok"].as_bool().unwrap_or(false));
    }
    // 95 % of 20 are 19; fewer than 16 have a probability of 0.3 %.
    assert!(within >= 16, "{within} of {SEEDS} within the tolerance of {to} degrees");
}

#[test]
fn tool_moves_clockwise_by_a_quarter_turn() {
    check_moves(90.0, 2.0);
}

/// Mode C is slow, and slower in some motors: 15 to 170 degrees a second.
#[test]
fn tool_moves_counter_clockwise_by_a_quarter_turn() {
    check_moves(-90.0, 7.0);
}

#[test]
fn tool_moves_clockwise_by_half_a_degree() {
    check_moves(0.5, 1.5);
}

#[test]
fn tool_moves_counter_clockwise_by_a_twentieth_of_a_degree() {
    check_moves(-0.05, 1.0);
}

/// Small sets of trials: the same bytes on any number of threads, the stated fields, and figures near the targets.
#[test]
fn tool_positioning_trials_are_the_same_on_any_number_of_threads() {
    let arguments = ["positioning-trials", "--trials", "12", "--seed", "100", "--format", "json"];
    let folder = folder();
    let outputs = [1, 3].map(|threads| {
        let output = run_on(threads, folder.path(), &arguments);
        assert!(output.status.success());
        let csv = std::fs::read(folder.path().join("out/positioning-trials/trials.csv")).expect("a table");
        (output.stdout, csv)
    });
    assert_eq!(outputs[0], outputs[1]);
    let trials: serde_json::Value = serde_json::from_slice(&outputs[0].0).expect("one JSON object");
    assert_between(number(&trials, "trials"), 12.0, 12.0, "trials");
    assert_between(number(&trials, "failures"), 0.0, 0.0, "failures");
    assert_between(number(&trials, "p50_mdeg"), 0.0, 0.4, "median");
    assert_between(number(&trials, "max_mdeg"), 0.1, 1.5, "worst");
    assert_between(number(&trials, "median_settle_s"), 0.4, 3.0, "settling");
    assert_between(number(&trials, "settle_over_bound"), 1.0, 3.0, "bound");
    assert!(number(&trials, "p95_mdeg") <= number(&trials, "p999_mdeg"));
}

/// A cell of each family and a cruise, identified again from fewer motors: the same within four standard errors of both.
#[test]
fn dual_the_compiled_response_map_is_what_the_plant_does() {
    use controller::response_map::{CRUISES, Family};
    use host_sim::{Scene, response_map::Campaign};

    const MOTORS: u64 = 40;
    let mut scene = Scene::default();
    // Motors that the map was not identified from.
    scene.set("seed", "5000").expect("a seed");
    let campaign = Campaign::new(&scene, MOTORS).expect("a campaign");
    #[expect(clippy::cast_precision_loss, reason = "40")]
    let root = motor_model::math::sqrt(MOTORS as f64);
    for family in Family::ALL {
        let burst = family.bursts()[2];
        let row = campaign.burst(family.mode(), burst.amplitude, burst.ticks);
        let mdeg = |rad: f32| 1e3 * f64::from(rad).to_degrees();
        let within = 4.5 * mdeg(burst.motors_rad) / root;
        let expected = mdeg(burst.turn_rad);
        assert_between(row.turn_mdeg.abs(), expected - within, expected + within, format!("{family:?}"));
    }
    let cruise = CRUISES[CRUISES.len() - 1];
    let row = campaign.cruise(cruise.mode, cruise.amplitude);
    let (expected, within) = (f64::from(cruise.rate_rad_s), 4.5 * f64::from(cruise.rate_sd_rad_s) / root);
    assert_between(row.rate_rad_s, expected - within, expected + within, "cruise");
}

/// A move of the motor that `seed` names, with what goes wrong.
fn faulty(seed: &str, settings: &[&str]) -> serde_json::Value {
    let mut arguments = vec!["position", "--seed", seed, "--format", "json"];
    arguments.extend(settings.iter().flat_map(|setting| ["--set", setting]));
    json(folder().path(), &arguments)
}

/// K5, K8: faults that a move outlives: it ends on target, measured by the truth.
#[test]
fn tool_faults_that_a_move_survives() {
    for settings in [
        // The drive loses 30 % of its amplitude on the way.
        &["fault.drive_gain=0.7", "fault.from_s=0.05"][..],
        &["fault.drive_gain=0.7", "fault.from_s=0.05", "position.to_deg=-20"],
        // The rotor is jolted while it is held.
        &["fault.jolt_rad_s=2", "fault.from_s=0.6", "position.hold_s=0.6"],
        &["fault.jolt_rad_s=-1", "fault.from_s=0.6", "position.hold_s=0.6"],
        // The camera is lost on the way, and comes back.
        &["camera.lost_from_s=0.05", "camera.lost_until_s=0.3"],
        &["ldv.lost_from_s=0.05", "ldv.lost_until_s=0.3"],
        &["camera.outlier_probability=0.02"],
        // Both resonances have drifted by 1 %.
        &["motor.mode_b.frequency_hz=6363", "motor.mode_c.frequency_hz=7534"],
    ] {
        for seed in ["1", "2"] {
            let moved = faulty(seed, settings);
            assert!(moved["stopped"].is_null(), "{settings:?} {seed}: {moved}");
            assert_between(number(&moved, "final_error_mdeg"), -2.0, 2.0, format!("{settings:?} {seed}"));
        }
    }
}

/// K3, K4: faults that it cannot outlive: it stops, says why, and has not driven for long.
#[test]
fn tool_faults_that_end_a_move_are_named() {
    for (settings, why, on_max_s) in [
        (&["fault.drive_gain=0"][..], "Stalled", 1.5),
        (&["fault.drive_gain=0", "position.to_deg=-0.03"], "Stalled", 6.0),
        (&["fault.modes=swapped"], "ModeInverted", 0.2),
        (&["fault.modes=swapped", "position.to_deg=-0.03"], "ModeInverted", 0.2),
        (&["camera.lost_from_s=0.05", "camera.lost_until_s=100", "position.deadline_s=1"], "TimedOut", 0.2),
    ] {
        for seed in ["1", "2"] {
            let moved = faulty(seed, settings);
            assert_eq!(moved["stopped"], why, "{settings:?} {seed}: {moved}");
            assert_between(number(&moved, "drive_on_s"), 0.0, on_max_s, format!("{settings:?} {seed}"));
        }
    }
}

/// Rates clockwise and counter-clockwise. The angle follows its reference to some 2 degrees at 600 deg/s, so a mean over 6 s is good to 0.1 % and a bit: twice that is allowed.
#[test]
fn tool_rates_are_held() {
    for (deg_s, percent) in [("600", 0.2), ("50", 0.2), ("-40", 0.2)] {
        let arguments = ["rate", "--deg-s", deg_s, "--duration", "6", "--seed", "3", "--format", "json"];
        let held = json(folder().path(), &arguments);
        assert_between(number(&held, "mean_error_percent"), -percent, percent, deg_s);
        assert!(number(&held, "saturated") < 0.6, "{held}");
        assert_between(number(&held["reach"], "clockwise_deg_s"), 600.0, 1100.0, deg_s);
        assert_between(number(&held["reach"], "counter_clockwise_deg_s"), -170.0, -40.0, deg_s);
    }
}

/// What is beyond a motor is said to be, and what it does then is what it reaches: half a second of 5 % scatter at most.
#[test]
fn dual_a_motor_asked_for_too_much_turns_at_what_it_reaches() {
    for (deg_s, field) in [("1100", "clockwise_deg_s"), ("-400", "counter_clockwise_deg_s")] {
        let arguments = ["rate", "--deg-s", deg_s, "--duration", "3", "--seed", "3", "--format", "json"];
        let held = json(folder().path(), &arguments);
        assert_between(number(&held, "mean_deg_s") / number(&held["reach"], field), 0.92, 1.08, deg_s);
        assert!(number(&held, "saturated") > 0.99, "{held}");
    }
}
