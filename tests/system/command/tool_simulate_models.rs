//! `simulate --model`: the stator without a rotor, the averaged motor, and the keys that they refuse.

#![expect(clippy::disallowed_methods, reason = "an independent yardstick")]

use controller::ResponseMap;
use motor_model::DriveMode;

use crate::support::built_command::{folder, json, number, refuses, succeeds};
use crate::support::closeness::assert_between;

/// At resonance the antinode moves by Table 1's amplitude per `|sin 2 theta_t|` or `|cos 2 theta_t|`. Tooth angle and
/// mode shift make 60 degrees, so the teeth move by `sin 120` or `cos 120` of that.
#[test]
fn exact_stator_has_the_amplitudes_of_table_1() {
    let folder = folder();
    let (sin, cos) = (2.0 * 62.635_f64).to_radians().sin_cos();
    let (b_m, c_m) = (20.72e-6 / sin.abs(), 0.5 * 1.81e-6 / cos.abs());
    for (drive, share, expected_m) in [
        ("b", "1", [b_m, 0.0, b_m * 0.75_f64.sqrt(), b_m * 0.75_f64.sqrt()]),
        ("c", "0.5", [0.0, c_m, c_m * 0.5, c_m * 0.5]),
        ("off", "1", [0.0; 4]),
    ] {
        let run = ["--model", "stator", "--drive", drive, "--amplitude", share, "--step", "10e-6"];
        let report = json(folder.path(), &[&["simulate", "--format", "json"], &run[..]].concat());
        let amplitudes = report["amplitudes"].as_array().expect("an array");
        assert_eq!(amplitudes.len(), 4);
        for (amplitude, expected_m) in amplitudes.iter().zip(expected_m) {
            // Settled to exp(-zeta w 0.5 s), less than 1e-50.
            let within_m = 1e-9 * expected_m;
            let simulated_m = &amplitude["simulated_m"];
            for actual_m in [number(simulated_m, "mean"), number(amplitude, "closed_form_m")] {
                assert_between(actual_m, expected_m - within_m, expected_m + within_m, drive);
            }
            assert_between(number(simulated_m, "sd"), 0.0, within_m, drive);
        }
    }
    let text = succeeds(folder.path(), &["simulate", "--model", "stator", "--step", "10e-6"]);
    assert!(text.contains("teeth 0") && text.contains("ns a step"), "{text}");
}

/// The nominal motor turns within two standard deviations of the motors of the response map. Its moves have the moments
/// of the Ornstein-Uhlenbeck process, within five standard errors. The same seed gives the same figures.
#[test]
fn dual_averaged_motor_turns_as_the_response_map_says() {
    let folder = folder();
    let run = ["simulate", "--model", "averaged", "--duration", "10", "--format", "json", "--drive"];
    for (mode, drive) in [(DriveMode::B, "b"), (DriveMode::C, "c")] {
        let report = json(folder.path(), &[&run[..], &[drive]].concat());
        let cruise = ResponseMap::table_1().strongest_cruise(mode, 1.0).expect("a full drive is allowed");
        let (map, sd) = (f64::from(cruise.rate_rad_s), f64::from(cruise.rate_sd_rad_s));
        let rate = number(&report["rotor_rate_rad_s"], "mean");
        assert_between(rate, map - 2.0 * sd, map + 2.0 * sd, "rate");

        let (identified, turned) = (&report["identified"], &report["angle_deg"]);
        let (w, tau) = (number(identified, "rate_rad_s"), number(identified, "time_constant_s").max(0.0));
        let variance = number(identified, "diffusion_rad2_s") * (2.0 * 10.0 - 3.0 * tau);
        let (mean_deg, sd_deg) = ((w * (10.0 - tau)).to_degrees(), variance.sqrt().to_degrees());
        let within = 5.0 / number(&report, "moves").sqrt();
        let excess = (number(turned, "mean") - mean_deg) / sd_deg;
        assert_between(excess, -within, within, "mean of the turn");
        assert_between(number(turned, "sd") / sd_deg, 1.0 - within, 1.0 + within, "spread of the turn");
        let again = json(folder.path(), &[&run[..], &[drive]].concat());
        assert_eq!((identified, turned), (&again["identified"], &again["angle_deg"]));
    }
}

#[test]
fn tool_models_refuse_what_they_do_not_use() {
    let folder = folder();
    let cases: &[(&[&str], &[&str])] = &[
        (&["stator", "--impacts", "located"], &["simulate.impacts", "stator", "simulate.model=motor"]),
        (&["stator", "--set", "motor.rotor_mass_kg=50e-6"], &["motor.rotor_mass_kg", "stator"]),
        (&["stator", "--out", "run.csv"], &["--out", "stator"]),
        (&["averaged", "--precision", "f32"], &["simulate.precision", "averaged"]),
        (&["averaged", "--friction", "paper"], &["simulate.friction", "averaged"]),
        (&["averaged", "--drive", "off"], &["no mean motion", "the drive is off"]),
        (
            &["averaged", "--drive", "c", "--amplitude", "0.1"],
            &["no mean motion", "a time constant of -1.1e-3"],
        ),
        (
            &["stator", "--drive", "b", "--set", "motor.mode_b.damping_ratio=0"],
            &["motor.mode_b.damping_ratio = 0"],
        ),
        (&["rotor"], &["simulate.model", "rotor", "motor, stator, averaged"]),
    ];
    for (arguments, words) in cases {
        refuses(folder.path(), &[&["simulate", "--model"], *arguments].concat(), words);
    }
}
