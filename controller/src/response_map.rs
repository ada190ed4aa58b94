//! The response map: what the rotor does under each drive. Positioning and rate control plan by it.
//!
//! A [`ResponseMap`] is a value. It is identified from motors drawn around a design (`host-sim response-map` prints and
//! writes it) and holds for that design only. [`ResponseMap::table_1`] is that of Table 1, compiled in. A map has two
//! kinds of drive:
//!
//! - a [`Cruise`] stays on until it is cut: mean rate, and the coast, which is proportional to the rate at the cut;
//! - a [`Burst`] of whole ticks starts and ends at rest: how far it turns the rotor, how much that differs from motor
//!   to motor, and how much in one motor from burst to burst.
//!
//! # What the bursts do, in the map of Table 1
//!
//! | family | drive | turns by | one motor repeats it to |
//! |---|---|---|---|
//! | [`Family::Step`] | mode C, two cycles, amplitude 0.05 to 1 | -0.15 to -6.5 mdeg | 1 % |
//! | [`Family::Walk`] | mode C, amplitude 0.3, 5 to 640 cycles | -4 to -140 mdeg | 1 % |
//! | [`Family::Stride`] | mode C, full, 10 to 640 cycles | -80 mdeg to -7 deg | 15 % |
//! | [`Family::Nudge`] | mode B, one cycle, amplitude 0.2 to 1 | 1 to 26 mdeg | 20 to 30 % |
//! | [`Family::Throw`] | mode B, full, 2 to 130 cycles | 90 mdeg to 18 deg | 30 % |
//!
//! In steps and walks the rotor never leaves the teeth for long, so that no chaotic sequence of impacts arises. Motors
//! differ by one factor (20 %), nearly the same for both families, which the first burst measures
//! ([`crate::map_correction`]). So the last approach to a target is always by these, counter-clockwise.

mod check;
mod drives;
mod family;
mod half_widths;
mod rows;
mod table;

use core::f32::consts::PI;

use estimator::ResonanceOffset;
use motor_model::{DriveMode, MotorParams};

use crate::map_correction::{LearntFactors, MapCorrection};

pub use check::{MapError, MapField, MapPlace};
pub use drives::{Burst, Cruise, RAD_PER_MDEG, direction};
use drives::{burst, cruise};
pub use family::Family;
pub(crate) use family::PerFamily;
use half_widths::half_widths_hz;
use rows::Rows;

/// Most cruises of a map, both modes together.
pub const CRUISES_MAX: usize = 16;
/// Most bursts of a family.
pub const BURSTS_MAX: usize = 16;

/// The response map of a design: about 2.3 kB.
///
/// It is passed by reference: a microcontroller reads the map of Table 1 from flash, and another one from where it was
/// received.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ResponseMap {
    design: MotorParams,
    /// Mode B, then mode C, each weakest first.
    cruises: Rows<Cruise, CRUISES_MAX>,
    /// How many of them are of mode B.
    clockwise_cruises: usize,
    /// Shortest turn first.
    bursts: PerFamily<Rows<Burst, BURSTS_MAX>>,
    step_walk_correlation: f32,
    /// Distances in rad from which cruises of modes B and C are driven.
    cruise_from_rad: [f32; 2],
    /// Distance in rad from which strides are driven.
    stride_from_rad: f32,
    /// How one motor differs, as its moves have learnt it.
    correction: Option<MapCorrection>,
    /// Where the resonances of modes B and C are, from the design's.
    resonances: [ResonanceOffset<f32>; 2],
    /// Half widths of the design's resonances: kept, since a microcontroller computes them in double precision by
    /// software.
    half_widths_hz: [f32; 2],
}

/// Distances from which the motors of Table 1 are driven by cruises of modes B and C: the weakest cruise B of use
/// coasts for a degree; twice what the weakest cruise C of use needs to coast.
const CRUISE_FROM_RAD: [f32; 2] = [degrees(2.0), degrees(0.15)];
/// Distance from which the motors of Table 1 are driven by strides: between the shortest stride, 0.084 degrees, and the
/// longest walk, 0.13.
const STRIDE_FROM_RAD: f32 = degrees(0.11);

/// How many of the first of `cruises` are of mode B.
// Never inlined: in another crate it would be compiled for speed, also for the smallest board.
#[inline(never)]
const fn clockwise(cruises: &[Cruise]) -> usize {
    let mut count = 0;
    let mut rest = cruises;
    while let [Cruise { mode: DriveMode::B, .. }, after @ ..] = rest {
        count += 1;
        rest = after;
    }
    count
}

const fn degrees(deg: f32) -> f32 {
    deg * (PI / 180.0)
}

impl Default for ResponseMap {
    /// That of Table 1.
    fn default() -> Self {
        *Self::table_1()
    }
}

