//! Random numbers: one seeded stream per source, so that a source that is switched off does not shift the others.

use rand_core::{Rng, SeedableRng};
use rand_distr::{Bernoulli, Distribution};
use rand_pcg::Pcg64;

/// A source of randomness. Its number is that of its stream, and must not change.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RandomSource {
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
    /// The errors of the kicks that an imprecise genie of `host-sim estimate` receives.
    GenieKicks = 13,
    /// The target of a positioning trial.
    Target = 14,
    /// Random deviations of the averaged motor.
    AveragedMotion = 15,
    /// Jitter of the camera's frames.
    CameraClock = 16,
    /// Jitter of the vibrometer's samples.
    LdvClock = 17,
    /// Place of the pin's axis within a pixel of the camera.
    CameraAxis = 18,
    /// A gyroscope's scale factor and bias.
    GyroscopeDraw = 20,
    /// Its angle random walk.
    GyroscopeWalk = 21,
    /// Its bias's instability.
    GyroscopeInstability = 22,
    /// What goes wrong in a run of a campaign of faults.
    FaultDraw = 23,
    /// Motors from which an identification learns.
    IdentificationDraw = 24,
    /// The beginnings of its chains.
    IdentificationChain = 25,
    /// Where the points of a sweep lie.
    SweepPoints = 26,
    /// Which base points of a sweep are drawn again, for the intervals of its indices.
    SweepBootstrap = 27,
    /// Which frames an intermittent camera loses.
    CameraFaultLoss = 28,
    /// Which frames a fault makes outliers, and by how much.
    CameraFaultOutlier = 29,
    /// Which samples an intermittent vibrometer loses.
    LdvFaultLoss = 30,
    /// Which samples a fault makes outliers, and by how much.
    LdvFaultOutlier = 31,
    /// Phase of the sub-pixel bias of each coordinate of each mark.
    CameraSubpixelBias = 32,
    /// Direction and phase of the microscope's vibration.
    CameraVibration = 33,
    /// Which of the kept stators of finite elements a true motor has.
    StatorDraw = 34,
    /// A gyroscope's other errors: misalignment, non-linearity, what warming up changes.
    GyroscopeErrorDraw = 35,
    /// Delays of the exchanges between a camera with a clock of its own and the board.
    CameraOwnClock = 36,
    /// By how much the board's interrupts are late.
    LateInterrupts = 37,
}

/// The stream of `source` in the run that `seed` names.
///
/// Source 0 is the generator that `seed` seeds; every other source starts at a state drawn from that one and
/// runs on a sequence of its own.
pub fn stream(seed: u64, source: RandomSource) -> Pcg64 {
    let mut first = Pcg64::seed_from_u64(seed);
    match source {
        RandomSource::AmplitudeVariation => first,
        other => {
            let state = u128::from(first.next_u64()) << 64 | u128::from(first.next_u64());
            Pcg64::new(state, other as u128)
        }
    }
}

/// A fault that occurs at random occasions, by a stream of its own. Each occasion takes one draw.
#[derive(Clone, Debug)]
pub struct RandomFault {
    /// Whether it occurs after an occasion without it, and after one with it.
    laws: Option<[Bernoulli; 2]>,
    occurring: bool,
    stream: Pcg64,
}

impl RandomFault {
    /// A fault that occurs with `probability`, within 0 to 1, at each occasion.
    pub fn new(seed: u64, source: RandomSource, probability: f64) -> Self {
        Self::in_bursts(seed, source, probability, 1.0)
    }

    /// The same in bursts of geometrically distributed length, `length` occasions on average (Gilbert, Bell System
    /// Technical Journal 39 (1960) 1253-1265). The mean length is at least `1 / (1 - probability)`, that of independent
    /// occasions.
    pub fn in_bursts(seed: u64, source: RandomSource, probability: f64, length: f64) -> Self {
        let again = probability.max(1.0 - 1.0 / length);
        // With this the fault occurs at the share `probability` of the occasions.
        let first = if probability < 1.0 { probability * ((1.0 - again) / (1.0 - probability)) } else { 1.0 };
        let laws = || Some([Bernoulli::new(first).ok()?, Bernoulli::new(again).ok()?]);
        let laws = (probability > 0.0).then(laws).flatten();
        Self { laws, occurring: false, stream: stream(seed, source) }
    }

