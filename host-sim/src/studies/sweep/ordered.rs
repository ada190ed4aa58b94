//! Values made on all threads, and given out in the order of their numbers.

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

/// Values that wait for an earlier one, at most: about ten megabytes of rows.
const WAITING_MAX: usize = 1 << 16;

/// What the threads share.
struct Shared<T, E, F> {
    /// The next number that a thread takes.
    taken: u64,
    /// The next number that is given out.
    given: u64,
    waiting: BTreeMap<u64, T>,
    take: F,
    refused: Option<E>,
}

/// Makes the values of `numbers` by `make` on all threads, and gives them to `take` in their order, until `stop` is set
/// or `take` refuses one. Returns the number after the last that was given out.
///
/// A thread waits before it takes a number when [`WAITING_MAX`] values wait for an earlier one; the thread that makes
/// the earlier one does not wait.
///
/// # Errors
/// That of `take`.
pub fn run<T: Send, E: Send>(
    numbers: Range<u64>,
    stop: &AtomicBool,
    make: impl Fn(u64) -> T + Sync,
    take: impl FnMut(T) -> Result<(), E> + Send,
) -> Result<u64, E> {
    let shared = Mutex::new(Shared {
        taken: numbers.start,
        given: numbers.start,
        waiting: BTreeMap::new(),
        take,
        refused: None,
    });
    let fewer_wait = Condvar::new();
    rayon::broadcast(|_| {
        loop {
            let mut state = locked(&shared);
            while state.waiting.len() >= WAITING_MAX && state.refused.is_none() {
                state = fewer_wait.wait(state).unwrap_or_else(PoisonError::into_inner);
            }
            if stop.load(Ordering::Relaxed) || state.refused.is_some() || state.taken >= numbers.end {
                return;
            }
            let number = state.taken;
            state.taken += 1;
            drop(state);
            let value = make(number);
            let mut state = locked(&shared);
            state.waiting.insert(number, value);
            state.give();
            drop(state);
            fewer_wait.notify_all();
        }
    });
    let state = shared.into_inner().unwrap_or_else(PoisonError::into_inner);
    state.refused.map_or(Ok(state.given), Err)
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl<T, E, F: FnMut(T) -> Result<(), E>> Shared<T, E, F> {
    /// Gives out what is next.
    fn give(&mut self) {
        while self.refused.is_none() {
            let Some(value) = self.waiting.remove(&self.given) else { return };
            match (self.take)(value) {
                Ok(()) => self.given += 1,
                Err(error) => self.refused = Some(error),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::convert::Infallible;
    use std::time::Duration;

    /// Early numbers take longest, so that many wait: they come out in order, each once, on any number of threads.
    #[test]
    fn exact_values_come_in_the_order_of_their_numbers() {
        for threads in [1, 2, 7] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let mut found = Vec::new();
            let make = |number: u64| {
                if number % 50 == 10 {
                    std::thread::sleep(Duration::from_millis(2));
                }
                number
            };
            let take = |number| {
                found.push(number);
                Ok::<(), Infallible>(())
            };
            let end = pool.install(|| run(10..310, &AtomicBool::new(false), make, take));
            assert_eq!((end, found), (Ok(310), (10..310).collect()));
        }
    }

    /// A stop, or a value that is refused, ends it after the numbers under way: of three threads one has given out the
    /// last number before the stop, and the others are at the next two.
    #[test]
    fn exact_a_stop_keeps_a_whole_beginning() {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build().unwrap();
        let stop = AtomicBool::new(false);
        let mut found = Vec::new();
        let end = pool.install(|| {
            run(
                0..1000,
                &stop,
                |number| {
                    // Else a thread that the machine lets wait with an early number has all others made meanwhile.
                    while number > 40 && !stop.load(Ordering::Relaxed) {
                        std::thread::yield_now();
                    }
                    number
                },
                |number: u64| {
                    found.push(number);
                    if number == 40 {
                        stop.store(true, Ordering::Relaxed);
                    }
                    Ok::<(), Infallible>(())
                },
            )
        });
        let Ok(end) = end;
        assert!((41..=43).contains(&end), "{end}");
        assert_eq!(found, (0..end).collect::<Vec<_>>());
        let take = |number: u64| if number == 7 { Err("full") } else { Ok(()) };
        assert_eq!(pool.install(|| run(0..100, &AtomicBool::new(false), |number| number, take)), Err("full"));
    }
}
