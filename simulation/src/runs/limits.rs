//! The limits that a scene sets, for each task, and what is refused before it begins.
//!
//! | task | travel | time with the drive on | strongest drive |
//! |---|---|---|---|
//! | move | a target outside is refused; the drive is cut at it | of one drive | kept |
//! | rate | a reference that leaves it is refused; the drive is cut a coast before it | added up | kept |
//! | experiments | the drive is cut at it, and they end | any | refused below full drive |
//!
//! A board is told the same ([`Told`]), and keeps to it as the simulation does.

use controller::commissioning::ExperimentTuning;
use controller::rate::{Profile, RateLimits, RateTuning};
use controller::response_map::direction;
use controller::{Limits, Travel};
use estimator::Instruments;
use motor_model::DriveMode;

use crate::math::plain_number::plain;
use crate::scene::keys::limits::{ANY_TIME_S, FREE_DEG};
use crate::scene::{Scene, SceneError};
use crate::world::instruments::assumed;

/// Step in s in which the way of a rate is added up.
const STEP_S: f64 = 1e-3;

/// The angles between which the rotor of `scene` may be driven, in degrees; `None` for any.
fn travel_deg(scene: &Scene) -> Option<(f64, f64)> {
    let limits = (scene.number("limits.least_deg"), scene.number("limits.greatest_deg"));
    (limits != (-FREE_DEG, FREE_DEG)).then_some(limits)
}

fn travel(scene: &Scene) -> Travel {
    travel_deg(scene).map_or(Travel::FREE, |(least_deg, greatest_deg)| {
        Travel::try_new(least_deg, greatest_deg)
            .unwrap_or_else(|_| unreachable!("the bounds of the keys lie on either side of 0"))
    })
}

#[expect(clippy::cast_possible_truncation, reason = "the controller computes in f32")]
fn amplitude_max(scene: &Scene) -> f32 {
    scene.number("limits.amplitude_max") as f32
}

/// Of a move.
pub fn of_move(scene: &Scene) -> Limits {
    Limits {
        amplitude_max: amplitude_max(scene),
        on_max_nanos: scene.nanos("limits.drive_on_s"),
        travel: travel(scene),
        deadline_nanos: scene.nanos("position.deadline_s"),
        ..Limits::default()
    }
}

/// Longest time with the drive on of a rate, in ns, added up; `None` for any.
fn on_max_nanos(scene: &Scene) -> Option<u64> {
    (scene.number("limits.drive_on_total_s") < ANY_TIME_S).then(|| scene.nanos("limits.drive_on_total_s"))
}

/// The tuning of a rate, with its limits.
pub fn rate_tuning(scene: &Scene) -> RateTuning {
    let tuning = RateTuning::new(&assumed(scene));
    let limits = RateLimits { travel: travel(scene), on_max_nanos: on_max_nanos(scene), ..tuning.limits };
    RateTuning { amplitude_max: amplitude_max(scene), limits, ..tuning }
}

/// The tuning of the experiments that commission a motor, with their limits.
pub fn experiment_tuning(scene: &Scene, instruments: &Instruments) -> ExperimentTuning {
    ExperimentTuning::new(instruments).with_limits(travel(scene), amplitude_max(scene))
}

/// What a board is told of the limits of a task.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Told {
    /// Travel in degrees; `None` for any.
    pub travel_deg: Option<(f64, f64)>,
    /// Longest time with the drive on in ns: of one drive of a move, or added up of a rate; `None` for any.
    pub on_max_nanos: Option<u64>,
    /// Strongest drive, 0 to 1.
    pub amplitude_max: Option<f32>,
}

impl Told {
    /// Of the move of `scene`. The deadline is not among them.
    pub fn of_move(scene: &Scene) -> Self {
        Self { on_max_nanos: Some(scene.nanos("limits.drive_on_s")), ..Self::of_experiments(scene) }
    }

    /// Of the rate of `scene`.
    pub fn of_rate(scene: &Scene) -> Self {
        Self { on_max_nanos: on_max_nanos(scene), ..Self::of_experiments(scene) }
    }

    /// Of the experiments on the motor of `scene`, each of which has a time of its own.
    pub fn of_experiments(scene: &Scene) -> Self {
        let amplitude_max = Some(amplitude_max(scene));
        Self { travel_deg: travel_deg(scene), on_max_nanos: None, amplitude_max }
    }
}