    /// Whether it occurs at this occasion; if so, the stream from which to draw its size.
    pub fn occurs(&mut self) -> Option<&mut Pcg64> {
        let [first, again] = self.laws?;
        self.occurring = if self.occurring { again } else { first }.sample(&mut self.stream);
        self.occurring.then_some(&mut self.stream)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exact_streams_differ_and_repeat() {
        let sources = [
            RandomSource::AmplitudeVariation,
            RandomSource::PlantDraw,
            RandomSource::Camera,
            RandomSource::Ldv,
            RandomSource::StartStates,
            RandomSource::StartPhase,
            RandomSource::CameraDrop,
            RandomSource::CameraDuplicate,
            RandomSource::CameraOutlier,
            RandomSource::CameraStamp,
            RandomSource::CameraLate,
            RandomSource::LdvDrop,
            RandomSource::LdvOutlier,
            RandomSource::GenieKicks,
            RandomSource::Target,
            RandomSource::CameraClock,
            RandomSource::LdvClock,
            RandomSource::CameraAxis,
            RandomSource::GyroscopeDraw,
            RandomSource::GyroscopeErrorDraw,
            RandomSource::GyroscopeWalk,
            RandomSource::GyroscopeInstability,
            RandomSource::FaultDraw,
            RandomSource::SweepPoints,
            RandomSource::SweepBootstrap,
            RandomSource::CameraFaultLoss,
            RandomSource::CameraFaultOutlier,
            RandomSource::LdvFaultLoss,
            RandomSource::LdvFaultOutlier,
            RandomSource::CameraSubpixelBias,
            RandomSource::CameraVibration,
            RandomSource::IdentificationDraw,
            RandomSource::IdentificationChain,
            RandomSource::CameraOwnClock,
            RandomSource::LateInterrupts,
        ];
        let draw = |seed, source| stream(seed, source).next_u64();
        let all: Vec<u64> =
            [1, 2].iter().flat_map(|&seed| sources.map(|source| draw(seed, source))).collect();
        let mut distinct = all.clone();
        distinct.sort_unstable();
        distinct.dedup();
        assert_eq!(distinct.len(), all.len());
        assert_eq!(draw(2, RandomSource::Ldv), all[sources.len() + 3]);
    }

    #[test]
    fn law_faults_are_as_frequent_as_they_should() {
        let frequency = |probability| {
            let mut fault = RandomFault::new(3, RandomSource::CameraDrop, probability);
            (0..100_000).filter(|_| fault.occurs().is_some()).count()
        };
        assert_eq!((frequency(0.0), frequency(1.0)), (0, 100_000));
        // 30,000 +- four standard deviations.
        assert!(frequency(0.3).abs_diff(30_000) < 580);
    }

    /// A share p in bursts of mean length L: a burst begins with probability `p / L` an occasion. Of n occasions the
    /// number of bursts is known to about `sqrt(n p / L)`, and the number of faults to L times that.
    #[test]
    fn law_bursts_are_as_frequent_and_as_long_as_they_should() {
        let mut fault = RandomFault::in_bursts(3, RandomSource::LdvOutlier, 0.1, 5.0);
        let occurred: Vec<bool> = (0..200_000).map(|_| fault.occurs().is_some()).collect();
        let count = occurred.iter().filter(|occurred| **occurred).count();
        let bursts = occurred.windows(2).filter(|pair| !pair[0] && pair[1]).count();
        assert!(count.abs_diff(20_000) < 4 * 5 * 64 && bursts.abs_diff(4000) < 4 * 64, "{count} {bursts}");
        let by_chance =
            |mut fault: RandomFault| (0..1000).map(|_| fault.occurs().is_some()).collect::<Vec<_>>();
        let of = |length| by_chance(RandomFault::in_bursts(3, RandomSource::LdvOutlier, 0.4, length));
        assert!(
            of(1.0) == of(1.5) && of(1.0) == by_chance(RandomFault::new(3, RandomSource::LdvOutlier, 0.4))
        );
    }
}
