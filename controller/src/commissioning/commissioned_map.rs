//! The map of one motor: the prior map, corrected by what was measured.
//!
//! Each row is the prior row times its factor. The spread over motors becomes how well this motor's factor is known:
//! `sd' = sd sqrt(variance after / variance before)`, at least [`KNOWN_AT_BEST`] of the row. The spread from repeat to
//! repeat keeps the prior's part of the turn, times the scale that the repeats of the table support ([`spread_scale`]).
//!
//! A row is left out that turns the rotor by no more than it is known to, or by no more than the row before it: the
//! rules of [`ResponseMap::try_new`]. So is one that loses the estimate most of the time. A table of which nothing was
//! measured is the prior's, bit by bit. A mode that is dead, or turns the rotor the other way, has no rows.
//!
//! Without mode B, or with a slow one, a rotor that comes to rest beyond its target is not turned back. So mode C then
//! has no strides, whose turn one motor repeats to 15 %, and its coasts are longer by [`LONG_COAST_SIGMAS`] standard
//! deviations: few are longer still.

use motor_model::{DriveMode, math};

use super::coasts::{CoastScatter, scatter_scale};
use super::evidence::CommissioningEvidence;
use super::findings::Findings;
use super::map_factors::{MapFactors, Measured, rate_spread, turn_spread};
use super::quantiles;
use super::repeats::EXPECTED_REPEATS;
use super::row_factors::Normal;
use crate::response_map::{Burst, Cruise, Family, MapError, ResponseMap, direction};

/// Smallest standard deviation of a factor: a motor's turns and rates drift by a hundredth. An assumption.
const KNOWN_AT_BEST: f32 = 0.01;
/// Probability below which a spread is smaller than the repeats show, where it is taken to be.
const SHRINK_FALSE: f32 = 0.05;
/// Standard deviations of a coast by which it is taken to be longer where nothing turns the rotor back: one coast in
/// 700 is longer still.
const LONG_COAST_SIGMAS: f32 = 3.0;

/// Standard deviation per prior one of repeats whose squares, each in units of its expected variance, sum up to
/// `squares` with `freedom` degrees of freedom.
///
/// The variance is that of [`super::repeats`]. It shrinks no further than to its upper 95 % limit, `squares` over the
/// 5 % point of chi-square: three repeats that agree by chance do not make a motor that repeats well.
pub(super) fn spread_scale(squares: f32, freedom: f32) -> f32 {
    if freedom < 1.0 {
        return 1.0;
    }
    let variance = (EXPECTED_REPEATS + squares) / (EXPECTED_REPEATS + freedom);
    if variance >= 1.0 {
        return math::sqrt_f32(variance);
    }
    let upper = squares / quantiles::chi_square(freedom, 1.0 - SHRINK_FALSE).max(f32::MIN_POSITIVE);
    math::sqrt_f32(upper.min(1.0).max(variance))
}

/// `sd` of a row of that `magnitude`, when the variance of its factor goes from `before` to `after`.
fn known(sd: f32, magnitude: f32, before: f32, after: f32) -> f32 {
    let part = if before > 0.0 { math::sqrt_f32(after / before) } else { 1.0 };
    (sd * part).max(KNOWN_AT_BEST * magnitude)
}

/// The map of the motor whose `evidence` was measured in units of the rows of `prior`.
///
/// # Errors
/// When what is left breaks a rule of maps; the rows are made so that it does not.
pub fn commissioned_map(
    prior: &ResponseMap,
    evidence: &CommissioningEvidence,
) -> Result<ResponseMap, MapError> {
    let measured = Measured { map: prior, evidence };
    let factors = measured.factors();
    let findings = Findings::of(prior, evidence);
    let turns_back = findings.is_fast(DriveMode::B);
    let mut map = ResponseMap::without_rows(*prior.design());
    for mode in [DriveMode::B, DriveMode::C].into_iter().filter(|mode| findings.is_of_use(*mode)) {
        let cruises = prior.cruises().iter().enumerate().filter(|(_, cruise)| cruise.mode == mode);
        let scale = coast_scale(&measured, &factors, mode);
        let mut before_rad_s = 0.0;
        for (index, cruise) in cruises.filter(|(index, _)| !evidence.cruise(*index).is_lost()) {
            let row = if factors.rates(mode).measured() == 0 && factors.coasts(mode).measured() == 0 {
                *cruise
            } else {
                corrected_cruise(&measured, &factors, index, cruise, scale)
            };
            let rate_rad_s = direction(mode) * row.rate_rad_s;
            if rate_rad_s > row.rate_sd_rad_s && rate_rad_s > before_rad_s {
                before_rad_s = rate_rad_s;
                map.append_cruises(&[if turns_back { row } else { with_long_coast(row) }])?;
            }
        }
    }
    let is_driven =
        |family: &Family| findings.is_of_use(family.mode()) && (turns_back || *family != Family::Stride);
    for family in Family::ALL.into_iter().filter(is_driven) {
        let is_prior = factors.turns(family).measured() == 0
            && related(family).is_none_or(|related| factors.turns(related).measured() == 0);
        let scale = turn_scale(&measured, &factors, family);
        let mut before_rad = 0.0;
        for (index, burst) in prior.bursts(family).iter().enumerate() {
            let row = if is_prior {
                *burst
            } else {
                corrected_burst(&measured, &factors, family, index, burst, scale)
            };
            let is_lost = evidence.burst(family, index).is_lost();
            if !is_lost && row.turn_rad > row.motors_sd_rad && row.turn_rad > before_rad {
                before_rad = row.turn_rad;
                map.append_bursts(family, &[row])?;
            }
        }
    }
    map.complete(prior.step_walk_correlation())?;
    Ok(map)
}

