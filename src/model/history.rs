//! Linear undo: a stack of documents with the names of the commands between them.
//!
//! Documents share what they have in common, so a step costs a few pointers and undo is instant however heavy
//! the computation behind a step was.

use super::command::{Command, CommandError};
use super::document::Document;

/// The documents of a session, the current one among them.
#[derive(Clone, Debug, Default)]
pub struct History {
    /// `states[0]` is the document as it was opened; `labels[i]` leads from state i to state i + 1.
    states: Vec<Document>,
    labels: Vec<String>,
    current: usize,
    /// The state that is on disk, `None` when no state of this history is.
    saved: Option<usize>,
    /// Tells states apart for whoever keeps something per state; never repeats.
    revision: u64,
}

impl History {
    /// A history that starts with a document; `saved` says that this state is on disk.
    pub fn new(document: Document, saved: bool) -> Self {
        Self { states: vec![document], saved: saved.then_some(0), ..Self::default() }
    }

    /// The current document.
    pub fn document(&self) -> &Document {
        static EMPTY: std::sync::LazyLock<Document> = std::sync::LazyLock::new(Document::default);
        self.states.get(self.current).unwrap_or(&EMPTY)
    }

    /// A number that changes whenever the current document does.
    pub fn revision(&self) -> u64 {
        self.revision
    }

    /// Applies a command. What had been undone is dropped. A failing command changes nothing.
    pub fn apply(&mut self, command: &Command) -> Result<(), CommandError> {
        let next = command.apply(self.document())?;
        if self.states.is_empty() {
            self.states.push(Document::default());
        }
        self.states.truncate(self.current + 1);
        self.labels.truncate(self.current);
        if self.saved.is_some_and(|s| s > self.current) {
            self.saved = None;
        }
        self.states.push(next);
        self.labels.push(command.label());
        self.current += 1;
        self.revision += 1;
        Ok(())
    }

    /// Applies a command that follows a slider: steps of the same name in a row are one step of the history, so that one
    /// undo takes back the whole drag. A state that is on disk stays a step of its own.
    pub fn apply_merged(&mut self, command: &Command) -> Result<(), CommandError> {
        let repeats = self.undo_label() == Some(&command.label()) && self.redo_label().is_none();
        if !repeats || self.saved == Some(self.current) {
            return self.apply(command);
        }
        // The step before is replaced: the command says the whole change, not what is new in it.
        let next = command.apply(self.document())?;
        self.states[self.current] = next;
        self.revision += 1;
        Ok(())
    }

    /// Goes one step back and says what was undone.
    pub fn undo(&mut self) -> Option<&str> {
        self.current = self.current.checked_sub(1)?;
        self.revision += 1;
        Some(&self.labels[self.current])
    }

    /// Goes one step forward again and says what was redone.
    pub fn redo(&mut self) -> Option<&str> {
        if self.current >= self.labels.len() {
            return None;
        }
        self.current += 1;
        self.revision += 1;
        Some(&self.labels[self.current - 1])
    }

    /// Goes to the state after `steps` commands (0: as opened); beyond the end, to the last one.
    pub fn go_to(&mut self, steps: usize) {
        let target = steps.min(self.labels.len());
        if target != self.current {
            self.current = target;
            self.revision += 1;
        }
    }

    /// The command that undo would take back.
    pub fn undo_label(&self) -> Option<&str> {
        self.current.checked_sub(1).and_then(|at| self.labels.get(at)).map(String::as_str)
    }

    /// The command that redo would bring back.
    pub fn redo_label(&self) -> Option<&str> {
        self.labels.get(self.current).map(String::as_str)
    }

    /// All labels and how many of them are applied.
    pub fn steps(&self) -> (&[String], usize) {
        (&self.labels, self.current)
    }

    /// Notes that the current state is on disk.
    pub fn mark_saved(&mut self) {
        self.saved = Some(self.current);
    }

    /// Whether the current state differs from what is on disk.
    pub fn is_dirty(&self) -> bool {
        self.saved != Some(self.current)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::geom::Curve;
    use crate::model::document::{EntityId, Unit};
    use glam::DVec3;
    use std::sync::Arc;

    fn add() -> Command {
        let curve = Curve::segment(DVec3::ZERO, DVec3::X).unwrap();
        Command::AddCurves { curves: vec![("c".to_owned(), Arc::new(curve))] }
    }

    #[test]
    fn undo_and_redo_walk_the_same_states() {
        let mut history = History::new(Document::new(Unit::Millimetre), true);
        for n in 1..=3 {
            history.apply(&add()).unwrap();
            assert_eq!(history.document().entities().len(), n);
        }
        let id = history.document().entities()[1].id;
        history.apply(&Command::Delete { ids: vec![id] }).unwrap();
        assert_eq!(history.undo(), Some("Delete 1 entity"));
        assert!(history.document().get(id).is_some());
        assert_eq!(history.redo(), Some("Delete 1 entity"));
        assert!(history.document().get(id).is_none());
        assert_eq!(history.redo(), None);
        history.go_to(0);
        assert!(history.document().entities().is_empty() && !history.is_dirty());
        assert_eq!(history.undo(), None);
    }

    #[test]
    fn a_failing_command_changes_nothing() {
        let mut history = History::new(Document::default(), true);
        history.apply(&add()).unwrap();
        let before = history.revision();
        let missing = Command::Delete { ids: vec![EntityId(77)] };
        assert_eq!(history.apply(&missing), Err(CommandError::NoEntity { id: 77 }));
        assert_eq!((history.revision(), history.document().entities().len()), (before, 1));
    }

    #[test]
    fn a_new_command_drops_what_was_undone_and_dirt_is_told() {
        let mut history = History::new(Document::default(), true);
        history.apply(&add()).unwrap();
        history.mark_saved();
        history.undo();
        assert!(history.is_dirty());
        history.apply(&add()).unwrap();
        assert!(history.is_dirty(), "the saved state is gone");
        assert_eq!(history.redo_label(), None);
    }

    #[test]
    fn a_drag_of_a_slider_is_one_step() {
        use crate::kernel::geom::Surface;
        use crate::model::document::Shape;
        let flat = |z: f64| {
            let corners = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::X + DVec3::Y];
            Arc::new(Surface::bilinear(corners.map(|p| p + DVec3::Z * z)).unwrap())
        };
        let mut document = Document::default();
        let id = document.add("plane", Shape::Surface(flat(0.0)), None);
        let mut history = History::new(document, true);
        let height = |h: &History| h.document().surfaces().next().unwrap().1.point(0, 0).z;
        for z in [1.0, 2.0, 3.0] {
            history.apply_merged(&Command::ReplaceSurface { id, surface: flat(z) }).unwrap();
        }
        assert_eq!((height(&history), history.steps().1, history.is_dirty()), (3.0, 1, true));
        history.mark_saved();
        history.apply_merged(&Command::ReplaceSurface { id, surface: flat(4.0) }).unwrap();
        assert!(history.is_dirty() && history.steps().1 == 2);
        history.undo();
        assert!(!history.is_dirty() && height(&history) == 3.0);
        history.undo();
        assert_eq!(height(&history), 0.0);
    }

    #[test]
    fn deleted_ids_are_never_given_again() {
        let mut history = History::new(Document::default(), true);
        history.apply(&add()).unwrap();
        let first = history.document().entities()[0].id;
        history.apply(&Command::Delete { ids: vec![first] }).unwrap();
        history.apply(&add()).unwrap();
        assert_ne!(history.document().entities()[0].id, first);
    }
}
