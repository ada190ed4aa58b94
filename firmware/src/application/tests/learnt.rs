//! What moves have learnt of the motor: in with the map, out by a question.

use controller::map_correction::{LearntFactor, LearntFactors};
use estimator::ResonanceOffset;
use link::{LearntRecord, MapFault, RateConfiguration, RateLimitsRecord, map_messages};

use super::*;

fn factors(value: f32) -> LearntFactors {
    let factor = LearntFactor { value, variance: 1e-3 };
    LearntFactors {
        bursts: [factor; 5],
        step_walk_covariance: 5e-4,
        rates: [factor; 2],
        resonances: [ResonanceOffset { hz: 31.5, hz2: 40.0 }, ResonanceOffset { hz: -20.0, hz2: 90.0 }],
    }
}

fn told(factors: LearntFactors) -> [BoardMessage; 1] {
    [BoardMessage::Learnt(factors.into())]
}

/// A move by the map of one motor begins with what was learnt of it, before and after arming and after a stop, until
/// another map is described.
#[test]
fn exact_a_move_begins_with_what_was_learnt() {
    let mut bench = Bench::new();
    bench.exchange(&HostMessage::Hello);
    assert_eq!(bench.exchange(&HostMessage::Learnt), [BoardMessage::Fault(BoardFault::NoMove)]);
    bench.describe_map(&ResponseMap::table_1().with_learnt(factors(1.25)).unwrap());
    assert_eq!(bench.exchange(&HostMessage::Configure(MOVE)), [BoardMessage::Configured]);
    assert_eq!(bench.exchange(&HostMessage::Learnt), told(factors(1.25)));
    assert_eq!(bench.exchange(&HostMessage::Arm), [BoardMessage::Armed]);
    assert_eq!(bench.exchange(&HostMessage::Learnt), told(factors(1.25)));
    bench.exchange(&HostMessage::Stop);
    assert_eq!(bench.exchange(&HostMessage::Learnt), told(factors(1.25)));
    bench.describe_map(ResponseMap::table_1());
    bench.exchange(&HostMessage::Configure(MOVE));
    let [BoardMessage::Learnt(prior)] = bench.exchange(&HostMessage::Learnt)[..] else {
        panic!("no factors")
    };
    assert!(prior.factors.iter().all(|[value, _]| value.to_bits() == 1.0_f32.to_bits()), "{prior:?}");
}

/// What no motor has is refused, and leaves what came before it; a rate tells it as well.
#[test]
fn law_what_no_motor_has_is_refused() {
    let mut bench = Bench::new();
    bench.exchange(&HostMessage::Hello);
    let refused = |fault| [BoardMessage::Fault(BoardFault::Map(fault))];
    let learnt = |value| HostMessage::MapLearnt(LearntRecord::from(factors(value)));
    assert_eq!(bench.exchange(&learnt(1.25)), refused(MapFault::Incomplete { rows: 0 }));
    let messages: Vec<_> = map_messages(ResponseMap::table_1()).collect();
    let (end, begun) = messages.split_last().unwrap();
    for message in begun {
        assert_eq!(bench.exchange(message), [BoardMessage::Described]);
    }
    assert_eq!(bench.exchange(&learnt(1.25)), [BoardMessage::Described]);
    for wrong in [0.09, 4.01, f32::NAN] {
        assert_eq!(bench.exchange(&learnt(wrong)), refused(MapFault::Learnt));
    }
    assert_eq!(bench.exchange(end), [BoardMessage::Described]);
    bench.exchange(&HostMessage::Configure(MOVE));
    assert_eq!(bench.exchange(&HostMessage::Learnt), told(factors(1.25)));
    let limits = RateLimitsRecord {
        travel_deg: None,
        on_max_nanos: None,
        amplitude_max: None,
        progress_window_nanos: None,
    };
    let filter = MOVE.filter;
    let rate = RateConfiguration { filter, rate_deg_s: 50.0, duration_nanos: 1_000_000_000, limits };
    assert_eq!(bench.exchange(&HostMessage::ConfigureRate(rate)), [BoardMessage::Configured]);
    assert_eq!(bench.exchange(&HostMessage::Learnt), told(factors(1.25)));
}