/// The same cruise with a coast that one in 700 exceeds.
fn with_long_coast(cruise: Cruise) -> Cruise {
    let longer_s = LONG_COAST_SIGMAS * cruise.coast_sd_rad / cruise.rate_rad_s.abs();
    Cruise { coast_s: cruise.coast_s + longer_s, ..cruise }
}

/// The family whose factor tells that of `family`.
fn related(family: Family) -> Option<Family> {
    match family {
        Family::Step => Some(Family::Walk),
        Family::Walk => Some(Family::Step),
        Family::Stride | Family::Nudge | Family::Throw => None,
    }
}

fn corrected_cruise(
    measured: &Measured<'_>,
    factors: &MapFactors,
    index: usize,
    cruise: &Cruise,
    coast_scale: f32,
) -> Cruise {
    let row = measured.rate_row(index, cruise);
    let Normal { mean, variance } = factors.rates(cruise.mode).row(&row);
    let coast = factors.coasts(cruise.mode).row(&measured.coast_row(index, cruise));
    let coast_mean = coast.mean.max(0.0);
    let rate_rad_s = cruise.rate_rad_s * mean;
    let slower = mean.clamp(0.0, 1.0);
    Cruise {
        rate_rad_s,
        rate_sd_rad_s: known(
            cruise.rate_sd_rad_s,
            cruise.rate_rad_s.abs() * mean.abs(),
            rate_spread(cruise),
            variance,
        ),
        coast_s: cruise.coast_s * coast_mean,
        coast_sd_rad: cruise.coast_sd_rad * coast_scale * slower,
        ..*cruise
    }
}

fn corrected_burst(
    measured: &Measured<'_>,
    factors: &MapFactors,
    family: Family,
    index: usize,
    burst: &Burst,
    repeat_scale: f32,
) -> Burst {
    let Normal { mean, variance } = factors.turns(family).row(&measured.turn_row(family, index, burst));
    let turn_rad = burst.turn_rad * mean;
    // A row that scatters more than its family is believed; one without repeats tells nothing.
    let (squares, freedom) = turn_squares(measured, factors, family, (index, burst));
    let scale = if freedom < 1.0 { repeat_scale } else { repeat_scale.max(spread_scale(squares, freedom)) };
    Burst {
        turn_rad,
        motors_sd_rad: known(burst.motors_sd_rad, burst.turn_rad * mean.abs(), turn_spread(burst), variance),
        repeat_sd_rad: burst.repeat_sd_rad * mean.abs() * scale,
        ..*burst
    }
}

/// Squares of the turns of a row, each in units of its expected variance, and their degrees of freedom.
fn turn_squares(
    measured: &Measured<'_>,
    factors: &MapFactors,
    family: Family,
    (index, burst): (usize, &Burst),
) -> (f32, f32) {
    let evidence = measured.evidence.burst(family, index);
    let turns = evidence.turns;
    let factor = factors.turns(family).row(&measured.turn_row(family, index, burst)).mean;
    let repeat = factor * burst.repeat_sd_rad / burst.turn_rad;
    let expected = repeat * repeat / f32::from(evidence.train.max(1)) + turns.noise();
    let squares = if expected > 0.0 { turns.squares() / expected } else { 0.0 };
    (squares, turns.freedom())
}

/// Scale of the spread of the turns of `family`.
fn turn_scale(measured: &Measured<'_>, factors: &MapFactors, family: Family) -> f32 {
    let rows = measured.map.bursts(family).iter().enumerate();
    let (squares, freedom) = rows.fold((0.0, 0.0), |(squares, freedom), row| {
        let (own, own_freedom) = turn_squares(measured, factors, family, row);
        (squares + own, freedom + own_freedom)
    });
    spread_scale(squares, freedom)
}

