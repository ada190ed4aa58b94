//! The description that is kept: by whom it is in force, and when it is refused.

use controller::map_correction::{LearntFactor, LearntFactors};
use estimator::{CameraDescription, Instruments, ResonanceOffset};
use link::{
    DescriptionDigest, DescriptionDigests, KeptDescription, MapFault, MotorParameterRecord,
    description_messages,
};
use motor_model::Parameter;

use super::*;

/// A timing of this latency.
fn latency(latency_ticks: u8) -> LoopTiming {
    LoopTiming { latency_ticks, decision_ticks: 4 }
}
use crate::store::Store;
use crate::store::emulated_flash::EmulatedFlash;
use crate::test_support::{map_of, other_design};

/// A bench whose board has a flash, which outlives it.
struct KeepingBench<'f> {
    bench: Bench,
    store: Store<&'f mut EmulatedFlash>,
}

impl<'f> KeepingBench<'f> {
    /// A board that has just started.
    fn start(flash: &'f mut EmulatedFlash) -> Self {
        let (mut bench, mut store) = (Bench::new(), Store::new(flash));
        bench.board.restore(&mut store);
        Self { bench, store }
    }

    /// The answers to a message, those of the store included.
    fn exchange(&mut self, message: &HostMessage) -> Vec<BoardMessage> {
        let mut answers = self.bench.exchange(message);
        let Self { bench, store } = self;
        if bench.board.wants_store() {
            assert!(answers.is_empty(), "one answer");
            bench.board.use_store(store, &mut |frame| answers.push(decode(&mut frame.to_vec()).unwrap().1));
            assert!(!bench.board.wants_store());
        }
        answers
    }

    #[track_caller]
    fn answers(&mut self, message: &HostMessage, expected: &BoardMessage) {
        assert_eq!(self.exchange(message), std::slice::from_ref(expected), "{message:?}");
    }

    fn begin_session(&mut self) {
        self.bench.session += 1;
        self.answers(&HostMessage::Hello, &WELCOME);
    }

    /// Hello, configuration, arming, and a motor that turns.
    fn drive(&mut self) {
        self.begin_session();
        self.answers(&HostMessage::Configure(MOVE), &BoardMessage::Configured);
        self.answers(&HostMessage::Arm, &BoardMessage::Armed);
        self.bench.drive();
    }

    fn describe(&mut self, messages: &[HostMessage]) {
        for message in messages {
            self.answers(message, &BoardMessage::Described);
        }
    }

    fn digests(&mut self) -> (u64, KeptDescription) {
        match self.exchange(&HostMessage::Digest)[..] {
            [BoardMessage::Digests(DescriptionDigests { in_force, kept })] => (in_force, kept),
            ref other => panic!("{other:?}"),
        }
    }
}

/// Instruments, a latency, and a motor no parameter of which is Table 1's, with a map of so many rows in each table and
/// what was learnt of it.
fn description(rows: u8) -> Vec<HostMessage> {
    let camera = CameraDescription { period_nanos: 5_000_000, ..CameraDescription::default() };
    let instruments = Instruments { camera, vibrometer: None };
    let design = other_design();
    let factor = LearntFactor { value: 1.25, variance: 1e-3 };
    let learnt = LearntFactors {
        bursts: [factor; 5],
        step_walk_covariance: 5e-4,
        rates: [factor; 2],
        resonances: [ResonanceOffset { hz: 31.5, hz2: 40.0 }, ResonanceOffset { hz: -20.0, hz2: 90.0 }],
    };
    let map = map_of(design, rows).with_learnt(learnt).expect("within its bounds");
    description_messages(&design, instruments, latency(7), Some(&map)).collect()
}

fn digest_of(messages: &[HostMessage]) -> u64 {
    DescriptionDigest::of(messages.iter().cloned()).unwrap()
}

fn default_digest() -> u64 {
    let nominal = MotorParams::nominal();
    DescriptionDigest::of(description_messages(&nominal, Instruments::default(), LoopTiming::default(), None))
        .unwrap()
}

