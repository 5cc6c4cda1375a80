//! Time for benchmarks: what one thread spent on a processor, which a busy machine disturbs less than the clock.

#![allow(dead_code, reason = "each benchmark uses a part of it")]

use std::hint::black_box;
use std::time::{Duration, Instant};

/// Time that this thread spent on a processor, where the system tells. It comes in steps of some milliseconds.
pub fn cpu_seconds() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    Some(text.split(' ').next()?.parse::<u64>().ok()? as f64 * 1e-9)
}

/// The time of `runs` calls together on this thread; by the clock where the system does not tell.
pub fn together(runs: usize, mut f: impl FnMut()) -> Duration {
    let (clock, cpu) = (Instant::now(), cpu_seconds());
    (0..runs).for_each(|_| f());
    match (cpu, cpu_seconds()) {
        (Some(start), Some(end)) => Duration::from_secs_f64(end - start),
        _ => clock.elapsed(),
    }
}

/// The median time of one call; quick calls are repeated until the steps of the counter do not matter.
pub fn median<T>(runs: usize, mut f: impl FnMut() -> T) -> Duration {
    let once = Instant::now();
    black_box(f());
    let repeat = (0.05 / once.elapsed().as_secs_f64()).clamp(1.0, 1024.0) as usize;
    let mut times: Vec<Duration> =
        (0..runs).map(|_| together(repeat, || drop(black_box(f()))) / repeat as u32).collect();
    times.sort();
    times[runs / 2]
}

/// Everything in `f` on one thread, the one whose time is taken.
pub fn on_one_thread<T: Send>(f: impl FnOnce() -> T + Send) -> Result<T, rayon::ThreadPoolBuildError> {
    Ok(rayon::ThreadPoolBuilder::new().num_threads(1).build()?.install(f))
}
