//! The factors of a whole map: of its rates and coasts in both modes, and of its bursts by family.
//!
//! What the prior map says of its motors becomes the prior of the factors ([`super::row_factors`]):
//!
//! | table | spread of the common factor | own deviation of a row |
//! |---|---|---|
//! | rates of a mode | least relative `rate_sd` of its rows | the rest of the row's, and [`RATE_SHAPE`] |
//! | coasts of a mode | [`COAST_SPREAD`] | [`COAST_SHAPE`] |
//! | turns of steps, of walks | that of the middle row | that between bursts of a family |
//! | turns of another family | least relative `motors_sd` of its rows | the rest of the row's, and the same |
//!
//! The factor of steps, and that of walks, may grow with the turn ([`SLOPE_SD`]): in a motor that tilts a short step
//! turns by less than longer ones promise. Steps and walks share one factor in a motor ([`crate::response_map`]), and
//! are related by the map's correlation.

use motor_model::{DriveMode, math};

use super::evidence::CommissioningEvidence;
use super::quantiles;
use super::repeats::Repeats;
use super::row_factors::{Normal, RowFactors, RowMeasured};
use crate::map_correction::MapCorrection;
use crate::response_map::{Burst, Cruise, Family, PerFamily, ResponseMap, direction};

/// Relative variance of a cruise's rate between rows of one motor, beside what the map says. An assumption.
const RATE_SHAPE: f32 = 0.05 * 0.05;
/// Relative variance of the coast per rate over motors: friction differs between motors by a factor of two. An
/// assumption.
const COAST_SPREAD: f32 = 0.3 * 0.3;
/// The same between cruises of one motor. An assumption.
const COAST_SHAPE: f32 = 0.1 * 0.1;
/// Relative variance of the mean rate of a window of 50 ms about the rate of its cruise, before any is measured: the
/// ripple of 0.1 in 150 ms, of parts that are independent after 20 ms. From the model, see `estimator::ConstantRate`.
const WINDOW_RIPPLE: f32 = 3.0 * 0.1 * 0.1;
/// Least part of the map's rate whose ripple is expected. An assumption.
const RIPPLING_PART: f32 = 0.05;
/// Variance of the mean rate over `windows`, in units of the map's; `None` of none. The ripple is expected in
/// proportion to the rate.
pub(super) fn rate_variance(windows: &Repeats) -> Option<f32> {
    let part = windows.mean().abs().clamp(RIPPLING_PART, 1.0);
    Some(WINDOWS_PER_INDEPENDENT * windows.mean_variance(WINDOW_RIPPLE * part * part)?)
}

/// Windows of a run that count as one independent window: neighbours are correlated in mode B, whose rate has a memory
/// of 20 ms. An assumption.
pub(super) const WINDOWS_PER_INDEPENDENT: f32 = 2.0;

/// Standard deviation of the slope of a fine family: by how much the factor of its bursts changes where the map's turn
/// grows e times. It is none in the height-only motors of the map, 0.09 in the tilting motor of `set_f_plant` and 0.17
/// in that of `set_g_plant`. An assumption.
const SLOPE_SD: f32 = 0.1;

/// The factors of a motor's map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MapFactors {
    rates: [RowFactors; 2],
    coasts: [RowFactors; 2],
    turns: PerFamily<RowFactors>,
}

/// Of modes B and C the one of `mode`.
pub(super) fn of_mode<T>([clockwise, counter_clockwise]: &[T; 2], mode: DriveMode) -> &T {
    match mode {
        DriveMode::B => clockwise,
        DriveMode::C => counter_clockwise,
    }
}

/// Relative variance of a cruise's rate over motors.
pub(super) fn rate_spread(cruise: &Cruise) -> f32 {
    let relative = cruise.rate_sd_rad_s / (direction(cruise.mode) * cruise.rate_rad_s);
    relative * relative
}

/// Relative variance of a burst's turn over motors.
pub(super) fn turn_spread(burst: &Burst) -> f32 {
    let relative = burst.motors_sd_rad / burst.turn_rad;
    relative * relative
}

/// Whether a motor has one factor for all bursts of `family`.
pub(super) fn is_fine(family: Family) -> bool {
    matches!(family, Family::Step | Family::Walk)
}

/// Least of `spreads`; 0 of none.
fn least(spreads: impl Iterator<Item = f32>) -> f32 {
    let least = spreads.fold(f32::INFINITY, f32::min);
    if least.is_finite() { least } else { 0.0 }
}

/// A map, and what was measured of a motor in units of its rows.
#[derive(Clone, Copy, Debug)]
pub(super) struct Measured<'a> {
    pub map: &'a ResponseMap,
    pub evidence: &'a CommissioningEvidence,
}