/// Refuses an angle that lies outside of the travel: `what`, for example a key with its value, leads there.
fn check_travel(scene: &Scene, what: &str, least_deg: f64, greatest_deg: f64) -> Result<(), SceneError> {
    let (least, greatest) = (scene.number("limits.least_deg"), scene.number("limits.greatest_deg"));
    let (key, limit, reached) = if least_deg < least {
        ("limits.least_deg", least, least_deg)
    } else if greatest_deg > greatest {
        ("limits.greatest_deg", greatest, greatest_deg)
    } else {
        return Ok(());
    };
    Err(SceneError::Conflict {
        conflict: format!("{what} leads to {} deg, beyond {key} = {}", plain(reached), plain(limit)),
        hint: match (least > -FREE_DEG, greatest < FREE_DEG) {
            (true, true) => format!("the travel is {} to {} deg", plain(least), plain(greatest)),
            (true, false) => format!("the travel is {} deg and more", plain(least)),
            _ => format!("the travel is up to {} deg", plain(greatest)),
        },
    })
}

/// Refuses a target of a move outside of the travel.
///
/// # Errors
/// When it is outside.
pub fn check_target(scene: &Scene) -> Result<(), SceneError> {
    let to_deg = scene.number("position.to_deg");
    check_travel(scene, &format!("position.to_deg = {}", plain(to_deg)), to_deg, to_deg)
}

/// Refuses a rate whose reference leaves the travel, or for which no drive is allowed.
///
/// # Errors
/// When it does, or there is none.
pub fn check_rate(scene: &Scene, profile: &Profile) -> Result<(), SceneError> {
    let (rate_deg_s, duration_s) = (scene.number("rate.deg_s"), scene.number("rate.duration_s"));
    check_rate_drive(scene, rate_deg_s)?;
    if travel_deg(scene).is_none() {
        return Ok(());
    }
    let (mut deg, mut least_deg, mut greatest_deg) = (0.0, 0.0_f64, 0.0_f64);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most a million steps")]
    let steps = (duration_s / STEP_S) as u32;
    for step in 0..steps {
        #[expect(clippy::cast_possible_truncation, reason = "the controller computes in f32")]
        let time_s = (f64::from(step) * STEP_S) as f32;
        deg += f64::from(profile.rate_rad_s(time_s)).to_degrees() * STEP_S;
        (least_deg, greatest_deg) = (least_deg.min(deg), greatest_deg.max(deg));
    }
    let tenths = |deg: f64| (10.0 * deg).round() / 10.0;
    let what = format!("rate.deg_s = {} for rate.duration_s = {}", plain(rate_deg_s), plain(duration_s));
    check_travel(scene, &what, tenths(least_deg), tenths(greatest_deg))
}

/// Refuses a rate that no cruise within the strongest drive turns a motor at.
fn check_rate_drive(scene: &Scene, rate_deg_s: f64) -> Result<(), SceneError> {
    let (map, most) = (scene.response_map()?, amplitude_max(scene));
    let mode = if rate_deg_s > 0.0 { DriveMode::B } else { DriveMode::C };
    let weakest = map.cruises_of(mode).first();
    let Some(weakest) = weakest.filter(|weakest| rate_deg_s.abs() > 0.0 && weakest.amplitude > most) else {
        return Ok(());
    };
    let way = if direction(mode) > 0.0 { "clockwise" } else { "counter-clockwise" };
    let least = plain((1e4 * f64::from(weakest.amplitude)).round() / 1e4);
    Err(SceneError::Conflict {
        conflict: format!(
            "no drive up to limits.amplitude_max = {} turns a motor on {way}; the map's weakest is {least}",
            plain(scene.number("limits.amplitude_max"))
        ),
        hint: format!("limits.amplitude_max of {least} to 1"),
    })
}

