extern crate std;

use std::vec;
use std::vec::Vec;

use controller::LoopTiming;

use estimator::Instruments;
use link::{MAP_ROWS_MAX, MapRows, decode_part, description_messages, map_messages};
use motor_model::MotorParams;
use proptest::prelude::*;

use super::emulated_flash::{EmulatedFlash, HalfErased};
use super::*;

/// A timing of this latency.
fn latency(latency_ticks: u8) -> LoopTiming {
    LoopTiming { latency_ticks, decision_ticks: 4 }
}
use crate::test_support::{map_of, other_design};

/// Runs a check on the flash of an STM32G474, and on one of an STM32H743 whose sectors are a sixteenth of the part's.
macro_rules! on_either_flash {
    ($check:ident) => {
        $check::<4096, 8>();
        $check::<8192, 32>();
    };
}

/// A description that differs from others by its latency, with `rows` of a map in each table.
fn description(latency_ticks: u8, rows: u8) -> Vec<HostMessage> {
    let nominal = MotorParams::nominal();
    let map = map_of(nominal, rows);
    description_messages(&nominal, Instruments::default(), latency(latency_ticks), Some(&map)).collect()
}

fn digest_of(messages: &[HostMessage]) -> u64 {
    DescriptionDigest::of(messages.iter().cloned()).unwrap()
}

fn part_bytes(messages: &[HostMessage]) -> usize {
    let mut part = [0; PART_BYTES_MAX];
    messages.iter().map(|message| encode_part(message, &mut part).unwrap().len()).sum()
}

/// What a board that starts now finds in `flash`.
fn found<const PAGE: usize, const WORD: usize>(flash: &mut EmulatedFlash<PAGE, WORD>) -> Vec<HostMessage> {
    let before = flash.bytes.clone();
    let mut messages = Vec::new();
    let mut store = Store::new(&mut *flash);
    store.read(|part| messages.push(decode_part(part).unwrap()));
    let kept = store.kept();
    if messages.is_empty() {
        assert_eq!(kept, KeptDescription::Nothing);
    } else {
        assert_eq!(kept, KeptDescription::Whole { digest: digest_of(&messages) });
    }
    assert!(flash.bytes == before, "reading writes nothing");
    messages
}

fn keep<const PAGE: usize, const WORD: usize>(
    flash: &mut EmulatedFlash<PAGE, WORD>,
    messages: &[HostMessage],
) -> Result<(), NotStored> {
    Store::new(flash).keep(messages.iter().cloned())
}

/// A flash with two descriptions, the later of which counts.
fn with_two<const PAGE: usize, const WORD: usize>() -> (EmulatedFlash<PAGE, WORD>, Vec<HostMessage>) {
    let mut flash = EmulatedFlash::new();
    assert_eq!(keep(&mut flash, &description(1, 1)), Ok(()));
    let old = description(2, 1);
    assert_eq!(keep(&mut flash, &old), Ok(()));
    (flash, old)
}

/// Bytes that `work` erases and writes.
fn bytes_of_work<const PAGE: usize, const WORD: usize>(
    flash: &EmulatedFlash<PAGE, WORD>,
    work: impl FnOnce(&mut EmulatedFlash<PAGE, WORD>),
) -> usize {
    let plenty = 1 << 20;
    let mut flash = EmulatedFlash { power: Some(plenty), ..flash.clone() };
    work(&mut flash);
    plenty - flash.power.unwrap()
}

/// Maps of every length, and every parameter of the motor: what was kept comes back, in pages of every size.
#[test]
fn exact_what_is_kept_comes_back() {
    fn check<const PAGE: usize, const WORD: usize>() {
        let mut flash = EmulatedFlash::<PAGE, WORD>::new();
        assert_eq!(found(&mut flash), []);
        for rows in 0..=16 {
            for design in [MotorParams::nominal(), other_design()] {
                let map = map_of(design, rows);
                for map in [None, Some(&map)] {
                    let messages: Vec<_> =
                        description_messages(&design, Instruments::default(), latency(3), map).collect();
                    assert_eq!(keep(&mut flash, &messages), Ok(()));
                    assert_eq!(found(&mut flash), messages, "{rows} rows");
                }
            }
        }
    }
    on_either_flash!(check);
    check::<2048, 8>();
    check::<{ 128 * 1024 }, 32>();
}

