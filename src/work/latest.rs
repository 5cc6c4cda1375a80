//! A slot for results that follow the user's hand (previews, hover queries).

use super::jobs::{Jobs, Lane, Outcome, Ticket};
use crate::kernel::job::Job;

/// The newest value of something that is computed again and again. A new request cancels the one before; the
/// last value stays, marked stale, until the next is there, so that the picture never flashes empty.
#[derive(Debug)]
pub struct Latest<T> {
    value: Option<T>,
    running: Option<Ticket<T>>,
    error: Option<String>,
}

impl<T> Default for Latest<T> {
    fn default() -> Self {
        Self { value: None, running: None, error: None }
    }
}

impl<T: Send + 'static> Latest<T> {
    /// Asks for a new value and cancels what was asked for before.
    pub fn request(
        &mut self,
        jobs: &mut Jobs,
        name: &str,
        input: impl Into<String>,
        work: impl FnOnce(&Job) -> T + Send + 'static,
    ) {
        if let Some(old) = self.running.take() {
            old.cancel();
        }
        self.running = Some(jobs.spawn(Lane::Preview, name, input, work));
    }

    /// Takes over a result that has arrived; true when the value changed.
    pub fn poll(&mut self) -> bool {
        let Some(outcome) = self.running.as_ref().and_then(Ticket::poll) else { return false };
        self.running = None;
        match outcome {
            Outcome::Finished { value, cancelled: false } => {
                (self.value, self.error) = (Some(value), None);
                true
            }
            Outcome::Finished { .. } | Outcome::NeverRan => false,
            Outcome::Panicked { message, .. } => {
                self.error = Some(message);
                true
            }
        }
    }

    /// The last value, stale or not.
    pub fn value(&self) -> Option<&T> {
        self.value.as_ref()
    }

    /// Whether a newer value is on its way.
    pub fn is_stale(&self) -> bool {
        self.running.is_some()
    }

    /// What the last computation died of, if it did.
    pub fn error(&self) -> Option<&str> {
        self.error.as_deref()
    }

    /// Cancels what runs and forgets the value.
    pub fn clear(&mut self) {
        if let Some(old) = self.running.take() {
            old.cancel();
        }
        *self = Self::default();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::{Duration, Instant};

    fn settle<T: Send + 'static>(latest: &mut Latest<T>) {
        let start = Instant::now();
        while latest.is_stale() && start.elapsed() < Duration::from_secs(10) {
            latest.poll();
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    #[test]
    fn only_the_newest_request_counts_and_the_old_value_stays_meanwhile() {
        let mut jobs = Jobs::new(|| {});
        let mut latest = Latest::default();
        latest.request(&mut jobs, "first", "", |_| 1);
        settle(&mut latest);
        assert_eq!(latest.value(), Some(&1));
        latest.request(&mut jobs, "slow", "", |job| {
            while !job.is_cancelled() {
                std::thread::sleep(Duration::from_millis(1));
            }
            2
        });
        assert_eq!(latest.value(), Some(&1));
        latest.request(&mut jobs, "third", "", |_| 3);
        settle(&mut latest);
        assert_eq!(latest.value(), Some(&3));
        latest.clear();
        assert_eq!(latest.value(), None);
    }
}
