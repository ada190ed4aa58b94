//! Random numbers: one seeded stream per source of noise, so that switching one off does not shift the others.

use rand_core::{Rng, SeedableRng};
use rand_distr::{Bernoulli, Distribution};
use rand_pcg::Pcg64;

/// What draws random numbers. The discriminant names the stream: never renumber.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// The run's amplitudes of the two tooth pairs.
    AmplitudeVariation = 0,
    /// The plant's parameters within Table 1's tolerances.
    PlantDraw = 1,
    /// The camera's tracking noise.
    Camera = 2,
    /// The vibrometer's noise.
    Ldv = 3,
    /// The drive's phase at the start of a run.
    StartPhase = 5,
    /// The instants of steady motion at which comparisons of integrators start.
    StartStates = 4,
    /// Which frames the camera drops.
    CameraDrop = 6,
    /// Which frames it delivers twice.
    CameraDuplicate = 7,
    /// Which frames are outliers, and by how much.
    CameraOutlier = 8,
    /// Errors of the frames' time stamps.
    CameraStamp = 9,
    /// Which frames come late, and how late.
    CameraLate = 10,
    /// Which samples the vibrometer drops.
    LdvDrop = 11,
    /// Which samples are outliers, and by how much.
    LdvOutlier = 12,
    /// How wrong the kicks are that an imprecise genie of `host-sim estimate` is told.
    GenieKicks = 13,
    /// Where a positioning trial goes.
    Target = 14,
    /// A gyroscope's scale factor and bias.
    GyroscopeDraw = 20,
    /// Its angle random walk.
    GyroscopeWalk = 21,
    /// Its bias's instability.
    GyroscopeInstability = 22,
}

/// The stream of `source` in the run that `seed` names.
///
/// Source 0 is the generator that `seed` seeds; every other source starts at a state drawn from that one and runs on a
/// sequence of its own.
pub fn stream(seed: u64, source: Source) -> Pcg64 {
    let mut first = Pcg64::seed_from_u64(seed);
    match source {
        Source::AmplitudeVariation => first,
        other => {
            let state = u128::from(first.next_u64()) << 64 | u128::from(first.next_u64());
            Pcg64::new(state, other as u128)
        }
    }
}

/// Something that happens now and then, on a stream of its own: one draw an occasion, whatever comes of it.
#[derive(Clone, Debug)]
pub struct Mishap {
    /// Whether it happens, and whether it happens again right after it has.
    laws: Option<[Bernoulli; 2]>,
    striking: bool,
    stream: Pcg64,
}

impl Mishap {
    /// What happens with `probability`, within 0 to 1, on each occasion.
    pub fn new(seed: u64, source: Source, probability: f64) -> Self {
        Self::in_bursts(seed, source, probability, 1.0)
    }

    /// The same in bursts whose lengths are distributed geometrically, `length` occasions on average (Gilbert, Bell System Technical Journal 39 (1960) 1253-1265); not shorter than they are
    /// by chance, `1 / (1 - probability)`, where each occasion is a case by itself.
    pub fn in_bursts(seed: u64, source: Source, probability: f64, length: f64) -> Self {
        let again = probability.max(1.0 - 1.0 / length);
        // So that it is striking the share `probability` of the time.
        let first = if probability < 1.0 { probability * ((1.0 - again) / (1.0 - probability)) } else { 1.0 };
        let laws = || Some([Bernoulli::new(first).ok()?, Bernoulli::new(again).ok()?]);
        let laws = (probability > 0.0).then(laws).flatten();
        Self { laws, striking: false, stream: stream(seed, source) }
    }

    /// Whether it happens this time; if so, the stream from which to draw how.
    pub fn strikes(&mut self) -> Option<&mut Pcg64> {
        let [first, again] = self.laws?;
        self.striking = if self.striking { again } else { first }.sample(&mut self.stream);
        self.striking.then_some(&mut self.stream)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exact_streams_differ_and_repeat() {
        let sources = [
            Source::AmplitudeVariation,
            Source::PlantDraw,
            Source::Camera,
            Source::Ldv,
            Source::StartStates,
            Source::StartPhase,
            Source::CameraDrop,
            Source::CameraDuplicate,
            Source::CameraOutlier,
            Source::CameraStamp,
            Source::CameraLate,
            Source::LdvDrop,
            Source::LdvOutlier,
            Source::GenieKicks,
            Source::Target,
            Source::GyroscopeDraw,
            Source::GyroscopeWalk,
            Source::GyroscopeInstability,
        ];
        let draw = |seed, source| stream(seed, source).next_u64();
        let all: Vec<u64> =
            [1, 2].iter().flat_map(|&seed| sources.map(|source| draw(seed, source))).collect();
        let mut distinct = all.clone();
        distinct.sort_unstable();
        distinct.dedup();
        assert_eq!(distinct.len(), all.len());
        assert_eq!(draw(2, Source::Ldv), all[sources.len() + 3]);
    }

    #[test]
    fn law_mishaps_are_as_frequent_as_they_should() {
        let frequency = |probability| {
            let mut mishap = Mishap::new(3, Source::CameraDrop, probability);
            (0..100_000).filter(|_| mishap.strikes().is_some()).count()
        };
        assert_eq!((frequency(0.0), frequency(1.0)), (0, 100_000));
        // 30,000 +- four standard deviations.
        assert!(frequency(0.3).abs_diff(30_000) < 580);
    }

    /// A share p in bursts of mean length L begins with probability `p / L` an occasion: of n the count is known to `sqrt(n p / L)` or so, and the share to L times that.
    #[test]
    fn law_bursts_are_as_frequent_and_as_long_as_they_should() {
        let mut mishap = Mishap::in_bursts(3, Source::LdvOutlier, 0.1, 5.0);
        let struck: Vec<bool> = (0..200_000).map(|_| mishap.strikes().is_some()).collect();
        let count = struck.iter().filter(|struck| **struck).count();
        let bursts = struck.windows(2).filter(|pair| !pair[0] && pair[1]).count();
        assert!(count.abs_diff(20_000) < 4 * 5 * 64 && bursts.abs_diff(4000) < 4 * 64, "{count} {bursts}");
        let by_chance =
            |mut mishap: Mishap| (0..1000).map(|_| mishap.strikes().is_some()).collect::<Vec<_>>();
        let of = |length| by_chance(Mishap::in_bursts(3, Source::LdvOutlier, 0.4, length));
        assert!(of(1.0) == of(1.5) && of(1.0) == by_chance(Mishap::new(3, Source::LdvOutlier, 0.4)));
    }
}