impl Measured<'_> {
    fn cruises(&self, mode: DriveMode) -> impl Iterator<Item = (usize, &Cruise)> + Clone {
        self.map.cruises().iter().enumerate().filter(move |(_, cruise)| cruise.mode == mode)
    }

    fn rate_common(&self, mode: DriveMode) -> f32 {
        least(self.cruises(mode).map(|(_, cruise)| rate_spread(cruise)))
    }

    fn turn_common(&self, family: Family) -> f32 {
        if is_fine(family) {
            self.map.middle(family).map_or(0.0, turn_spread)
        } else {
            least(self.map.bursts(family).iter().map(turn_spread))
        }
    }

    pub(super) fn rate_row(&self, index: usize, cruise: &Cruise) -> RowMeasured {
        let windows = self.evidence.cruise(index).windows;
        let measured = windows
            .mean_variance(WINDOW_RIPPLE)
            .map(|variance| Normal { mean: windows.mean(), variance: WINDOWS_PER_INDEPENDENT * variance });
        let own = (rate_spread(cruise) - self.rate_common(cruise.mode)).max(0.0) + RATE_SHAPE;
        RowMeasured { own, lever: 0.0, measured }
    }

    pub(super) fn coast_row(&self, index: usize, cruise: &Cruise) -> RowMeasured {
        let coasts = self.evidence.cruise(index).coasts;
        let measured = coasts.per_rate_s().and_then(|(coast_s, per)| {
            let coast_rad2 = cruise.coast_sd_rad * cruise.coast_sd_rad + coasts.noise_rad2();
            let relative = 1.0 / cruise.coast_s;
            relative.is_finite().then_some(Normal {
                mean: coast_s * relative,
                variance: coast_rad2 * per * relative * relative,
            })
        });
        RowMeasured { own: COAST_SHAPE, lever: 0.0, measured }
    }

    pub(super) fn turn_row(&self, family: Family, index: usize, burst: &Burst) -> RowMeasured {
        let evidence = self.evidence.burst(family, index);
        let repeat = burst.repeat_sd_rad / burst.turn_rad;
        let expected = repeat * repeat / f32::from(evidence.train.max(1));
        let measured = evidence
            .turns
            .mean_variance(expected)
            .map(|variance| Normal { mean: evidence.turns.mean(), variance });
        let rest = if is_fine(family) { 0.0 } else { turn_spread(burst) - self.turn_common(family) };
        let own = rest.max(0.0) + MapCorrection::shape(family);
        RowMeasured { own, lever: self.slope_lever(family, burst), measured }
    }

    /// What a slope of one standard deviation changes in the factor of a fine burst.
    fn slope_lever(&self, family: Family, burst: &Burst) -> f32 {
        let middle = self.map.middle(family).filter(|_| is_fine(family));
        middle.map_or(0.0, |middle| SLOPE_SD * quantiles::ln(burst.turn_rad / middle.turn_rad))
    }

    fn turns(&self, family: Family) -> RowFactors {
        let rows = self.map.bursts(family).iter().enumerate();
        RowFactors::of(
            self.turn_common(family),
            rows.map(|(index, burst)| self.turn_row(family, index, burst)),
        )
    }

    /// The factors.
    pub(super) fn factors(&self) -> MapFactors {
        let modes = [DriveMode::B, DriveMode::C];
        let rates = modes.map(|mode| {
            let rows = self.cruises(mode).map(|(index, cruise)| self.rate_row(index, cruise));
            RowFactors::of(self.rate_common(mode), rows)
        });
        let coasts = modes.map(|mode| {
            let rows = self.cruises(mode).map(|(index, cruise)| self.coast_row(index, cruise));
            RowFactors::of(COAST_SPREAD, rows)
        });
        let [step, walk, stride, nudge, throw] = Family::ALL.map(|family| self.turns(family));
        let covariance = self.map.step_walk_correlation()
            * math::sqrt_f32(self.turn_common(Family::Step) * self.turn_common(Family::Walk));
        let turns = [step.related(&walk, covariance), walk.related(&step, covariance), stride, nudge, throw];
        MapFactors { rates, coasts, turns: PerFamily::of(turns) }
    }
}

impl MapFactors {
    /// Of the rates of `mode`.
    pub fn rates(&self, mode: DriveMode) -> &RowFactors {
        of_mode(&self.rates, mode)
    }

    /// Of the coasts of `mode`.
    pub fn coasts(&self, mode: DriveMode) -> &RowFactors {
        of_mode(&self.coasts, mode)
    }