/// With a map of every length: the board that starts anew has the bench again before any host speaks, in every session,
/// and moves by it. The host can tell by the digest, whatever it has sent to describe it.
#[test]
fn law_a_kept_description_is_in_force_after_a_loss_of_power() {
    for rows in 0..=16 {
        let messages = description(rows);
        let digest = digest_of(&messages);
        let kept = KeptDescription::Whole { digest };
        let mut flash = EmulatedFlash::new();
        let mut before = KeepingBench::start(&mut flash);
        before.begin_session();
        assert_eq!(before.digests(), (default_digest(), KeptDescription::Nothing));
        before.describe(&messages);
        assert_eq!(before.digests(), (digest, KeptDescription::Nothing));
        before.answers(&HostMessage::Keep, &BoardMessage::Kept);
        assert_eq!(before.digests(), (digest, kept));
        let described = before.bench.board.bench;
        let map = *before.bench.board.memory.map.map().unwrap();

        let mut after = KeepingBench::start(&mut flash);
        for _ in 0..2 {
            let board = &after.bench.board;
            assert_eq!((board.bench.design, board.bench.timing.latency_ticks), (described.design, 7));
            assert_eq!(board.bench.instruments, described.instruments);
            assert_eq!(board.memory.map.map(), Ok(&map));
            after.begin_session();
            assert_eq!(after.digests(), (digest, kept));
        }
        after.answers(&HostMessage::Configure(MOVE), &BoardMessage::Configured);
        after.answers(&HostMessage::Arm, &BoardMessage::Armed);
        assert_eq!(after.bench.board.amplifier().design, described.design);
        assert_eq!(after.bench.board.amplifier().timing.latency_ticks, 7);
    }
}

/// What a host describes is in force for its session alone, and is not kept unless it asks. It is all that is in force:
/// what it leaves out is the default's, and not what was kept.
#[test]
fn law_a_host_s_description_is_in_force_for_its_session() {
    let messages = description(3);
    let kept = KeptDescription::Whole { digest: digest_of(&messages) };
    let mut flash = EmulatedFlash::new();
    let mut bench = KeepingBench::start(&mut flash);
    bench.begin_session();
    bench.describe(&messages);
    bench.answers(&HostMessage::Keep, &BoardMessage::Kept);
    let design = MotorParams::nominal();
    for map in [Some(ResponseMap::table_1()), None] {
        let other: Vec<_> = description_messages(&design, Instruments::default(), latency(2), map).collect();
        bench.begin_session();
        bench.describe(&other);
        assert_eq!(bench.digests(), (digest_of(&other), kept));
        bench.answers(&HostMessage::Configure(MOVE), &BoardMessage::Configured);
        assert_eq!(bench.bench.board.amplifier().design, design);
        bench.begin_session();
        assert_eq!(bench.digests(), (digest_of(&messages), kept));
    }
}

/// A description that begins drops the configuration, which is of another bench; while armed it is refused.
#[test]
fn law_a_description_that_begins_drops_the_configuration() {
    let mut bench = Bench::driving();
    assert_eq!(bench.exchange(&HostMessage::DescriptionBegin), fault(BoardFault::Armed));
    assert!(!bench.off());
    bench.exchange(&HostMessage::Stop);
    assert_eq!(bench.exchange(&HostMessage::DescriptionBegin), [BoardMessage::Described]);
    assert_eq!(bench.exchange(&HostMessage::Arm), fault(BoardFault::NotReady));
}

/// The default is in force from then on, in this session, in the next, and after a loss of power.
#[test]
fn law_a_forgotten_description_is_the_default_one() {
    let mut flash = EmulatedFlash::new();
    let mut bench = KeepingBench::start(&mut flash);
    bench.begin_session();
    bench.describe(&description(3));
    bench.answers(&HostMessage::Keep, &BoardMessage::Kept);
    bench.answers(&HostMessage::Configure(MOVE), &BoardMessage::Configured);
    bench.answers(&HostMessage::Forget, &BoardMessage::Forgotten);
    let nothing = (default_digest(), KeptDescription::Nothing);
    assert_eq!(bench.digests(), nothing);
    bench.answers(&HostMessage::Arm, &BoardMessage::Fault(BoardFault::NotReady));
    bench.begin_session();
    assert_eq!(bench.digests(), nothing);
    let mut bench = KeepingBench::start(&mut flash);
    bench.begin_session();
    assert_eq!(bench.digests(), nothing);
}

/// While armed nothing of it happens: the flash is as it was, and the loop drives on.
#[test]
fn law_an_armed_board_neither_keeps_nor_forgets() {
    let mut flash = EmulatedFlash::new();
    let mut bench = KeepingBench::start(&mut flash);
    bench.drive();
    for message in [HostMessage::Keep, HostMessage::Forget, HostMessage::Digest] {
        // At once: the store, and the longer patience of the watchdog, have no part in it.
        assert_eq!(bench.bench.exchange(&message), fault(BoardFault::Armed));
        assert!(!bench.bench.off() && !bench.bench.board.wants_store());
    }
    // Armed between the request and its turn: a program that takes many frames before it uses the store.
    bench.answers(&HostMessage::Stop, &BoardMessage::Stopped);
    assert!(bench.bench.exchange(&HostMessage::Keep).is_empty());
    bench.bench.exchange(&HostMessage::Arm);
    let mut answers = Vec::<BoardMessage>::new();
    let send = &mut |frame: &[u8]| answers.push(decode(&mut frame.to_vec()).unwrap().1);
    bench.bench.board.use_store(&mut bench.store, send);
    assert_eq!(answers, fault(BoardFault::Armed));
    assert!(bench.bench.board.is_armed());
    assert_eq!(flash.erasures, [0, 0]);
}