/// Numbers of any size: the longest that postcard makes of each.
#[test]
fn exact_there_is_room_for_the_longest_messages() {
    fn check<const PAGE: usize, const WORD: usize>() {
        let design = other_design();
        let longest = LoopTiming { latency_ticks: u8::MAX, decision_ticks: u8::MAX };
        let longest: Vec<_> =
            description_messages(&design, Instruments::default(), longest, Some(&map_of(design, 16)))
                .map(|message| match message {
                    HostMessage::MapRows(MapRows::Bursts { family, mut rows }) => {
                        rows.iter_mut().for_each(|row| row.ticks = u32::MAX);
                        HostMessage::MapRows(MapRows::Bursts { family, rows })
                    }
                    other => other,
                })
                .collect();
        let mut flash = EmulatedFlash::<PAGE, WORD>::new();
        assert_eq!(keep(&mut flash, &longest), Ok(()));
        assert_eq!(found(&mut flash), longest);
    }
    on_either_flash!(check);
}

/// What has no room is refused, and the old description is kept.
#[test]
fn law_too_long_a_description_leaves_the_old_one() {
    fn check<const PAGE: usize, const WORD: usize>() {
        let (mut flash, old) = with_two::<PAGE, WORD>();
        let row = map_messages(&map_of(MotorParams::nominal(), MAP_ROWS_MAX as u8)).nth(1).unwrap();
        assert_eq!(keep(&mut flash, &vec![row; 60]), Err(NotStored));
        assert_eq!(found(&mut flash), old);
    }
    on_either_flash!(check);
}

/// The power fails at every byte of a description that is kept after another: at every byte of the erasure, which
/// leaves the page in any of three states, and at every byte of the writing. The board has the old one or the new one,
/// whole, and keeps the next one.
#[test]
fn law_a_power_cut_at_any_byte_leaves_the_old_description_or_the_new_one() {
    fn check<const PAGE: usize, const WORD: usize>() {
        let (flash, old) = with_two::<PAGE, WORD>();
        let (new, next) = (description(3, 1), description(4, 1));
        let bytes = bytes_of_work(&flash, |flash| assert_eq!(keep(flash, &new), Ok(())));
        assert!(
            bytes > EmulatedFlash::<PAGE, WORD>::SLOT + part_bytes(&new),
            "the erasure and the writing: {bytes}"
        );
        let mut news = 0;
        for cut in 0..bytes {
            let half_erased = [HalfErased::InOrder, HalfErased::Bits, HalfErased::Noise][cut % 3];
            let mut flash =
                EmulatedFlash { power: Some(cut), half_erased, noise: cut as u32, ..flash.clone() };
            assert_eq!(keep(&mut flash, &new), Err(NotStored), "cut {cut}");
            flash.power = None;
            let kept = found(&mut flash);
            assert!(kept == old || kept == new, "cut {cut}: {kept:?}");
            news += usize::from(kept == new);
            assert_eq!(keep(&mut flash, &next), Ok(()), "cut {cut}");
            assert_eq!(found(&mut flash), next, "cut {cut}");
        }
        // The new one may be whole within its last word: some of that is padding, which no CRC is over.
        assert!(news <= WORD, "{news}");
    }
    on_either_flash!(check);
}

/// The same of a first description: it is there, or none is.
#[test]
fn law_a_power_cut_in_the_first_description_leaves_none_or_all_of_it() {
    fn check<const PAGE: usize, const WORD: usize>() {
        let (flash, new) = (EmulatedFlash::<PAGE, WORD>::new(), description(3, 1));
        let bytes = bytes_of_work(&flash, |flash| assert_eq!(keep(flash, &new), Ok(())));
        for cut in EmulatedFlash::<PAGE, WORD>::SLOT..bytes {
            let mut flash = EmulatedFlash { power: Some(cut), noise: cut as u32, ..flash.clone() };
            assert_eq!(keep(&mut flash, &new), Err(NotStored), "cut {cut}");
            flash.power = None;
            let kept = found(&mut flash);
            assert!(kept.is_empty() || kept == new, "cut {cut}: {kept:?}");
        }
    }
    on_either_flash!(check);
}

/// The power fails at every byte while a description is forgotten: it is there, or none is, and never one before it.
#[test]
fn law_a_power_cut_while_forgetting_brings_no_older_description_back() {
    fn check<const PAGE: usize, const WORD: usize>() {
        for is_first in [false, true] {
            let (mut flash, mut old) = with_two::<PAGE, WORD>();
            if is_first {
                // The newest is in the other slot.
                old = description(3, 1);
                assert_eq!(keep(&mut flash, &old), Ok(()));
            }
            let bytes = bytes_of_work(&flash, |flash| assert_eq!(Store::new(flash).forget(), Ok(())));
            assert_eq!(bytes, EmulatedFlash::<PAGE, WORD>::STORE);
            for cut in 0..bytes {
                let half_erased = [HalfErased::InOrder, HalfErased::Bits, HalfErased::Noise][cut % 3];
                let mut flash =
                    EmulatedFlash { power: Some(cut), half_erased, noise: cut as u32, ..flash.clone() };
                assert_eq!(Store::new(&mut flash).forget(), Err(NotStored), "cut {cut}");
                flash.power = None;
                let kept = found(&mut flash);
                assert!(kept.is_empty() || kept == old, "cut {cut}: {kept:?}");
                assert_eq!(Store::new(&mut flash).forget(), Ok(()));
                assert_eq!(found(&mut flash), []);
            }
        }
    }
    on_either_flash!(check);
}

