//! B3: a line that brings the same byte again and again.

use super::*;

/// Bytes that the line brings in a tick.
const BYTES_PER_TICK: usize = LINE_BAUD as usize / 10 / (1_000_000_000 / PositionLoop::TICK_NANOS as usize);

/// Held low, and stuck at bytes of a frame: none of it is a frame, so that the host is silent, and the bridge is off
/// within 10 ms. When the line works again it stays off, until the host stops and arms.
#[test]
fn law_a_byte_stuck_on_the_line_takes_the_bridge_off() {
    for stuck in [0, 1, 0x55, 0xFF] {
        let mut bench = Bench::driving();
        let mut answers = 0;
        for _ in 0..1001 {
            bench.loop_task.receive(&[stuck; BYTES_PER_TICK], &mut |_| answers += 1);
            bench.run(1);
        }
        assert!(!bench.is_on() && answers == 0, "{stuck:#x}: {answers} answers");
        let silent = BoardMessage::Fault(BoardFault::HostSilent);
        assert_eq!(bench.received.iter().filter(|received| **received == silent).count(), 1, "{stuck:#x}");
        let measure = |bench: &mut Bench| {
            (0..5000).any(|_| {
                bench.rest(bench.loop_task.last_interrupt + 1);
                bench.is_on()
            })
        };
        assert!(!measure(&mut bench), "{stuck:#x}: it drives untold");
        assert_eq!(bench.exchange(&HostMessage::Stop), [BoardMessage::Stopped]);
        assert_eq!(bench.exchange(&HostMessage::Arm), [BoardMessage::Armed]);
        assert!(measure(&mut bench), "{stuck:#x}: it does not drive when told");
    }
}