/// Refuses experiments that drive harder than is allowed.
///
/// # Errors
/// When they do.
pub fn check_experiments(scene: &Scene) -> Result<(), SceneError> {
    let most = scene.number("limits.amplitude_max");
    if most < 1.0 {
        return Err(SceneError::Conflict {
            conflict: format!("limits.amplitude_max = {}: commissioning drives at up to 1", plain(most)),
            hint: "a motor that may not be driven fully is not commissioned".to_owned(),
        });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scene(sets: &[&str]) -> Scene {
        Scene::of_sets(&sets.iter().map(|&set| set.to_owned()).collect::<Vec<_>>()).unwrap()
    }

    fn refused<T>(result: Result<T, SceneError>) -> String {
        result.map_or_else(|error| error.one_line(), |_| "taken".to_owned())
    }

    /// Nothing set is what the controller has by itself; what is set goes to its place.
    #[test]
    fn exact_limits_go_to_their_places() {
        let default = Scene::default();
        let deadline_nanos = default.nanos("position.deadline_s");
        assert_eq!(of_move(&default), Limits { deadline_nanos, ..Limits::default() });
        assert_eq!(rate_tuning(&default), RateTuning::new(&assumed(&default)));
        let experiments = ExperimentTuning::new(&assumed(&default));
        assert_eq!(experiment_tuning(&default, &assumed(&default)), experiments);
        let any = Told { travel_deg: None, on_max_nanos: None, amplitude_max: Some(1.0) };
        assert_eq!((Told::of_rate(&default), Told::of_experiments(&default)), (any, any));
        assert_eq!(
            Told::of_move(&default),
            Told { on_max_nanos: Some(Limits::default().on_max_nanos), ..any }
        );
        let set = scene(&[
            "limits.least_deg=-90",
            "limits.greatest_deg=180",
            "limits.drive_on_s=2",
            "limits.drive_on_total_s=3",
            "limits.amplitude_max=0.5",
        ]);
        let travel = Travel::try_new(-90.0, 180.0).unwrap();
        let moves = of_move(&set);
        assert_eq!((moves.travel, moves.on_max_nanos, moves.amplitude_max), (travel, 2_000_000_000, 0.5));
        let RateTuning { amplitude_max, limits, .. } = rate_tuning(&set);
        assert_eq!((limits.travel, limits.on_max_nanos, amplitude_max), (travel, Some(3_000_000_000), 0.5));
        assert_eq!(experiment_tuning(&set, &assumed(&set)), experiments.with_limits(travel, 0.5));
        let told = Told { travel_deg: Some((-90.0, 180.0)), on_max_nanos: None, amplitude_max: Some(0.5) };
        assert_eq!(Told::of_experiments(&set), told);
        assert_eq!(Told::of_move(&set), Told { on_max_nanos: Some(2_000_000_000), ..told });
        assert_eq!(Told::of_rate(&set), Told { on_max_nanos: Some(3_000_000_000), ..told });
        let one_sided = Told::of_move(&scene(&["limits.greatest_deg=180"])).travel_deg;
        assert_eq!(one_sided, Some((-FREE_DEG, 180.0)));
    }

    /// A rate of 100 deg/s leads to 200 degrees in 2 s, one both ways there and back.
    #[test]
    fn exact_what_leaves_the_travel_is_refused_by_key_value_and_bounds() {
        let rate = |sets: &[&str]| {
            let scene = scene(sets);
            refused(check_rate(&scene, &crate::runs::rate::profile(&scene).unwrap()))
        };
        let asked = ["rate.deg_s=100", "rate.duration_s=2", "limits.greatest_deg=199"];
        let text = rate(&asked);
        assert!(
            text.contains("rate.deg_s = 100 for rate.duration_s = 2 leads to 200 deg")
                && text.contains("limits.greatest_deg = 199"),
            "{text}"
        );
        assert_eq!(rate(&["rate.deg_s=100", "rate.duration_s=2", "limits.greatest_deg=201"]), "taken");
        let back = ["rate.deg_s=-100", "rate.duration_s=2", "limits.least_deg=-199"];
        assert!(rate(&back).contains("limits.least_deg = -199"), "{}", rate(&back));
        let weak = rate(&["rate.deg_s=100", "limits.amplitude_max=0.2"]);
        assert!(weak.contains("limits.amplitude_max = 0.2") && weak.contains("0.3"), "{weak}");
        let target = refused(check_target(&scene(&["position.to_deg=90", "limits.greatest_deg=80"])));
        assert!(target.contains("position.to_deg = 90") && target.contains("= 80"), "{target}");
        for (sets, travel) in [
            (&["limits.greatest_deg=80"][..], "up to 80 deg"),
            (&["limits.least_deg=-10", "limits.greatest_deg=80"], "-10 to 80 deg"),
        ] {
            let target = refused(check_target(&scene(&[&["position.to_deg=90"], sets].concat())));
            assert!(target.ends_with(&format!("the travel is {travel}")), "{target}");
        }
        let target = refused(check_target(&scene(&["position.to_deg=-90", "limits.least_deg=-80"])));
        assert!(target.ends_with("the travel is -80 deg and more"), "{target}");
        assert_eq!(refused(check_target(&scene(&["position.to_deg=80", "limits.greatest_deg=80"]))), "taken");
    }

    #[test]
    fn exact_experiments_below_full_drive_are_refused() {
        for set in ["limits.least_deg=-180", "limits.greatest_deg=180", "limits.amplitude_max=1"] {
            assert_eq!(refused(check_experiments(&scene(&[set]))), "taken");
        }
        let text = refused(check_experiments(&scene(&["limits.amplitude_max=0.9"])));
        assert!(text.contains("limits.amplitude_max = 0.9"), "{text}");
    }
}
