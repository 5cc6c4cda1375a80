//! The job queue and its record of what ran, for the status line and the Jobs panel.

use std::any::Any;
use std::collections::VecDeque;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::{Receiver, Sender, TryRecvError, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use crate::kernel::job::Job;

/// How many finished jobs the record keeps.
const KEPT: usize = 200;

/// Names one job of a session.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct JobId(pub u64);

/// Which queue a job waits in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lane {
    /// One after the other.
    Heavy,
    /// Beside the heavy ones, so that it is never kept waiting by them.
    Preview,
}

/// How far a job is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum State {
    /// It waits for the jobs before it.
    Queued,
    /// It runs.
    Running,
    /// It came to its end.
    Done,
    /// It stopped because somebody asked it to; what it had is kept.
    Cancelled,
    /// It panicked, with this message.
    Panicked(String),
}

/// What the Jobs panel shows of one job.
#[derive(Clone, Debug)]
pub struct JobRecord {
    /// Its number.
    pub id: JobId,
    /// What it does ("Heal nose").
    pub name: String,
    /// What it was given, for a bug report.
    pub input: String,
    /// Which queue it is in.
    pub lane: Lane,
    /// How far it is.
    pub state: State,
    /// When it was started.
    started: Option<Instant>,
    /// How long it took, once it has ended.
    pub took: Option<Duration>,
    /// Its handle: progress, phase, warnings, cancel.
    pub job: Job,
}

impl JobRecord {
    /// How long it has been running, or how long it took.
    pub fn elapsed(&self) -> Duration {
        self.took.or_else(|| self.started.map(|s| s.elapsed())).unwrap_or_default()
    }

    /// Whether it waits or runs.
    pub fn is_active(&self) -> bool {
        matches!(self.state, State::Queued | State::Running)
    }
}

/// What came of a job.
#[derive(Debug)]
pub enum Outcome<T> {
    /// Its result; `cancelled` says that it was asked to stop, so that the result may be partial.
    Finished {
        /// The result.
        value: T,
        /// Whether it was asked to stop.
        cancelled: bool,
    },
    /// It was cancelled before it began.
    NeverRan,
    /// It panicked, with this message and input.
    Panicked {
        /// What the panic said.
        message: String,
        /// What the job was given.
        input: String,
    },
}

/// The promise of a result.
#[derive(Debug)]
pub struct Ticket<T> {
    /// The job behind it.
    pub id: JobId,
    job: Job,
    receiver: Receiver<Outcome<T>>,
}

impl<T> Ticket<T> {
    /// The outcome, once and as soon as it is there. A worker that vanished counts as [`Outcome::NeverRan`].
    pub fn poll(&self) -> Option<Outcome<T>> {
        match self.receiver.try_recv() {
            Ok(outcome) => Some(outcome),
            Err(TryRecvError::Empty) => None,
            Err(TryRecvError::Disconnected) => Some(Outcome::NeverRan),
        }
    }

    /// Waits for the outcome (for scripts and tests, never on the window's thread).
    pub fn wait(&self) -> Outcome<T> {
        self.receiver.recv().unwrap_or(Outcome::NeverRan)
    }

    /// Asks the job to stop.
    pub fn cancel(&self) {
        self.job.cancel();
    }

    /// The job's handle.
    pub fn job(&self) -> &Job {
        &self.job
    }
}

type Task = Box<dyn FnOnce() + Send>;
type Records = Arc<Mutex<VecDeque<JobRecord>>>;
type Wake = Arc<dyn Fn() + Send + Sync>;

/// The queues of one session.
pub struct Jobs {
    heavy: Sender<Task>,
    preview: Sender<Task>,
    records: Records,
    wake: Wake,
    next: u64,
}

impl Jobs {
    /// Starts the workers. `wake` is called from a worker whenever a job has ended, so that a window repaints.
    pub fn new(wake: impl Fn() + Send + Sync + 'static) -> Self {
        Self {
            heavy: worker("heavy"),
            preview: worker("preview"),
            records: Records::default(),
            wake: Arc::new(wake),
            next: 0,
        }
    }

    /// Queues `work`. `input` is kept for the record and for error reports.
    pub fn spawn<T: Send + 'static>(
        &mut self,
        lane: Lane,
        name: impl Into<String>,
        input: impl Into<String>,
        work: impl FnOnce(&Job) -> T + Send + 'static,
    ) -> Ticket<T> {
        let (id, job, input) = (JobId(self.next), Job::new(), input.into());
        self.next += 1;
        let record = JobRecord {
            id,
            name: name.into(),
            input: input.clone(),
            lane,
            state: State::Queued,
            started: None,
            took: None,
            job: job.clone(),
        };
        {
            let mut records = lock(&self.records);
            records.push_back(record);
            while records.len() > KEPT && records.front().is_some_and(|r| !r.is_active()) {
                records.pop_front();
            }
        }
        let (sender, receiver) = channel();
        let (records, wake, handle) = (Arc::clone(&self.records), Arc::clone(&self.wake), job.clone());
        let task: Task = Box::new(move || {
            run(&records, id, &handle, input, work, |outcome| {
                let _nobody_waits_any_more = sender.send(outcome);
            });
            wake();
        });
        let queue = if lane == Lane::Heavy { &self.heavy } else { &self.preview };
        // A worker only ends with `self`; should it be gone, the dropped sender tells the ticket.
        let _gone = queue.send(task);
        Ticket { id, job, receiver }
    }

    /// All jobs that wait or run, and the last ones that ended, oldest first.
    pub fn records(&self) -> Vec<JobRecord> {
        lock(&self.records).iter().cloned().collect()
    }

    /// The jobs that wait or run.
    pub fn active(&self) -> Vec<JobRecord> {
        lock(&self.records).iter().filter(|r| r.is_active()).cloned().collect()
    }

    /// Asks one job to stop.
    pub fn cancel(&self, id: JobId) {
        if let Some(record) = lock(&self.records).iter().find(|r| r.id == id) {
            record.job.cancel();
        }
    }

    /// Asks every job to stop.
    pub fn cancel_all(&self) {
        for record in lock(&self.records).iter().filter(|r| r.is_active()) {
            record.job.cancel();
        }
    }
}

