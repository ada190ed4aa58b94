extern crate std;

use core::fmt::Write as _;
use std::string::String;
use std::vec::Vec;

use proptest::prelude::*;
use rand_core::Rng;
use rand_pcg::Pcg64;

use super::sample_messages::{board_messages, host_messages};
use super::*;
use crate::{BoardMessage, CameraRecord, Deframer, HostMessage, LdvRecord, encode_camera};

pub(super) const HEADER: Header = Header { session: 0x0102_0304, sequence: 7, ticks: 1 << 40 };

pub(super) fn framed<M: Serialize>(header: Header, message: &M) -> Vec<u8> {
    let mut frame = [0; FRAME_BYTES_MAX];
    let length = encode(header, message, &mut frame).unwrap();
    frame[..length].to_vec()
}

/// The bytes of a frame, computed by hand: CRC-32 by zlib, no zero byte to hide but those shown.
#[test]
fn exact_bytes_of_a_frame() {
    let header = Header { session: 0x1111_1111, sequence: 0x2222_2222, ticks: 0x3333_3333_3333_3333 };
    let content = [&[VERSION][..], &[0x11; 4], &[0x22; 4], &[0x33; 8], &[2]].concat();
    assert_eq!(CRC.checksum(b"123456789"), 0xCBF4_3926, "the check value of CRC-32/ISO-HDLC");
    let crc = CRC.checksum(&content).to_le_bytes();
    assert!(!crc.contains(&0));
    let expected = [&[23][..], &content, &crc, &[0]].concat();
    assert_eq!(framed(header, &HostMessage::Arm), expected);
}

/// Every message comes back from its frame, which has one zero byte.
#[test]
fn exact_every_message_comes_back() {
    for message in host_messages() {
        let mut frame = framed(HEADER, &message);
        assert_eq!(frame.iter().filter(|&&byte| byte == 0).count(), 1, "{frame:?}");
        assert_eq!(decode::<HostMessage>(&mut frame), Ok((HEADER, message)));
    }
    for message in board_messages() {
        assert_eq!(decode(&mut framed(HEADER, &message)), Ok((HEADER, message)));
    }
}

/// The versions whose frames have a file, and the digest of that file, a CRC-64. A line here is never changed: a board
/// of that version speaks so. Other frames are another version, with a file and a line of its own.
const LANDED: [(u8, u64); 7] = [
    (11, 0x3615_77cd_ce3f_ae57),
    (12, 0x7e01_c39b_7b1d_da43),
    (13, 0x3550_c079_968d_874d),
    (14, 0xb77c_3eab_5e9a_d872),
    (15, 0xa1eb_13fe_8faf_f77b),
    (16, 0xf29b_bcf4_186f_3635),
    (17, 0x5b20_3254_8be4_8aaa),
];

/// The frames of this version are those of its file, byte for byte. Where they have to change, [`VERSION`] goes up and
/// the new frames get a file of their own.
#[test]
fn exact_frames_are_those_of_the_version_s_file() {
    let path = std::format!("{}/fixtures/version_{VERSION}.txt", env!("CARGO_MANIFEST_DIR"));
    let kept = std::fs::read_to_string(&path).unwrap_or_default();
    let mut short = [0; FRAME_BYTES_MAX];
    let record = CameraRecord { exposed_nanos: 5_000_000, angle_units: -5, marks_used: 2, residual: 12 };
    let length = encode_camera(Header { ticks: 520, ..HEADER }, record, &mut short).unwrap();
    let frames = host_messages()
        .into_iter()
        .map(|message| framed(HEADER, &message))
        .chain(board_messages().into_iter().map(|message| framed(HEADER, &message)))
        .chain([short[..length].to_vec()]);
    let mut text = String::new();
    for frame in frames {
        for byte in frame {
            write!(text, "{byte:02x}").unwrap();
        }
        text.push('\n');
    }
    assert!(text == kept, "{path}: other frames raise VERSION, and get a file of their own:\n{text}");
}

/// A file keeps the digest that it landed with. Files of earlier versions need not be kept.
#[test]
fn regress_the_file_of_a_version_stays_as_it_landed() {
    let newest = LANDED.map(|(version, _)| version).into_iter().max();
    assert_eq!(newest, Some(VERSION), "a version has a line in LANDED");
    for (version, landed) in LANDED {
        let path = std::format!("{}/fixtures/version_{version}.txt", env!("CARGO_MANIFEST_DIR"));
        if let Ok(file) = std::fs::read(path) {
            let digest = Crc::<u64>::new(&crc::CRC_64_XZ).checksum(&file);
            assert_eq!(
                digest, landed,
                "version {version} has {digest:#018x}: raise VERSION for other frames"
            );
        }
    }
}