/// What somebody else has left there is no description, and does not stand in the way of one.
#[test]
fn law_garbage_is_no_description() {
    fn check<const PAGE: usize, const WORD: usize>() {
        let new = description(3, 2);
        let mut flashes: Vec<EmulatedFlash<PAGE, WORD>> =
            (0..200).map(EmulatedFlash::<PAGE, WORD>::of_noise).collect();
        for byte in [0, 0x55, 0xaa, 0x01] {
            flashes.push(EmulatedFlash {
                bytes: vec![byte; EmulatedFlash::<PAGE, WORD>::STORE],
                ..EmulatedFlash::<PAGE, WORD>::new()
            });
        }
        for mut flash in flashes {
            assert_eq!(found(&mut flash), []);
            assert_eq!(keep(&mut flash, &new), Ok(()));
            assert_eq!(found(&mut flash), new);
        }
    }
    on_either_flash!(check);
}

/// One byte of the newest copy that is not as it was written: the copy before it counts.
#[test]
fn law_a_damaged_copy_does_not_count() {
    let mut flash = EmulatedFlash::<4096, 8>::new();
    let (old, new) = (description(1, 1), description(2, 1));
    assert_eq!(keep(&mut flash, &old), Ok(()));
    assert_eq!(keep(&mut flash, &new), Ok(()));
    let slot = EmulatedFlash::<4096, 8>::SLOT..EmulatedFlash::<4096, 8>::STORE;
    let last = slot.clone().rev().find(|&at| flash.bytes[at] != 0xff).unwrap();
    let mut olds = 0;
    for at in slot.start..=last {
        let mut flash = flash.clone();
        flash.bytes[at] ^= 0x10;
        let kept = found(&mut flash);
        // The page's mark and the padding of items tell nothing.
        assert!(kept == old || kept == new, "{at}");
        olds += usize::from(kept == old);
    }
    let bytes = part_bytes(&new) + Record::BYTES + 8 * (new.len() + 1);
    assert_eq!(olds, bytes, "every byte of a part, of the record, and of the header of either");
}

/// A word of the newest copy whose error correction fails, whichever it is: the copy before it counts, and the next one
/// is kept.
#[test]
fn law_a_word_that_cannot_be_read_makes_no_copy() {
    let mut flash = EmulatedFlash::<8192, 32>::new();
    let (old, new, next) = (description(1, 1), description(2, 1), description(3, 1));
    assert_eq!(keep(&mut flash, &old), Ok(()));
    assert_eq!(keep(&mut flash, &new), Ok(()));
    let last = flash.bytes.iter().rposition(|&byte| byte != 0xff).unwrap();
    for word in 8192 / 32..=last / 32 {
        let mut flash = flash.clone();
        flash.unreadable[word] = true;
        assert_eq!(found(&mut flash), old, "{word}");
        assert_eq!(keep(&mut flash, &next), Ok(()), "{word}");
        assert_eq!(found(&mut flash), next, "{word}");
    }
}

/// Every other description goes into the same slot, so both wear alike, and the newest counts however many there were.
#[test]
fn law_both_slots_wear_alike() {
    fn check<const PAGE: usize, const WORD: usize>() {
        let mut flash = EmulatedFlash::<PAGE, WORD>::new();
        for count in 0..100 {
            let messages = description(count % 30, count % 17);
            assert_eq!(keep(&mut flash, &messages), Ok(()));
            assert_eq!(found(&mut flash), messages);
        }
        assert_eq!(flash.erasures, [50, 50]);
    }
    on_either_flash!(check);
}

/// A cell that is worn, wherever it is, and stays zero, which a flash notices, or one, which it does not: the board
/// says so or it does not matter, and what is kept is whole.
#[test]
fn law_a_worn_cell_is_found_out() {
    fn check<const PAGE: usize, const WORD: usize>() {
        let (flash, old) = with_two::<PAGE, WORD>();
        let new = description(3, 1);
        for stays in [0, 0xff] {
            let mut refused = 0;
            for at in 0..EmulatedFlash::<PAGE, WORD>::SLOT {
                let mut flash = EmulatedFlash { broken: Some((at, stays)), ..flash.clone() };
                let is_kept = keep(&mut flash, &new).is_ok();
                refused += usize::from(!is_kept);
                assert_eq!(&found(&mut flash), if is_kept { &new } else { &old }, "{at}");
            }
            // Few bytes of a description are zero or all ones by themselves.
            assert!(refused > part_bytes(&new) / 2, "{stays}: {refused}");
        }
    }
    on_either_flash!(check);
}