impl Drop for Jobs {
    fn drop(&mut self) {
        self.cancel_all();
    }
}

/// Runs a job. Its outcome is handed on while the record is locked: who sees the end finds the outcome, and who has the
/// outcome sees the end.
fn run<T>(
    records: &Records,
    id: JobId,
    job: &Job,
    input: String,
    work: impl FnOnce(&Job) -> T,
    hand_on: impl FnOnce(Outcome<T>),
) {
    if job.is_cancelled() {
        update(records, id, |r| {
            r.state = State::Cancelled;
            hand_on(Outcome::NeverRan);
        });
        return;
    }
    let start = Instant::now();
    update(records, id, |r| (r.state, r.started) = (State::Running, Some(start)));
    let result = catch_unwind(AssertUnwindSafe(|| work(job)));
    let cancelled = job.is_cancelled();
    let (state, outcome) = match result {
        Ok(value) if cancelled => (State::Cancelled, Outcome::Finished { value, cancelled }),
        Ok(value) => (State::Done, Outcome::Finished { value, cancelled }),
        Err(panic) => {
            let message = panic_message(panic.as_ref());
            (State::Panicked(message.clone()), Outcome::Panicked { message, input })
        }
    };
    update(records, id, |r| {
        (r.state, r.took) = (state, Some(start.elapsed()));
        hand_on(outcome);
    });
}

fn update(records: &Records, id: JobId, change: impl FnOnce(&mut JobRecord)) {
    if let Some(record) = lock(records).iter_mut().find(|r| r.id == id) {
        change(record);
    }
}

fn panic_message(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().map(|s| (*s).to_owned());
    text.or_else(|| panic.downcast_ref::<String>().cloned()).unwrap_or_else(|| "no message".to_owned())
}

fn worker(name: &str) -> Sender<Task> {
    let (sender, receiver) = channel::<Task>();
    let spawned = std::thread::Builder::new().name(format!("{name} jobs")).spawn(move || {
        for task in receiver {
            task();
        }
    });
    if let Err(error) = spawned {
        log::error!("no worker thread could be started: {error}");
    }
    sender
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_arrive_in_order_and_are_recorded() {
        let mut jobs = Jobs::new(|| {});
        let tickets: Vec<_> = (0..5).map(|i| jobs.spawn(Lane::Heavy, format!("job {i}"), "", move |_| i * i)).collect();
        for (i, ticket) in tickets.iter().enumerate() {
            assert!(matches!(ticket.wait(), Outcome::Finished { value, cancelled: false } if value == i * i));
        }
        assert!(jobs.active().is_empty());
        assert!(jobs.records().iter().all(|r| r.state == State::Done && r.took.is_some()));
    }

    #[test]
    fn a_panic_is_an_outcome_and_the_worker_lives_on() {
        let mut jobs = Jobs::new(|| {});
        let bad: Ticket<()> = jobs.spawn(Lane::Heavy, "bad", "the input", |_| panic!("a bug"));
        let Outcome::Panicked { message, input } = bad.wait() else { panic!("not caught") };
        assert_eq!((message.as_str(), input.as_str()), ("a bug", "the input"));
        let good = jobs.spawn(Lane::Heavy, "good", "", |_| 7);
        assert!(matches!(good.wait(), Outcome::Finished { value: 7, .. }));
    }

    #[test]
    fn cancelling_is_acknowledged_within_100_ms_and_keeps_what_was_done() {
        let mut jobs = Jobs::new(|| {});
        let (started, is_started) = channel();
        let ticket = jobs.spawn(Lane::Heavy, "endless", "", move |job| {
            started.send(()).unwrap();
            let mut done = 1;
            while !job.is_cancelled() {
                std::thread::sleep(Duration::from_millis(1));
                done += 1;
            }
            done
        });
        let queued = jobs.spawn(Lane::Heavy, "behind it", "", |_| ());
        is_started.recv().unwrap();
        queued.cancel();
        let asked = Instant::now();
        jobs.cancel(ticket.id);
        assert!(matches!(ticket.wait(), Outcome::Finished { value, cancelled: true } if value > 0));
        assert!(asked.elapsed() < Duration::from_millis(100));
        assert!(matches!(queued.wait(), Outcome::NeverRan));
    }

    #[test]
    fn a_preview_does_not_wait_for_a_heavy_job() {
        let mut jobs = Jobs::new(|| {});
        let (open, gate) = channel::<()>();
        let heavy = jobs.spawn(Lane::Heavy, "heavy", "", move |_| gate.recv().is_ok());
        let preview = jobs.spawn(Lane::Preview, "preview", "", |_| 1);
        assert!(matches!(preview.wait(), Outcome::Finished { value: 1, .. }));
        open.send(()).unwrap();
        assert!(matches!(heavy.wait(), Outcome::Finished { value: true, .. }));
    }
}
