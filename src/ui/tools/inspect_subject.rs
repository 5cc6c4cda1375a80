//! What is looked into: a surface, and what workers make of it once.

use std::sync::Arc;

use super::super::editor::Editor;
use crate::kernel::geom::Surface;
use crate::kernel::job::Job;
use crate::model::document::EntityId;
use crate::view::inspect::{Hierarchy, Searched};
use crate::work::{Jobs, Lane, Outcome, Ticket};

/// Something that a worker makes once for a surface.
pub struct Made<T> {
    value: Option<Arc<T>>,
    error: Option<String>,
    ticket: Option<Ticket<Result<T, String>>>,
}

impl<T> Default for Made<T> {
    fn default() -> Self {
        Self { value: None, error: None, ticket: None }
    }
}

/// What a look at the worker has brought.
pub enum Polled {
    /// Nothing.
    Same,
    /// The thing, or why there is none.
    Changed,
    /// The worker ran into a bug: the message, and what it was given.
    Died(String, String),
}

impl<T: Send + 'static> Made<T> {
    /// The thing, once it is there.
    pub fn value(&self) -> Option<&Arc<T>> {
        self.value.as_ref()
    }

    /// Why there is none.
    pub fn error(&self) -> Option<&str> {
        self.error.as_deref()
    }

    /// Whether a worker is at it.
    pub fn is_busy(&self) -> bool {
        self.ticket.is_some()
    }

    /// Asks a worker for it unless it is there, on its way, or known not to be.
    pub fn want(
        &mut self,
        jobs: &mut Jobs,
        name: &str,
        input: String,
        work: impl FnOnce(&Job) -> Result<T, String> + Send + 'static,
    ) {
        if self.value.is_none() && self.ticket.is_none() && self.error.is_none() {
            self.ticket = Some(jobs.spawn(Lane::Heavy, name, input, work));
        }
    }

    /// Takes over what the worker has made. `what` begins the sentence that says why there is nothing; what was
    /// cancelled is dropped unless parts of it are of use.
    pub fn poll(&mut self, what: &str, keeps_parts: bool) -> Polled {
        let Some(outcome) = self.ticket.as_ref().and_then(Ticket::poll) else { return Polled::Same };
        self.ticket = None;
        match outcome {
            Outcome::Finished { cancelled: true, .. } if !keeps_parts => {
                self.error = Some(format!("{what} was cancelled"));
            }
            Outcome::NeverRan => self.error = Some(format!("{what} was cancelled")),
            Outcome::Finished { value: Ok(value), .. } => self.value = Some(Arc::new(value)),
            Outcome::Finished { value: Err(why), .. } => self.error = Some(why),
            Outcome::Panicked { message, input } => {
                self.error = Some(format!("{what} failed: {message}"));
                return Polled::Died(message, input);
            }
        }
        Polled::Changed
    }

    /// Asks the worker to stop; what it leaves is still taken over.
    pub fn cancel(&self) {
        self.ticket.iter().for_each(Ticket::cancel);
    }

    /// Drops the thing, so that it is made again.
    pub fn forget(&mut self) {
        self.cancel();
        *self = Self::default();
    }
}

/// A surface that is looked into.
pub struct Subject {
    /// Which entity.
    pub entity: EntityId,
    /// Its name.
    pub name: String,
    /// Its surface.
    pub surface: Arc<Surface>,
    /// Its hierarchy.
    pub hierarchy: Made<Hierarchy>,
    /// Its search for self-intersections.
    pub searched: Made<Searched>,
}

impl Subject {
    /// Nothing is made yet.
    pub fn new(entity: EntityId, name: String, surface: Arc<Surface>) -> Self {
        Self { entity, name, surface, hierarchy: Made::default(), searched: Made::default() }
    }

    /// Whether a worker is at something of it.
    pub fn is_busy(&self) -> bool {
        self.hierarchy.is_busy() || self.searched.is_busy()
    }

    /// Asks the workers to stop.
    pub fn cancel(&self) {
        self.hierarchy.cancel();
        self.searched.cancel();
    }
}

impl Drop for Subject {
    fn drop(&mut self) {
        self.cancel();
    }
}

impl Editor {
    /// The selected surfaces, at most two, with their names.
    pub fn chosen_surfaces(&self) -> Vec<(EntityId, String, Arc<Surface>)> {
        let document = self.document();
        let entities = self.selection.ids().iter().filter_map(|&id| document.get(id));
        entities.filter_map(|e| Some((e.id, e.name.clone(), Arc::clone(e.surface()?)))).take(2).collect()
    }
}