/// A hello switches an armed board's drive off at once, not when the store has its turn.
#[test]
fn law_a_session_that_begins_stops_the_drive_before_the_flash_is_read() {
    let mut flash = EmulatedFlash::new();
    let mut bench = KeepingBench::start(&mut flash);
    bench.drive();
    assert!(bench.bench.exchange(&HostMessage::Hello).is_empty());
    assert!(bench.bench.off() && !bench.bench.board.is_armed() && bench.bench.board.wants_store());
}

/// A board without a store says so, and welcomes a host as ever.
#[test]
fn law_a_board_without_a_store_keeps_nothing() {
    let mut bench = Bench::new();
    assert_eq!(bench.exchange(&HostMessage::Hello), [WELCOME]);
    for message in [HostMessage::Keep, HostMessage::Forget, HostMessage::Digest] {
        assert_eq!(bench.exchange(&message), fault(BoardFault::KeepsNothing));
        assert!(!bench.board.wants_store());
    }
}

/// A map that no move could be planned by is neither kept nor compared.
#[test]
fn law_an_unusable_map_is_not_kept() {
    let messages = description(3);
    let mut flash = EmulatedFlash::new();
    let mut bench = KeepingBench::start(&mut flash);
    bench.begin_session();
    let (end, begun) = messages.split_last().unwrap();
    bench.describe(begun);
    let rows = 3 * 6;
    let incomplete = BoardMessage::Fault(BoardFault::Map(MapFault::Incomplete { rows }));
    let asked = [HostMessage::Keep, HostMessage::Digest];
    for message in &asked {
        bench.answers(message, &incomplete);
    }
    let index = Parameter::RotorMass as u8;
    let mass = HostMessage::MotorParameter(MotorParameterRecord { index, value: 2e-4 });
    bench.describe(&[end.clone(), mass]);
    let other = BoardMessage::Fault(BoardFault::Map(MapFault::OtherDesign));
    for message in &asked {
        bench.answers(message, &other);
    }
    assert_eq!(flash.erasures, [0, 0]);
}

/// A kept description that this firmware refuses, whole as it is: a value out of bounds, a message that describes
/// nothing, a map without its end. The default one is in force.
#[test]
fn law_a_kept_description_that_is_refused_leaves_the_default_one() {
    let messages = description(3);
    let with = |message: HostMessage| messages.iter().cloned().chain([message]).collect::<Vec<_>>();
    let without_end = messages[..messages.len() - 1].to_vec();
    for messages in [
        with(HostMessage::Timing { latency_ticks: 255, decision_ticks: 1 }),
        with(HostMessage::Arm),
        without_end,
    ] {
        let mut flash = EmulatedFlash::new();
        Store::new(&mut flash).keep(messages.iter().cloned()).unwrap();
        let mut bench = KeepingBench::start(&mut flash);
        assert!(!bench.bench.board.is_armed());
        bench.begin_session();
        let kept = KeptDescription::Whole { digest: digest_of(&messages) };
        assert_eq!(bench.digests(), (default_digest(), kept));
        bench.answers(&HostMessage::Configure(MOVE), &BoardMessage::Configured);
    }
}

/// A flash that fails: the host is told, what is in force stays, and so does what was kept.
#[test]
fn law_a_flash_that_fails_is_told() {
    let messages = description(3);
    let mut flash = EmulatedFlash::new();
    Store::new(&mut flash).keep(messages.iter().cloned()).unwrap();
    let mut bench = KeepingBench::start(&mut flash);
    bench.begin_session();
    drop(bench);
    // A cell in the middle of the other slot.
    flash.broken = Some((crate::store::SLOT_BYTES as usize + 100, 0));
    let mut bench = KeepingBench::start(&mut flash);
    bench.begin_session();
    bench.describe(&[HostMessage::Timing { latency_ticks: 1, decision_ticks: 1 }]);
    bench.answers(&HostMessage::Keep, &BoardMessage::Fault(BoardFault::NotStored));
    let (_, kept) = bench.digests();
    assert_eq!(kept, KeptDescription::Whole { digest: digest_of(&messages) });
    assert_eq!(bench.bench.board.bench.timing.latency_ticks, 1);
}
