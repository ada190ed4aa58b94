use super::*;

/// A frame of 3 ms ago was 3 ms ago by the host's clock too, whatever the time of day was set to before.
#[test]
fn exact_times_of_day_by_the_host_s_clock() {
    for day_nanos in [0, 1_795_000_000_000_000_000] {
        assert_eq!(by_host_clock(day_nanos - 3_000_000, 7_000_000, day_nanos), 4_000_000);
    }
    assert_eq!(by_host_clock(9_000_000_000_000_000_000, i64::MAX, 0), i64::MAX);
    let before = host_nanos();
    assert!((0..1_000_000_000).contains(&(host_nanos() - before)));
}
