//! What a long computation is handed: a way to be cancelled, to say how far it is, and to warn.
//!
//! A [`Job`] is cheap to clone; clones share everything. Cancelling is a status, not an error: a function that
//! sees [`Job::is_cancelled`] returns what it has and marks it incomplete.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::{fmt, sync::Arc};

/// A handle on a running computation. See the module's text.
#[derive(Clone)]
pub struct Job {
    shared: Arc<Shared>,
    /// What this handle's 0 and 1 are in the progress of the whole.
    range: [f64; 2],
}

impl Default for Job {
    fn default() -> Self {
        Self { shared: Arc::default(), range: [0.0, 1.0] }
    }
}

#[derive(Default)]
struct Shared {
    cancelled: AtomicBool,
    /// Bits of an `f64` in 0..=1; only ever raised (non-negative floats order like their bits).
    progress: AtomicU64,
    phase: Mutex<String>,
    warnings: Mutex<Vec<String>>,
}

impl Job {
    /// A job that nobody watches.
    pub fn new() -> Self {
        Self::default()
    }

    /// Asks the computation to stop. It does so within about 10 ms.
    pub fn cancel(&self) {
        self.shared.cancelled.store(true, Ordering::Relaxed);
    }

    /// Whether somebody asked the computation to stop.
    pub fn is_cancelled(&self) -> bool {
        self.shared.cancelled.load(Ordering::Relaxed)
    }

    /// Reports how much of the work is done, 0..=1. Progress never goes back: a smaller or non-finite value
    /// is ignored.
    pub fn progress(&self, done: f64) {
        if done >= 0.0 {
            let [from, to] = self.range;
            let done = from + (to - from) * done.min(1.0);
            self.shared.progress.fetch_max(done.to_bits(), Ordering::Relaxed);
        }
    }

    /// A handle for a part of the work, whose progress 0..=1 is `from..=to` of this one's. Everything else is shared.
    #[must_use]
    pub fn part(&self, from: f64, to: f64) -> Self {
        let at = |t: f64| self.range[0] + (self.range[1] - self.range[0]) * t.clamp(0.0, 1.0);
        Self { shared: Arc::clone(&self.shared), range: [at(from), at(to)] }
    }

    /// The largest progress reported so far.
    pub fn done(&self) -> f64 {
        f64::from_bits(self.shared.progress.load(Ordering::Relaxed))
    }

    /// Names what is being done now ("Projecting", "Fitting").
    pub fn phase(&self, name: &str) {
        let mut phase = lock(&self.shared.phase);
        if *phase != name {
            name.clone_into(&mut phase);
        }
    }

    /// The phase named last.
    pub fn current_phase(&self) -> String {
        lock(&self.shared.phase).clone()
    }

    /// Records something the user should know about the result.
    pub fn warn(&self, warning: impl Into<String>) {
        lock(&self.shared.warnings).push(warning.into());
    }

    /// The warnings so far, in the order in which they came.
    pub fn warnings(&self) -> Vec<String> {
        lock(&self.shared.warnings).clone()
    }
}

/// A poisoned lock only means that a worker panicked elsewhere; the texts behind it are still whole.
fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}

impl fmt::Debug for Job {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Job").field("cancelled", &self.is_cancelled()).field("done", &self.done()).finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn progress_is_monotone_and_clamped() {
        let job = Job::new();
        for value in [0.2, 0.1, f64::NAN, -3.0] {
            job.progress(value);
        }
        assert_eq!(job.done(), 0.2);
        job.progress(7.0);
        assert_eq!(job.done(), 1.0);
    }

    #[test]
    fn a_part_reports_its_share() {
        let job = Job::new();
        let second = job.part(0.5, 1.0).part(0.0, 0.5);
        second.progress(0.0);
        assert_eq!(job.done(), 0.5);
        second.progress(1.0);
        assert_eq!(job.done(), 0.75);
        second.cancel();
        assert!(job.is_cancelled());
    }

    #[test]
    fn clones_share_cancellation_and_warnings() {
        let job = Job::new();
        let other = job.clone();
        other.warn("thin");
        other.cancel();
        assert!(job.is_cancelled());
        assert_eq!(job.warnings(), ["thin"]);
    }
}
