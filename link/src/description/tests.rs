extern crate std;

use std::vec::Vec;

use estimator::CameraDescription;

use super::*;

/// The digest of the parts laid end to end, by the table that this crate does without.
fn expected(messages: &[HostMessage]) -> u64 {
    let mut part = [0; PART_BYTES_MAX];
    let mut parts = Vec::new();
    for message in messages {
        parts.extend_from_slice(postcard::to_slice(message, &mut part).unwrap());
    }
    Crc::<u64>::new(&CRC_64_XZ).checksum(&parts)
}

/// What is Table 1's is not told, and what is not, is, by its place among the parameters.
#[test]
fn dual_messages_and_digest_of_a_description() {
    let nominal = MotorParams::nominal();
    let instruments = Instruments::default();
    let plain: Vec<_> = description_messages(&nominal, instruments, LoopTiming::default(), None).collect();
    let begin = HostMessage::DescriptionBegin;
    let latency = HostMessage::Timing { latency_ticks: 0, decision_ticks: 1 };
    assert_eq!(plain, [begin.clone(), HostMessage::Instruments(instruments), latency]);
    let heavy = nominal.with(Parameter::RotorMass, 2e-4).unwrap();
    let map = ResponseMap::table_1();
    let slow = LoopTiming { latency_ticks: 7, decision_ticks: 2 };
    let all: Vec<_> = description_messages(&heavy, instruments, slow, Some(map)).collect();
    let mass = MotorParameterRecord { index: Parameter::RotorMass as u8, value: 2e-4 };
    let told = [
        begin,
        HostMessage::Instruments(instruments),
        HostMessage::Timing { latency_ticks: 7, decision_ticks: 2 },
        HostMessage::MotorParameter(mass),
    ];
    assert_eq!(all[..4], told);
    assert!(all[4..].iter().cloned().eq(map_messages(map)));
    for messages in [plain, all] {
        assert_eq!(DescriptionDigest::of(messages.iter().cloned()), Ok(expected(&messages)));
    }
}

/// A change of anything in a description is another digest.
#[test]
fn law_another_description_has_another_digest() {
    let (nominal, instruments, map) =
        (MotorParams::nominal(), Instruments::default(), ResponseMap::table_1());
    let camera = CameraDescription { noise_m: 2.0 * instruments.camera.noise_m, ..instruments.camera };
    let mut digests = Vec::new();
    let mut add = |design: &MotorParams, instruments, timing, map: Option<&ResponseMap>| {
        let messages = description_messages(design, instruments, timing, map);
        digests.push(DescriptionDigest::of(messages).unwrap());
    };
    let first = LoopTiming::default();
    add(&nominal, instruments, first, None);
    add(&nominal, instruments, LoopTiming { latency_ticks: 1, ..first }, None);
    add(&nominal, instruments, LoopTiming { decision_ticks: 2, ..first }, None);
    add(&nominal, Instruments { camera, ..instruments }, first, None);
    add(&nominal, Instruments { vibrometer: None, ..instruments }, first, None);
    add(&nominal, instruments, first, Some(map));
    add(&nominal, instruments, first, Some(&ResponseMap::without_rows(nominal)));
    for parameter in Parameter::ALL {
        let value = nominal.get(parameter);
        let spec = parameter.spec();
        let other = if value < spec.max { spec.max } else { spec.min };
        add(&nominal.with(parameter, other).unwrap(), instruments, first, None);
    }
    let different: std::collections::BTreeSet<u64> = digests.iter().copied().collect();
    assert_eq!(different.len(), digests.len());
}