    /// Of the turns of `family`.
    pub fn turns(&self, family: Family) -> &RowFactors {
        self.turns.get(family)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::commissioning::coasts::Coast;
    use crate::commissioning::row_factors::SHAPE_FALSE;
    use rand_core::SeedableRng as _;
    use rand_distr::{Distribution as _, StandardNormal};

    /// Over motors a row spreads as the map says, and by the shape: a part is common to its table, the rest its own.
    #[test]
    fn exact_the_common_and_the_own_part_are_the_spread_of_a_row() {
        let map = ResponseMap::table_1();
        let evidence = CommissioningEvidence::default();
        let measured = Measured { map, evidence: &evidence };
        for (index, cruise) in map.cruises().iter().enumerate() {
            let parts = measured.rate_common(cruise.mode) + measured.rate_row(index, cruise).own;
            let whole = rate_spread(cruise) + RATE_SHAPE;
            assert!((parts / whole - 1.0).abs() < 1e-6, "{index}: {parts} {whole}");
        }
    }

    /// Windows that lie apart as is expected of them tell the rate as half as many independent ones would.
    #[test]
    fn exact_two_windows_count_as_one() {
        let map = ResponseMap::table_1();
        let mut evidence = CommissioningEvidence::default();
        let (index, cruise) = (0, &map.cruises()[0]);
        // Of n values at 1 + s and 1 - s the squares are n s^2; the expected variance is that of n - 1 of them.
        let off = math::sqrt_f32(WINDOW_RIPPLE * 7.0 / 8.0);
        for window in 0..8 {
            let rate = 1.0 + if window % 2 == 0 { off } else { -off };
            evidence.add_window(index, cruise, rate * cruise.rate_rad_s * 0.05, 0.0, 0.05);
        }
        let variance =
            Measured { map, evidence: &evidence }.rate_row(index, cruise).measured.unwrap().variance;
        assert!((variance / (WINDOW_RIPPLE / 4.0) - 1.0).abs() < 1e-4, "{variance}");
    }

    /// The coasts of a motor of the prior: two runs of three cruises of `mode`, under a camera whose last frame is
    /// `age_s` old at the cut. Since then the rate is predicted, with a standard deviation of `sigma_rad_s`.
    fn drawn_coasts(
        mode: DriveMode,
        (age_s, sigma_rad_s): (f32, f32),
        mut normal: impl FnMut() -> f32,
    ) -> (f32, CommissioningEvidence) {
        let mut evidence = CommissioningEvidence::default();
        let factor = 1.0 + math::sqrt_f32(COAST_SPREAD) * normal();
        let drives = [0.5_f32, 0.7, 1.0];
        let is_driven = |cruise: &Cruise| drives.iter().any(|at| (cruise.amplitude - at).abs() < 1e-3);
        let of_mode = |(_, cruise): &(usize, &Cruise)| cruise.mode == mode && is_driven(cruise);
        for (index, cruise) in ResponseMap::table_1().cruises().iter().enumerate().filter(of_mode) {
            // The rows of a motor of short coasts differ by less, as the factors have it.
            let own = factor.clamp(0.1, 1.0) * math::sqrt_f32(COAST_SHAPE) * normal();
            let coast_s = cruise.coast_s * (factor + own);
            let rate_rad_s = direction(mode) * cruise.rate_rad_s;
            for _ in 0..2 {
                let error_rad_s = sigma_rad_s * normal();
                let true_rad = coast_s * (rate_rad_s - error_rad_s) + cruise.coast_sd_rad * normal();
                let coast = Coast {
                    rate_rad_s,
                    rate_rad2_s2: sigma_rad_s * sigma_rad_s,
                    turned_rad: true_rad - age_s * error_rad_s,
                    turned_rad2: age_s * age_s * sigma_rad_s * sigma_rad_s,
                    turned_rate_rad2_s: -age_s * sigma_rad_s * sigma_rad_s,
                };
                let coasts = &mut evidence.cruise_mut(index).unwrap().coasts;
                coasts.add(coast.rate_rad_s, coast.turned_rad, coast.noise_rad2(cruise.coast_s));
            }
        }
        (factor, evidence)
    }

    /// Motors of the prior, whose coasts are shown by the default camera and by slow ones, of 200 and 30 frames a
    /// second: no more than [`SHAPE_FALSE`] of them are told to be of another shape, and the factor lies as close to
    /// theirs as its variance says. Both within four standard deviations of what a thousand motors show by chance.
    #[test]
    fn law_the_error_of_the_camera_makes_no_other_motor() {
        let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(1);
        let motors = 1000_u16;
        // The rate fluctuates by this much about its mean; a frame tells it, and it is forgotten within 12 or 2 ms.
        for (mode, sigma_rad_s) in [(DriveMode::B, 4.4), (DriveMode::C, 0.54)] {
            for (age_s, unknown) in [(1e-4, 0.01), (5e-3, 0.7), (4e-2, 1.0)] {
                let (mut others, mut squares) = (0_u16, 0.0);
                for _ in 0..motors {
                    let camera = (age_s, unknown * sigma_rad_s);
                    let (factor, evidence) =
                        drawn_coasts(mode, camera, || StandardNormal.sample(&mut random));
                    let found = Measured { map: ResponseMap::table_1(), evidence: &evidence }.factors();
                    others += u16::from(found.coasts(mode).has_other_shape());
                    let Normal { mean, variance } = found.coasts(mode).common();
                    squares += (mean - factor) * (mean - factor) / variance;
                }
                let motors = f32::from(motors);
                let most = SHAPE_FALSE * motors + 4.0 * math::sqrt_f32(SHAPE_FALSE * motors);
                assert!(f32::from(others) < most, "{mode:?} {age_s}: {others} of {motors}");
                let per_motor = squares / motors;
                let most = 1.0 + 4.0 * math::sqrt_f32(2.0 / motors);
                assert!(per_motor < most, "{mode:?} {age_s}: {per_motor}");
            }
        }
    }
}
