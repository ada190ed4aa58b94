//! The identified map as the controller takes it, and the map of a scene's design.

use controller::ResponseMap;
use controller::response_map::{Burst, Cruise, Family, MapError, RAD_PER_MDEG, direction};
use motor_model::MotorParams;

use super::{IdentifiedResponseMap, ResponseMapCampaign};
use simulation::runs::RunError;
use simulation::scene::{Scene, SceneError};

/// Motors of a map that is made for one run: means are known to a quarter of the spread over motors, and the spread to
/// a fifth of itself.
const MOTORS_FOR_A_RUN: u64 = 16;

impl IdentifiedResponseMap {
    /// The map, in four significant digits.
    ///
    /// A row is left out that turns the rotor by no more than its spread over motors, or by no more than the row before
    /// it. Steps and walks end before the first row that one motor does not repeat far better than motors agree.
    ///
    /// # Errors
    /// When what is left breaks a rule of maps: then the motors of the design are of no use.
    pub fn value(&self) -> Result<ResponseMap, MapError> {
        let mut cruises: Vec<Cruise> = Vec::new();
        for row in &self.cruises {
            let rate = direction(row.mode) * rounded(row.rate_rad_s);
            let sd = rounded(row.rate_sd_rad_s);
            let before = cruises.iter().rfind(|cruise| cruise.mode == row.mode);
            let slowest = before.map_or(0.0, |before| direction(row.mode) * before.rate_rad_s);
            if rate > sd && rate > slowest {
                cruises.push(Cruise {
                    mode: row.mode,
                    amplitude: row.amplitude,
                    rate_rad_s: rounded(row.rate_rad_s),
                    rate_sd_rad_s: sd,
                    coast_s: rounded(row.coast_s).max(0.0),
                    coast_sd_rad: rounded(row.coast_sd_mdeg) * RAD_PER_MDEG,
                });
            }
        }
        let families = Family::ALL.map(|family| self.family(family));
        let [step, walk, stride, nudge, throw] = &families;
        let correlation = format!("{:.2}", self.step_walk_correlation).parse().unwrap_or(0.0);
        ResponseMap::try_new(self.design, &cruises, [step, walk, stride, nudge, throw], correlation)
    }

    fn family(&self, family: Family) -> Vec<Burst> {
        let along = f64::from(direction(family.mode()));
        let is_fine = matches!(family, Family::Step | Family::Walk);
        let mut bursts: Vec<Burst> = Vec::new();
        for row in self.bursts.get(family as usize).into_iter().flatten() {
            let [turn, motors, repeat] =
                [along * row.turn_mdeg, row.motors_mdeg, row.repeat_mdeg].map(rounded);
            let shortest = bursts.last().map_or(0.0, |before| before.turn_rad);
            let turn_rad = turn * RAD_PER_MDEG;
            let turns = turn > motors && turn_rad > shortest;
            if turns && is_fine && !row.is_fine() {
                break;
            }
            if turns {
                bursts.push(Burst {
                    amplitude: row.amplitude,
                    ticks: row.ticks,
                    turn_rad,
                    motors_sd_rad: motors * RAD_PER_MDEG,
                    repeat_sd_rad: repeat * RAD_PER_MDEG,
                });
            }
        }
        bursts
    }
}

/// The map of the design of `scene`, identified for a run of it: seconds. `progress` as in the study.
///
/// What the scene says of the true motor does not count.
///
/// # Errors
/// When the model refuses the design, or its motors are of no use.
pub fn of_design(
    scene: &Scene,
    progress: &(impl Fn(u64) + Sync),
    start: impl FnOnce(u64),
) -> Result<ResponseMap, RunError> {
    let mut design = Scene::default();
    for (parameter, value) in scene.motor_overrides() {
        design.set(parameter.spec().key, &value.to_string())?;
    }
    let campaign = ResponseMapCampaign::new(&design, MOTORS_FOR_A_RUN)?;
    start(campaign.work());
    Ok(campaign.run(progress).value().map_err(|source| SceneError::NoResponseMap { source })?)
}

/// Whether the design of `scene` is that of Table 1, whose map is compiled in.
pub fn is_table_1(scene: &Scene) -> bool {
    scene.motor_params() == MotorParams::nominal()
}

/// `value` with four significant digits.
pub fn rounded(value: f64) -> f32 {
    format!("{value:.3e}").parse().unwrap_or_default()
}
