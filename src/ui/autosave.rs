//! Puts every change aside for recovery, on a thread of its own, and offers what a crashed session left behind.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::SystemTime;

use super::dialogs::{Dialog, Problem, Recoverable};
use super::editor::Editor;
use super::files::file_name;
use crate::io::autosave::{Journal, Recovery, Session};
use crate::model::document::Document;

enum Message {
    Changed { document: Document, command: String, revision: u64 },
    File(Option<PathBuf>),
    SavedByUser,
}

/// The thread that puts changes aside. Without a journal nothing is put aside.
#[derive(Default)]
pub struct Autosave {
    sender: Option<Sender<Message>>,
    thread: Option<JoinHandle<()>>,
    /// The revision put aside last, plus one.
    done: Arc<AtomicU64>,
    error: Arc<Mutex<Option<String>>>,
    /// The revision handed over last.
    seen: Option<u64>,
}

impl Autosave {
    /// Starts a session in a journal.
    pub fn start(journal: &Journal) -> Self {
        let mut autosave = Self::default();
        let session = match journal.start(None) {
            Ok(session) => session,
            Err(error) => {
                *lock(&autosave.error) = Some(error.to_string());
                return autosave;
            }
        };
        let (sender, receiver) = channel();
        let (done, error) = (Arc::clone(&autosave.done), Arc::clone(&autosave.error));
        let thread = std::thread::Builder::new()
            .name("autosave".to_owned())
            .spawn(move || serve(session, &receiver, &done, &error));
        match thread {
            Ok(thread) => (autosave.sender, autosave.thread) = (Some(sender), Some(thread)),
            Err(error) => *lock(&autosave.error) = Some(error.to_string()),
        }
        autosave
    }

    fn send(&self, message: Message) {
        if let Some(sender) = &self.sender {
            let _the_thread_has_ended = sender.send(message);
        }
    }

    /// Ends the session: there is nothing to recover. Waits for what is being written.
    pub fn end(&mut self) {
        self.sender = None;
        if let Some(thread) = self.thread.take() {
            let _panicked = thread.join();
        }
    }
}

fn serve(mut session: Session, messages: &Receiver<Message>, done: &AtomicU64, error: &Mutex<Option<String>>) {
    for message in messages {
        let result = match message {
            Message::Changed { document, command, revision } => {
                session.save(&document, &command).map(|()| done.store(revision + 1, Ordering::Relaxed))
            }
            Message::File(file) => session.set_file(file.as_deref()),
            Message::SavedByUser => {
                session.saved_by_user();
                done.store(0, Ordering::Relaxed);
                Ok(())
            }
        };
        if let Err(e) = result {
            *lock(error) = Some(e.to_string());
        }
    }
    session.end();
}

fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Editor {
    /// Hands the document over when it has changed, and passes on what went wrong.
    pub fn poll_autosave(&mut self) {
        let revision = self.history.revision();
        if self.autosave.seen != Some(revision) {
            // The state as it was opened needs no recovery.
            if self.history.is_dirty() {
                let command = match self.history.undo_label() {
                    Some(label) => label.to_owned(),
                    None => "Undo everything".to_owned(),
                };
                let document = self.document().clone();
                self.autosave.send(Message::Changed { document, command, revision });
            }
            self.autosave.seen = Some(revision);
        }
        let error = lock(&self.autosave.error).take();
        if let Some(error) = error {
            self.warn(error);
        }
    }

    /// Whether the current state has been put aside.
    pub fn is_autosaved(&self) -> bool {
        self.autosave.done.load(Ordering::Relaxed) == self.history.revision() + 1
    }

    /// The user has saved, or opened something else: nothing is left to recover.
    pub fn autosave_fresh(&mut self, file: Option<&Path>) {
        self.autosave.send(Message::SavedByUser);
        self.autosave.send(Message::File(file.map(Path::to_path_buf)));
        self.autosave.seen = None;
        self.autosave.done.store(0, Ordering::Relaxed);
    }

    /// Asks what to do with what crashed sessions left behind.
    pub fn offer_recovery(&mut self, found: Vec<Recovery>) {
        if found.is_empty() {
            return;
        }
        let list = found.iter().map(|recovery| {
            let name = recovery.file.as_deref().map_or("Untitled".to_owned(), file_name);
            let age = SystemTime::now().duration_since(recovery.saved).unwrap_or_default();
            let last: Vec<&str> = recovery.commands.iter().rev().take(3).map(String::as_str).collect();
            let count = recovery.commands.len();
            let changes = if count == 1 { "1 change".to_owned() } else { format!("{count} changes") };
            Recoverable { name, summary: format!("{} ago · {changes}, last: {}", span(age), last.join(", ")) }
        });
        self.dialog = Some(Dialog::Recovery(list.collect()));
        self.recoveries = found;
    }

    /// Opens what the crashed session in place `at` of the list left behind.
    pub fn recover(&mut self, at: usize) {
        if at >= self.recoveries.len() {
            return;
        }
        let recovery = self.recoveries.remove(at);
        match recovery.open() {
            Ok(opened) => {
                let title = recovery.file.as_deref().map_or("Recovered".to_owned(), file_name);
                self.show_document(opened.document, Some(opened.report), title, false);
                self.files.source.clone_from(&recovery.file);
                self.say("Recovered; save it to keep it");
                self.autosave_fresh(recovery.file.as_deref());
                self.poll_autosave();
                if let Err(error) = recovery.discard() {
                    log::warn!("what was recovered could not be removed: {error}");
                }
            }
            Err(error) => self.problem(Problem {
                what: "The work could not be recovered".to_owned(),
                why: error.to_string(),
                ..Problem::default()
            }),
        }
    }

    /// Deletes what the crashed session in place `at` of the list left behind.
    pub fn forget(&mut self, at: usize) {
        if at < self.recoveries.len()
            && let Err(error) = self.recoveries.remove(at).discard()
        {
            self.warn(format!("The session could not be deleted: {error}"));
        }
        let rest = std::mem::take(&mut self.recoveries);
        self.offer_recovery(rest);
    }
}

/// A time in words.
fn span(time: std::time::Duration) -> String {
    let seconds = time.as_secs();
    let count = |n: u64, what: &str| if n == 1 { format!("1 {what}") } else { format!("{n} {what}s") };
    match seconds {
        0..60 => count(seconds.max(1), "second"),
        60..3600 => count(seconds / 60, "minute"),
        3600..86_400 => count(seconds / 3600, "hour"),
        _ => count(seconds / 86_400, "day"),
    }
}