/// Every single bit flip.
#[test]
fn law_no_flipped_bit_passes() {
    for message in host_messages() {
        let frame = framed(HEADER, &message);
        for bit in 0..8 * (frame.len() - 1) {
            let mut spoilt = frame.clone();
            spoilt[bit / 8] ^= 1 << (bit % 8);
            let mut deframer = Deframer::default();
            for byte in spoilt {
                if let Some(frame) = deframer.push(byte) {
                    assert!(decode::<HostMessage>(frame).is_err(), "bit {bit} of {message:?}");
                }
            }
        }
    }
}

#[test]
fn law_no_truncated_frame_passes_and_the_next_one_does() {
    for message in host_messages() {
        let frame = framed(HEADER, &message);
        for length in 0..frame.len() - 1 {
            let mut bytes = frame[..length].to_vec();
            bytes.push(0);
            bytes.extend_from_slice(&frame);
            let mut deframer = Deframer::default();
            let decoded: Vec<_> = bytes
                .iter()
                .filter_map(|&byte| deframer.push(byte).map(decode::<HostMessage>))
                .filter_map(Result::ok)
                .collect();
            assert_eq!(decoded, [(HEADER, message.clone())], "{length}");
        }
    }
}

/// A frame with something after its message, CRC and all, is no frame.
#[test]
fn exact_nothing_may_be_left_over() {
    let mut with_more = framed(HEADER, &(HostMessage::Stop, 0_u8));
    assert_eq!(decode::<HostMessage>(&mut with_more), Err(FrameError::Message));
    assert_eq!(decode::<HostMessage>(&mut framed(HEADER, &99_u8)), Err(FrameError::Message));
}

#[test]
fn exact_another_version_is_told_from_damage() {
    let mut content = [VERSION + 1; 32];
    let crc = CRC.checksum(&content[..28]);
    content[28..].copy_from_slice(&crc.to_le_bytes());
    let mut frame = [0; 40];
    let length = cobs::encode(&content, &mut frame);
    let decoded = decode::<HostMessage>(&mut frame[..length]);
    assert_eq!(decoded, Err(FrameError::Version { theirs: VERSION + 1 }));
    assert_eq!(std::format!("{}", decoded.unwrap_err()), "protocol version 18, expected 17");
}

/// A million frames, each damaged in one of five ways, on one line: none but whole ones are accepted.
#[test]
fn law_no_wrong_frame_among_a_million_mutated_ones() {
    let mut random = Pcg64::new(1, 2);
    let messages = host_messages();
    let mut deframer = Deframer::default();
    let (mut whole, mut refused) = (0, 0);
    for n in 0..1_000_000_u32 {
        let message = &messages[n as usize % messages.len()];
        let header = Header { sequence: n, ..HEADER };
        let mut bytes = framed(header, message);
        let mut draw = |below: usize| random.next_u64() as usize % below;
        let place = draw(bytes.len() - 1);
        match draw(5) {
            0 => bytes[place] ^= 1 << draw(8),
            1 => drop(bytes.drain(place..=place)),
            2 => bytes.insert(place, draw(256) as u8),
            3 => {
                let end = bytes.len() - 1;
                bytes[place..end].iter_mut().for_each(|byte| *byte = draw(256) as u8);
            }
            _ => bytes.swap(place, 0),
        }
        for byte in bytes {
            match deframer.push(byte).map(decode::<HostMessage>) {
                None => (),
                Some(Ok(decoded)) => {
                    assert_eq!(decoded, (header, message.clone()), "frame {n}");
                    // A zero inserted before it leaves a frame whole.
                    whole += 1;
                }
                Some(Err(_)) => refused += 1,
            }
        }
    }
    assert!(refused > 900_000 && whole > 1000, "{refused} {whole}");
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    /// Bytes that were never a frame.
    #[test]
    fn law_garbage_is_refused(mut bytes in prop::collection::vec(any::<u8>(), 0..FRAME_BYTES_MAX)) {
        prop_assert!(decode::<HostMessage>(&mut bytes.clone()).is_err());
        prop_assert!(decode::<BoardMessage>(&mut bytes).is_err());
    }

    /// Numbers of any bits, as many samples as there may be.
    #[test]
    fn law_any_measurements_come_back(
        samples in prop::collection::vec((any::<u64>(), any::<u32>()), 0..=16),
        session: u32, sequence: u32, ticks: u64
    ) {
        let record = |&(taken_nanos, bits): &(u64, u32)| LdvRecord {
            taken_nanos,
            velocity_m_s: f32::from_bits(bits),
        };
        let message = HostMessage::Ldv(samples.iter().map(record).collect());
        let header = Header { session, sequence, ticks };
        let frame = framed(header, &message);
        let (read, message) = decode::<HostMessage>(&mut frame.clone()).unwrap();
        prop_assert_eq!(read, header);
        // Compared as bytes: NaN is not itself.
        prop_assert_eq!(framed(read, &message), frame);
    }
}
