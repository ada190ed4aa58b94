//! The instruments that are tried: what differs from the default bench, on a camera that follows a single mark.

/// Keys and values.
type Sets = &'static [(&'static str, &'static str)];

/// A bench.
#[derive(Clone, Debug)]
pub struct Bench {
    /// Its name.
    pub name: String,
    /// Keys and values.
    pub sets: Vec<(&'static str, &'static str)>,
}

/// Cameras, each tried with the default vibrometer and without one.
const CAMERAS: [(&str, Sets); 18] = [
    ("10 frames/s", &[("camera.frame_rate_hz", "10")]),
    ("60 frames/s", &[("camera.frame_rate_hz", "60")]),
    ("500 frames/s", &[("camera.frame_rate_hz", "500")]),
    ("1,000 frames/s", &[("camera.frame_rate_hz", "1000")]),
    ("2,000 frames/s", &[("camera.frame_rate_hz", "2000")]),
    ("5,000 frames/s", &[("camera.frame_rate_hz", "5000")]),
    ("10,000 frames/s", &[]),
    ("30,000 frames/s", &[("camera.frame_rate_hz", "30000")]),
    ("noise 0.2 um", &[("camera.noise_m", "2e-7"), ("camera.resolution_m", "2e-7")]),
    ("noise 5 um", &[("camera.noise_m", "5e-6")]),
    ("noise 20 um", &[("camera.noise_m", "2e-5")]),
    ("resolution 0.2 um", &[("camera.resolution_m", "2e-7")]),
    ("resolution 6 um", &[("camera.resolution_m", "6e-6")]),
    ("resolution 20 um", &[("camera.resolution_m", "2e-5")]),
    ("radius 1 mm", &[("camera.tracking_radius_m", "1e-3")]),
    ("radius 30 mm", &[("camera.tracking_radius_m", "3e-2")]),
    ("latency 10 ms", &[("camera.latency_s", "0.01")]),
    ("latency 50 ms", &[("camera.latency_s", "0.05")]),
];

/// Vibrometers, each tried with the default camera.
const VIBROMETERS: [(&str, Sets); 12] = [
    ("vibrometer 20 kHz", &[("ldv.sample_rate_hz", "20000")]),
    ("vibrometer 500 kHz", &[("ldv.sample_rate_hz", "500000")]),
    ("vibrometer noise 0.05 mm/s", &[("ldv.noise_m_s", "5e-5")]),
    ("vibrometer noise 1 mm/s", &[("ldv.noise_m_s", "1e-3")]),
    ("vibrometer noise 10 mm/s", &[("ldv.noise_m_s", "1e-2")]),
    ("vibrometer bias 1 mm/s", &[("ldv.bias_m_s", "1e-3")]),
    ("vibrometer bias 10 mm/s", &[("ldv.bias_m_s", "1e-2")]),
    ("vibrometer bias 50 mm/s", &[("ldv.bias_m_s", "5e-2")]),
    ("vibrometer range 20 mm/s", &[("ldv.range_m_s", "2e-2")]),
    ("vibrometer 8 bits", &[("ldv.range_m_s", "1"), ("ldv.bits", "8")]),
    ("vibrometer 12 bits", &[("ldv.range_m_s", "1"), ("ldv.bits", "12")]),
    ("vibrometer lost after 0.1 s", &[("ldv.lost_from_s", "0.1"), ("ldv.lost_until_s", "1000")]),
];

/// What the filters assume wrongly, with the default instruments.
const ASSUMED: [(&str, Sets); 8] = [
    ("camera noise assumed a quarter", &[("estimator.assumed.camera.noise_m", "2.5e-7")]),
    ("camera noise assumed half", &[("estimator.assumed.camera.noise_m", "5e-7")]),
    ("camera noise assumed double", &[("estimator.assumed.camera.noise_m", "2e-6")]),
    ("camera noise assumed four times", &[("estimator.assumed.camera.noise_m", "4e-6")]),
    ("latency assumed a frame less", &[("estimator.assumed.camera.latency_frames", "0")]),
    ("latency assumed a frame more", &[("estimator.assumed.camera.latency_frames", "2")]),
    ("radius assumed 1 % less", &[("estimator.assumed.camera.tracking_radius_m", "3.861e-3")]),
    ("radius assumed 1 % more", &[("estimator.assumed.camera.tracking_radius_m", "3.939e-3")]),
];

/// Whether the filters assume something wrongly on the bench of this name.
pub(super) fn is_assumed_wrongly(name: &str) -> bool {
    ASSUMED.iter().any(|(assumed, _)| *assumed == name)
}

/// On every bench the camera follows a single mark: the least that any camera does, and the worst frames.
const ONE_MARK: (&str, &str) = ("camera.marks", "1");

/// A bench of this name on which the keys of all `sets` are set.
fn bench(name: String, sets: &[Sets]) -> Bench {
    let sets = sets.iter().flat_map(|sets| sets.iter().copied());
    Bench { name, sets: std::iter::once(ONE_MARK).chain(sets).collect() }
}

/// Every bench.
pub fn benches() -> Vec<Bench> {
    let cameras = CAMERAS.iter().flat_map(|(name, sets)| {
        [
            bench((*name).to_owned(), &[sets]),
            bench(format!("{name} alone"), &[sets, &[("ldv.installed", "no")]]),
        ]
    });
    let others = VIBROMETERS.iter().chain(&ASSUMED);
    cameras.chain(others.map(|(name, sets)| bench((*name).to_owned(), &[sets]))).collect()
}