/// Puts a copy of another version into a slot.
fn write_other(flash: &mut EmulatedFlash, slot: Slot, version: u8, generation: u32) {
    let part = [0xab; 20];
    let mut digest = DescriptionDigest::default();
    digest.update(&part);
    write_copy(flash, slot, part, Record { version, generation, parts: 1, digest: digest.finalize() });
}

fn write_copy(flash: &mut EmulatedFlash, slot: Slot, part: [u8; 20], record: Record) {
    let mut queue = QueueStorage::new(flash, slot.queue().unwrap(), Cache::new_uncached());
    at_once(queue.erase_all()).unwrap();
    at_once(queue.push(&part, false)).unwrap();
    at_once(queue.push(&record.bytes(), false)).unwrap();
}

/// A copy of another version is as none, and known; also where an older one of this version stands beside it.
#[test]
fn exact_another_version_is_none_and_told() {
    let (mut flash, _) = with_two::<4096, 8>();
    write_other(&mut flash, Slot::First, VERSION + 1, 9);
    let other = KeptDescription::OtherVersion { version: VERSION + 1 };
    let mut store = Store::new(&mut flash);
    assert_eq!(store.kept(), other);
    store.read(|part| panic!("{part:?}"));
    let new = description(3, 1);
    assert_eq!(keep(&mut flash, &new), Ok(()));
    assert_eq!(found(&mut flash), new);
}

/// Items that are whole one by one, of two copies: a part of another, and one too few.
#[test]
fn law_a_record_of_other_parts_makes_no_copy() {
    let part = [0xab; 20];
    let mut digest = DescriptionDigest::default();
    digest.update(&part);
    let record = Record { version: VERSION + 1, generation: 9, parts: 1, digest: digest.finalize() };
    let other = KeptDescription::OtherVersion { version: VERSION + 1 };
    for (record, expected) in [
        (record, other),
        (Record { parts: 2, ..record }, KeptDescription::Nothing),
        (Record { digest: record.digest ^ 1, ..record }, KeptDescription::Nothing),
    ] {
        let mut flash = EmulatedFlash::new();
        write_copy(&mut flash, Slot::First, part, record);
        assert_eq!(Store::new(&mut flash).kept(), expected, "{record:?}");
    }
}

/// The count of copies begins anew after 2^32: the newest still counts.
#[test]
fn exact_the_generation_wraps() {
    let mut flash = EmulatedFlash::new();
    write_other(&mut flash, Slot::First, VERSION, u32::MAX - 1);
    for latency_ticks in 0..4 {
        let new = description(latency_ticks, 1);
        assert_eq!(keep(&mut flash, &new), Ok(()));
        assert_eq!(found(&mut flash), new);
    }
}

/// What happens to a board.
#[derive(Clone, Copy, Debug)]
enum Event {
    Keep(u8, u8),
    Forget,
    /// The power fails after so many bytes of work of what comes next.
    Cut(usize),
}

fn event() -> impl Strategy<Value = Event> {
    prop_oneof![
        (0..40_u8, 0..5_u8).prop_map(|(latency_ticks, rows)| Event::Keep(latency_ticks, rows)),
        Just(Event::Forget),
        (0..2 * EmulatedFlash::<8192, 32>::STORE).prop_map(Event::Cut),
    ]
}

fn check_sequence<const PAGE: usize, const WORD: usize>(
    events: &[Event],
    noise: u32,
) -> Result<(), TestCaseError> {
    let mut flash = EmulatedFlash::<PAGE, WORD> { noise, ..EmulatedFlash::new() };
    let (mut before, mut power) = (Vec::new(), None);
    for &event in events {
        flash.half_erased =
            [HalfErased::InOrder, HalfErased::Bits, HalfErased::Noise][flash.noise as usize % 3];
        flash.power = power.take();
        let (asked, done) = match event {
            Event::Keep(latency_ticks, rows) => {
                let messages = description(latency_ticks, rows);
                let done = keep(&mut flash, &messages);
                (messages, done)
            }
            Event::Forget => (Vec::new(), Store::new(&mut flash).forget()),
            Event::Cut(bytes) => {
                power = Some(bytes);
                continue;
            }
        };
        flash.power = None;
        let kept = found(&mut flash);
        prop_assert!(kept == asked || done.is_err() && kept == before, "{:?} {:?}", event, done);
        before = kept;
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(200) })]

    /// Any sequence of descriptions that are kept and forgotten, and of losses of power: what is found is what was
    /// found before, or what was asked for.
    #[test]
    fn law_any_sequence_leaves_what_was_there_or_what_was_asked_for(
        events in prop::collection::vec(event(), 1..30), noise: u32
    ) {
        check_sequence::<4096, 8>(&events, noise)?;
        check_sequence::<8192, 32>(&events, noise)?;
    }
}
