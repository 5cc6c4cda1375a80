//! Where a subcommand says things: text for people on standard output, JSON for programs where `--json` says,
//! warnings and progress on standard error. When the JSON goes to standard output the text moves aside.

use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use serde::Serialize;

use super::CliError;
use crate::kernel::job::Job;

/// The options that every subcommand takes.
#[derive(Clone, Debug, Default, clap::Args)]
pub struct Common {
    /// Write the result as JSON to this file, or to standard output for `-`
    #[arg(long, global = true, value_name = "PATH")]
    pub json: Option<PathBuf>,
    /// Number of threads [default: one per core]; the result does not depend on it
    #[arg(long, global = true, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
}

impl Common {
    fn json_to_stdout(&self) -> bool {
        self.json.as_deref() == Some(Path::new("-"))
    }

    /// Prints a line for people. A reader that went away is no error.
    pub fn say(&self, line: impl AsRef<str>) {
        let _ = if self.json_to_stdout() {
            writeln!(std::io::stderr(), "{}", line.as_ref())
        } else {
            writeln!(std::io::stdout(), "{}", line.as_ref())
        };
    }

    /// Prints a line on standard error.
    pub fn warn(&self, line: impl AsRef<str>) {
        let _ = writeln!(std::io::stderr(), "{}", line.as_ref());
    }

    /// Writes the result as JSON where `--json` says; does nothing without it.
    pub fn json(&self, result: &impl Serialize) -> Result<(), CliError> {
        let Some(path) = &self.json else { return Ok(()) };
        let mut text = serde_json::to_string_pretty(result)?;
        text.push('\n');
        if self.json_to_stdout() {
            std::io::stdout().write_all(text.as_bytes())?;
        } else {
            std::fs::write(path, text)
                .map_err(|error| CliError::failed(format!("cannot write {}: {error}", path.display())))?;
        }
        Ok(())
    }
}

/// Shows the progress of a job on standard error, when that is a terminal, until it is dropped.
pub struct ProgressLine {
    stop: Arc<AtomicBool>,
    thread: Mutex<Option<std::thread::JoinHandle<()>>>,
}

impl ProgressLine {
    /// Starts watching.
    pub fn watch(job: &Job) -> Self {
        let stop = Arc::new(AtomicBool::new(false));
        let thread = std::io::stderr().is_terminal().then(|| {
            let (stop, job) = (Arc::clone(&stop), job.clone());
            std::thread::spawn(move || {
                while !stop.load(Ordering::Relaxed) {
                    let _ = write!(std::io::stderr(), "\r\x1b[K{:3.0} %  {}", 100.0 * job.done(), job.current_phase());
                    std::thread::sleep(Duration::from_millis(100));
                }
                let _ = write!(std::io::stderr(), "\r\x1b[K");
            })
        });
        Self { stop, thread: Mutex::new(thread) }
    }
}

impl Drop for ProgressLine {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Ok(mut thread) = self.thread.lock()
            && let Some(thread) = thread.take()
        {
            let _ = thread.join();
        }
    }
}