static TABLE_1: ResponseMap = ResponseMap {
    design: MotorParams::nominal(),
    cruises: cruise_rows(&table::CRUISES),
    clockwise_cruises: clockwise(&table::CRUISES),
    bursts: {
        let [step, walk, stride, nudge, throw] = table::BURSTS_OF;
        PerFamily::of([
            burst_rows(step),
            burst_rows(walk),
            burst_rows(stride),
            burst_rows(nudge),
            burst_rows(throw),
        ])
    },
    step_walk_correlation: table::STEP_WALK_CORRELATION,
    cruise_from_rad: CRUISE_FROM_RAD,
    stride_from_rad: STRIDE_FROM_RAD,
    correction: None,
    resonances: [ResonanceOffset::NONE; 2],
    half_widths_hz: half_widths_hz(&MotorParams::nominal()),
};

impl ResponseMap {
    /// The map of motors drawn around Table 1, compiled in.
    pub fn table_1() -> &'static Self {
        &TABLE_1
    }

    /// The design whose motors it describes.
    pub fn design(&self) -> &MotorParams {
        &self.design
    }

    /// The cruises of both modes, each weakest first.
    pub fn cruises(&self) -> &[Cruise] {
        self.cruises.as_slice()
    }

    /// The cruises of `mode`, weakest first.
    pub fn cruises_of(&self, mode: DriveMode) -> &[Cruise] {
        let cruises = self.cruises();
        let (clockwise, counter_clockwise) =
            cruises.split_at_checked(self.clockwise_cruises).unwrap_or((cruises, &[]));
        match mode {
            DriveMode::B => clockwise,
            DriveMode::C => counter_clockwise,
        }
    }

    /// The bursts of `family`, shortest turn first.
    pub fn bursts(&self, family: Family) -> &[Burst] {
        self.bursts.get(family).as_slice()
    }

    /// The burst in the middle of `family`, whose spread stands for the family's; `None` if it has no bursts.
    pub fn middle(&self, family: Family) -> Option<&Burst> {
        let bursts = self.bursts(family);
        bursts.get(bursts.len() / 2)
    }

    /// Correlation over motors of the turns by a step and by a walk, -1 to 1.
    pub fn step_walk_correlation(&self) -> f32 {
        self.step_walk_correlation
    }

    /// What moves of one motor have learnt of it; `None` of a map for all motors of its design.
    pub fn learnt(&self) -> Option<LearntFactors> {
        self.correction().map(|correction| LearntFactors::new(correction, self.resonances))
    }

    /// The same map for the motor of which moves have learnt `factors`. Positioning begins with them.
    ///
    /// # Errors
    /// When a factor is outside of its bounds, or not finite.
    pub fn with_learnt(&self, factors: LearntFactors) -> Result<Self, MapError> {
        let mut map = *self;
        map.set_learnt(factors)?;
        Ok(map)
    }

    /// The same in place: on a microcontroller a copy of the map takes too much of the stack.
    ///
    /// # Errors
    /// As [`Self::with_learnt`]; the map is then as before.
    pub fn set_learnt(&mut self, factors: LearntFactors) -> Result<(), MapError> {
        self.correction = Some(factors.try_into()?);
        self.resonances = factors.resonances;
        Ok(())
    }

    /// The offsets of the resonances of modes B and C from the design's: zero where nothing was learnt.
    pub fn resonances(&self) -> &[ResonanceOffset<f32>; 2] {
        &self.resonances
    }

    /// Half widths of the design's resonances of modes B and C, in Hz.
    pub(crate) fn half_widths_hz(&self) -> [f32; 2] {
        self.half_widths_hz
    }

    pub(crate) fn correction(&self) -> Option<&MapCorrection> {
        self.correction.as_ref()
    }

    /// Sets distances that are to its cruises and walks as those of Table 1 are to its own: the room of the weakest
    /// cruise of use, the turn of the longest walk. Without cruises, or without strides, they are infinite.
    // Never inlined: as above.
    #[inline(never)]
    fn find_distances(&mut self) {
        let room_rad = |map: &Self, mode| {
            let weakest = map.cruise_within(mode, 1.0, 0.0).or_else(|| map.strongest_cruise(mode, 1.0));
            weakest.map(|cruise| cruise.room_rad())
        };
        let [clockwise, counter_clockwise] = CRUISE_FROM_RAD;
        self.cruise_from_rad =
            [(DriveMode::B, clockwise), (DriveMode::C, counter_clockwise)].map(|(mode, from)| {
                scaled(from, room_rad(self, mode), room_rad(&TABLE_1, mode)).unwrap_or(f32::INFINITY)
            });
        let longest_rad = |map: &Self| map.range_rad(Family::Walk, 1.0).map(|(_, longest)| longest);
        self.stride_from_rad = if self.bursts(Family::Stride).is_empty() {
            f32::INFINITY
        } else {
            scaled(STRIDE_FROM_RAD, longest_rad(self), longest_rad(&TABLE_1)).unwrap_or(0.0)
        };
    }

    /// Distance in rad from which a cruise of `mode` is driven.
    pub fn cruise_from_rad(&self, mode: DriveMode) -> f32 {
        let [clockwise, counter_clockwise] = self.cruise_from_rad;
        match mode {
            DriveMode::B => clockwise,
            DriveMode::C => counter_clockwise,
        }
    }

    /// Distance in rad from which a stride is driven.
    pub fn stride_from_rad(&self) -> f32 {
        self.stride_from_rad
    }

    /// Shortest and longest mean turn in rad of bursts of `family` up to `amplitude_max`; `None` if it forbids them
    /// all.
    pub fn range_rad(&self, family: Family, amplitude_max: f32) -> Option<(f32, f32)> {
        let mut allowed = self.bursts(family).iter().filter(|burst| burst.amplitude <= amplitude_max);
        let first = allowed.next()?;
        Some((first.turn_rad, allowed.next_back().unwrap_or(first).turn_rad))
    }

    /// Whether there is a drive of `mode` up to `amplitude_max`.
    pub fn has_drives(&self, mode: DriveMode, amplitude_max: f32) -> bool {
        let mut bursts = Family::ALL.into_iter().filter(|family| family.mode() == mode);
        self.strongest_cruise(mode, amplitude_max).is_some()
            || bursts.any(|family| self.range_rad(family, amplitude_max).is_some())
    }

    /// The burst of `family` up to `amplitude_max` whose mean turn is nearest to `turn_rad`, by linear interpolation in
    /// the table.
    pub fn burst(&self, family: Family, turn_rad: f32, amplitude_max: f32) -> Option<Burst> {
        let mut allowed = self.bursts(family).iter().filter(|burst| burst.amplitude <= amplitude_max);
        let mut below = *allowed.next()?;
        for above in allowed {
            if turn_rad < above.turn_rad {
                let part = (turn_rad - below.turn_rad) / (above.turn_rad - below.turn_rad);
                return Some(below.towards(above, part.max(0.0)));
            }
            below = *above;
        }
        Some(below)
    }

    /// The strongest cruise of `mode` up to `amplitude_max`; `None` if it forbids them all.
    pub fn strongest_cruise(&self, mode: DriveMode, amplitude_max: f32) -> Option<Cruise> {
        self.cruises_of(mode).iter().rfind(|cruise| cruise.amplitude <= amplitude_max).copied()
    }

    /// The cruise of `mode` up to `amplitude_max` for the last `remaining_rad`: the strongest that has
    /// [`Cruise::room_rad`], or the weakest that turns nearly every motor; `None` if all of those are forbidden.
    pub fn cruise_within(&self, mode: DriveMode, amplitude_max: f32, remaining_rad: f32) -> Option<Cruise> {
        self.cruise_weaker_than(f32::INFINITY, mode, amplitude_max, remaining_rad)
    }

    /// [`Self::cruise_within`], where that is weaker than `amplitude`.
    // One copy of it, for the smallest board's flash.
    #[inline(never)]
    pub fn cruise_weaker_than(
        &self,
        amplitude: f32,
        mode: DriveMode,
        amplitude_max: f32,
        remaining_rad: f32,
    ) -> Option<Cruise> {
        let turns = |cruise: &&Cruise| cruise.amplitude <= amplitude_max && cruise.turns_every_motor();
        let mut allowed = self.cruises_of(mode).iter().filter(turns);
        // Amplitudes do not fall: where the weakest is no weaker, none is. An approach mostly ends there.
        let mut chosen = allowed.next().filter(|weakest| weakest.amplitude < amplitude)?;
        for cruise in allowed {
            if cruise.room_rad() <= remaining_rad {
                chosen = cruise;
            }
        }
        Some(*chosen).filter(|chosen| chosen.amplitude < amplitude)
    }

    /// Turn in rad from the cut of `mode` at a rate of that magnitude until rest. Sliding grows with the square of the
    /// rate, so the coast per rate is that of the next higher rate in the table.
    pub fn coast_rad(&self, mode: DriveMode, rate_rad_s: f32) -> f32 {
        // From the strongest: a motor under full drive has its rate after one look.
        let cruises = self.cruises_of(mode);
        let mut coast_s = cruises.last().map_or(0.0, |strongest| strongest.coast_s);
        for cruise in cruises.iter().rev() {
            if direction(mode) * cruise.rate_rad_s < rate_rad_s {
                break;
            }
            coast_s = cruise.coast_s;
        }
        rate_rad_s * coast_s
    }
}

/// `value` by how much `own` is larger than `other`.
fn scaled(value: f32, own: Option<f32>, other: Option<f32>) -> Option<f32> {
    Some(value * (own? / other?))
}

const fn cruise_rows(rows: &[Cruise]) -> Rows<Cruise, CRUISES_MAX> {
    let fill = Cruise {
        mode: DriveMode::B,
        amplitude: 0.0,
        rate_rad_s: 0.0,
        rate_sd_rad_s: 0.0,
        coast_s: 0.0,
        coast_sd_rad: 0.0,
    };
    Rows::of(rows, fill)
}

const fn burst_rows(rows: &[Burst]) -> Rows<Burst, BURSTS_MAX> {
    let fill = Burst { amplitude: 0.0, ticks: 0, turn_rad: 0.0, motors_sd_rad: 0.0, repeat_sd_rad: 0.0 };
    Rows::of(rows, fill)
}

#[cfg(test)]
mod tests;
