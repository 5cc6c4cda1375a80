//! Ctrl-C (and a polite request to terminate): the first one cancels the running job, so that what was found so
//! far is still reported; the second one ends the program at once.

use std::sync::OnceLock;

use super::Exit;
use crate::kernel::job::Job;

static JOB: OnceLock<Job> = OnceLock::new();

/// The job of this run of the program, cancelled by Ctrl-C.
pub fn job() -> Job {
    JOB.get_or_init(|| {
        let job = Job::new();
        let watched = job.clone();
        let handler = move || {
            if watched.is_cancelled() {
                std::process::exit(Exit::Cancelled as i32);
            }
            watched.cancel();
            eprintln!("stopping; once more to stop at once");
        };
        if let Err(error) = ctrlc::set_handler(handler) {
            log::warn!("Ctrl-C cannot be caught and ends the program at once: {error}");
        }
        job
    })
    .clone()
}

/// Whether somebody stopped this run.
pub fn stopped() -> bool {
    JOB.get().is_some_and(Job::is_cancelled)
}