/// Scale of the spread of the coasts of `mode`: see [`super::coasts`].
fn coast_scale(measured: &Measured<'_>, factors: &MapFactors, mode: DriveMode) -> f32 {
    let rows = measured.map.cruises().iter().enumerate().filter(|(_, cruise)| cruise.mode == mode);
    let scatters = rows.map(|(index, cruise)| {
        let coasts = measured.evidence.cruise(index).coasts;
        let slower = factors.rates(mode).row(&measured.rate_row(index, cruise)).mean.clamp(0.0, 1.0);
        let factor = factors.coasts(mode).row(&measured.coast_row(index, cruise)).mean.max(0.0);
        CoastScatter {
            own_rad2: cruise.coast_sd_rad * cruise.coast_sd_rad * slower * slower,
            noise_rad2: coasts.noise_rad2(),
            squares_rad2: coasts.squares_rad2(cruise.coast_s * factor),
            count: f32::from(coasts.count()),
        }
    });
    scatter_scale(&scatters.filter(|row| row.own_rad2 > 0.0 && row.count > 0.0).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map() -> &'static ResponseMap {
        ResponseMap::table_1()
    }

    #[test]
    fn exact_nothing_measured_is_the_prior_bit_by_bit() {
        let found = commissioned_map(map(), &CommissioningEvidence::default()).unwrap();
        assert_eq!(found, *map());
    }

    /// A family of which a short and a long row turn by 0.7, and what is related to it; all else stays.
    #[test]
    fn law_a_measured_family_is_scaled_and_its_related_one_follows() {
        let mut evidence = CommissioningEvidence::default();
        for index in [3, 12] {
            let burst = evidence.burst_mut(Family::Step, index).unwrap();
            burst.train = 4;
            (0..4).for_each(|_| burst.turns.add(0.7, 1e-5));
        }
        let found = commissioned_map(map(), &evidence).unwrap();
        for (mine, prior) in found.bursts(Family::Step).iter().zip(map().bursts(Family::Step)) {
            assert!((mine.turn_rad / prior.turn_rad - 0.7).abs() < 0.03, "{mine:?}");
            assert!(mine.motors_sd_rad < 0.4 * prior.motors_sd_rad, "{mine:?} {prior:?}");
        }
        let walk = found.bursts(Family::Walk)[0].turn_rad / map().bursts(Family::Walk)[0].turn_rad;
        assert!((0.7..0.85).contains(&walk), "{walk}");
        for family in [Family::Stride, Family::Nudge, Family::Throw] {
            assert_eq!(found.bursts(family), map().bursts(family));
        }
        assert_eq!(found.cruises(), map().cruises());
    }

    /// A motor like that of set G: its steps turn by 0.42 of the map's in the middle row, and by e^0.17 more where the
    /// map's turn is e times as long. Rows that were not measured are on this line, within two of the standard
    /// deviations that are stated, and within a quarter of their turn: half of what one factor for all of them would
    /// be off in the shortest.
    #[test]
    fn law_steps_that_turn_by_less_the_shorter_they_are() {
        let steps = map().bursts(Family::Step);
        let middle = map().middle(Family::Step).unwrap().turn_rad;
        let factor = |turn_rad: f32| 0.42 * (turn_rad / middle).powf(0.17);
        let mut evidence = CommissioningEvidence::default();
        for index in [3, 7, 10] {
            let burst = evidence.burst_mut(Family::Step, index).unwrap();
            burst.train = 4;
            (0..4).for_each(|_| burst.turns.add(factor(steps[index].turn_rad), 1e-5));
        }
        let found = commissioned_map(map(), &evidence).unwrap();
        for (mine, prior) in found.bursts(Family::Step).iter().zip(steps) {
            let off_rad = mine.turn_rad - factor(prior.turn_rad) * prior.turn_rad;
            let bound_rad = (2.0 * mine.motors_sd_rad).min(0.25 * factor(prior.turn_rad) * prior.turn_rad);
            assert!(off_rad.abs() < bound_rad, "{mine:?} {prior:?}");
        }
    }

    /// What the strongest cruise of `dead` shows of a mode that turns nothing.
    fn dead(dead: DriveMode) -> CommissioningEvidence {
        let mut evidence = CommissioningEvidence::default();
        let strongest = map().cruises().iter().enumerate().rfind(|(_, cruise)| cruise.mode == dead);
        let (index, cruise) = strongest.unwrap();
        (0..16).for_each(|_| evidence.add_window(index, cruise, 0.0, 1e-8, 0.05));
        evidence
    }

    /// A mode that is dead has neither cruises nor bursts, of which none was measured.
    #[test]
    fn law_a_dead_mode_has_no_rows() {
        for mode in [DriveMode::B, DriveMode::C] {
            let found = commissioned_map(map(), &dead(mode)).unwrap();
            assert_eq!(found.cruises_of(mode), []);
            for family in Family::ALL {
                let is_driven = family.mode() != mode && (mode == DriveMode::C || family != Family::Stride);
                let expected = if is_driven { map().bursts(family) } else { &[] };
                assert_eq!(found.bursts(family), expected, "{mode:?} {family:?}");
            }
        }
    }

    /// Without mode B the coast is longer by three standard deviations of it; with mode B it is the prior's.
    #[test]
    fn exact_without_mode_b_coasts_are_long() {
        let found = commissioned_map(map(), &dead(DriveMode::B)).unwrap();
        let (mine, prior) = (found.cruises_of(DriveMode::C), map().cruises_of(DriveMode::C));
        assert_eq!(mine.len(), prior.len());
        for (mine, prior) in mine.iter().zip(prior) {
            let longer_rad = (mine.coast_s - prior.coast_s) * prior.rate_rad_s.abs();
            assert!((longer_rad / prior.coast_sd_rad - 3.0).abs() < 1e-3, "{mine:?} {prior:?}");
        }
        let other = commissioned_map(map(), &dead(DriveMode::C)).unwrap();
        assert_eq!(other.cruises_of(DriveMode::B), map().cruises_of(DriveMode::B));
    }

    /// Fastest at half drive: the faster drives of the map are left out, since they turn more slowly.
    #[test]
    fn law_drives_beyond_the_fastest_are_left_out() {
        let mut evidence = CommissioningEvidence::default();
        for ((index, cruise), rate_rad_s) in
            map().cruises().iter().enumerate().zip([2.5, 2.8, 3.0, 2.2, 1.5, 1.3, 1.1, 0.9])
        {
            let turned_rad = 0.05 * rate_rad_s;
            (0..32).for_each(|_| evidence.add_window(index, cruise, turned_rad, 1e-8, 0.05));
        }
        let found = commissioned_map(map(), &evidence).unwrap();
        let strongest = found.strongest_cruise(DriveMode::B, 1.0).unwrap();
        assert!((strongest.amplitude - 0.5).abs() < 1e-6, "{strongest:?}");
        assert!((strongest.rate_rad_s - 3.0).abs() < 0.2, "{strongest:?}");
    }

    /// The camera's error of a coast counts in the scale of the spread: coasts that lie apart by ten times the spread
    /// of the map grow it where the camera is exact, and do not where its error is of that size.
    #[test]
    fn exact_the_scatter_of_the_camera_is_no_spread_of_the_motor() {
        let (index, cruise) = (7, &map().cruises()[7]);
        let scale = |noise: f32| {
            let mut evidence = CommissioningEvidence::default();
            for run in 0..8 {
                let off_rad = 10.0 * cruise.coast_sd_rad * if run % 2 == 0 { 1.0 } else { -1.0 };
                let coast_rad = cruise.coast_s * cruise.rate_rad_s + off_rad;
                let noise_rad2 = (noise * cruise.coast_sd_rad).powi(2);
                evidence.cruise_mut(index).unwrap().coasts.add(cruise.rate_rad_s, coast_rad, noise_rad2);
            }
            let measured = Measured { map: map(), evidence: &evidence };
            coast_scale(&measured, &measured.factors(), DriveMode::B)
        };
        assert!(scale(0.0) > 5.0 && scale(10.0) < 1.1, "{} {}", scale(0.0), scale(10.0));
    }

    /// Spreads grow with what was seen and shrink only as far as the number of repeats supports: of 3 degrees of
    /// freedom with a tenth of the squares the upper limit is 0.3 / 0.352, of 30 it is 3 / 18.49. Wilson and Hilferty's
    /// quantile is 7 % low for 3 degrees of freedom.
    #[test]
    fn exact_spreads_shrink_no_further_than_repeats_support() {
        assert!((spread_scale(0.0, 0.0) - 1.0).abs() < f32::EPSILON);
        assert!((spread_scale(0.3, 3.0).powi(2) / (0.3 / 0.352) - 1.0).abs() < 0.08);
        assert!((spread_scale(3.0, 30.0).powi(2) / (7.0 / 34.0) - 1.0).abs() < 0.02);
        assert!((spread_scale(30.0, 3.0).powi(2) / (34.0 / 7.0) - 1.0).abs() < 1e-4);
    }
}
