//! The bytes are those that the crate's own writer makes of the same messages.

use std::io::Cursor;

use mcap::records::MessageHeader;
use mcap::{Attachment, WriteOptions};
use proptest::prelude::*;

use super::*;
use crate::log::CHANNELS;
use crate::log::channels::{Described, Health, VibrometerSample};

/// What is given to both writers, in order.
#[derive(Clone, Debug)]
enum Given {
    Sample(u64, f32, i64),
    Health(u64, String),
    EndOfChunk,
    Attachment(String),
    Metadata(String),
}

fn given() -> impl Strategy<Value = Given> {
    let at = 0_u64..1 << 40;
    prop_oneof![
        8 => (at.clone(), any::<f32>(), any::<i64>())
            .prop_map(|(at, velocity, after)| Given::Sample(at, velocity, after)),
        2 => (at, "\\PC{0,300}").prop_map(|(at, health)| Given::Health(at, health)),
        1 => Just(Given::EndOfChunk),
        1 => "\\PC{0,80}".prop_map(Given::Attachment),
        1 => "\\PC{0,80}".prop_map(Given::Metadata),
    ]
}

fn facts(text: &str) -> BTreeMap<String, String> {
    [("text", text), ("length", &text.len().to_string())]
        .map(|(key, value)| (key.to_owned(), value.to_owned()))
        .into()
}

fn written(given: &[Given]) -> Vec<u8> {
    let mut file = McapFile::create(Vec::new(), "profile", "library").unwrap();
    for channel in &CHANNELS {
        file.channel(channel.topic, &channel.schema_name(), &channel.schema()).unwrap();
    }
    for given in given {
        match given.clone() {
            Given::Sample(at, velocity_m_s, arrived_after_ns) => {
                let sample = VibrometerSample { velocity_m_s, arrived_after_ns };
                file.message(VibrometerSample::PLACE, Time::from_nanos(at), &sample).map(drop)
            }
            Given::Health(at, health) => {
                let health = Health { health, level: 1 };
                file.message(Health::PLACE, Time::from_nanos(at), &health).map(drop)
            }
            Given::EndOfChunk => file.end_chunk(),
            Given::Attachment(text) => file.attachment("a", "text/plain", &text),
            Given::Metadata(text) => file.metadata("m", facts(&text)),
        }
        .unwrap();
    }
    file.finish().unwrap()
}

fn written_by_the_crate(given: &[Given]) -> Vec<u8> {
    let options =
        WriteOptions::new().profile("profile").library("library").compression(None).chunk_size(None);
    let options = options.disable_seeking(true).calculate_data_section_crc(false);
    let mut writer = options.create(Cursor::new(Vec::new())).unwrap();
    let mut ids = Vec::new();
    for channel in &CHANNELS {
        let schema = writer.add_schema(&channel.schema_name(), "protobuf", &channel.schema()).unwrap();
        ids.push(writer.add_channel(schema, channel.topic, "protobuf", &BTreeMap::new()).unwrap());
    }
    let mut sequence = 0;
    for given in given {
        let mut message = |place: usize, at, content: Vec<u8>| {
            sequence += 1;
            let header = MessageHeader { channel_id: ids[place], sequence, log_time: at, publish_time: at };
            writer.write_to_known_channel(&header, &content)
        };
        match given.clone() {
            Given::Sample(at, velocity_m_s, arrived_after_ns) => {
                let sample = VibrometerSample { velocity_m_s, arrived_after_ns };
                message(VibrometerSample::PLACE, at, sample.encode_to_vec())
            }
            Given::Health(at, health) => {
                message(Health::PLACE, at, Health { health, level: 1 }.encode_to_vec())
            }
            Given::EndOfChunk => writer.flush(),
            Given::Attachment(text) => writer.attach(&Attachment {
                log_time: 0,
                create_time: 0,
                name: "a".to_owned(),
                media_type: "text/plain".to_owned(),
                data: text.into_bytes().into(),
            }),
            Given::Metadata(text) => {
                writer.write_metadata(&Metadata { name: "m".to_owned(), metadata: facts(&text) })
            }
        }
        .unwrap();
    }
    writer.finish().unwrap();
    writer.into_inner().into_inner()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Whatever is written, and wherever chunks end.
    #[test]
    fn dual_the_crates_writer_makes_the_same_bytes(given in proptest::collection::vec(given(), 0..40)) {
        prop_assert!(written(&given) == written_by_the_crate(&given));
    }
}

/// A message takes the bytes that are said: its content is a float and a variable integer with a key each.
#[test]
fn exact_bytes_of_a_message() {
    let mut file = McapFile::create(Vec::new(), "", "").unwrap();
    file.channel("/a", "a", &[]).unwrap();
    let sample = VibrometerSample { velocity_m_s: 1.0, arrived_after_ns: 3 };
    assert_eq!(file.message(0, Time::ZERO, &sample).unwrap(), MESSAGE_HEAD + 16 + 5 + 2);
}
