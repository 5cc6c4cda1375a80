//! Hide, isolate and show all as commands: visibility belongs to the document, so undo takes it back like any
//! other change.

use crate::model::command::Command;
use crate::model::document::{Document, EntityId};
use crate::model::selection::Selection;

/// A key of the visibility group.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VisibilityKey {
    /// H: hide the selection.
    Hide,
    /// Shift+H: hide everything else.
    Isolate,
    /// Alt+H: show everything.
    ShowAll,
}

/// The command for a key, or why there is nothing to do, for the status line. Without a selection, the thing under the
/// cursor is meant.
pub fn command(
    key: VisibilityKey,
    document: &Document,
    selection: &Selection,
    hovered: Option<EntityId>,
) -> Result<Command, &'static str> {
    let mut ids: Vec<EntityId> = selection.ids().iter().copied().filter(|id| document.get(*id).is_some()).collect();
    if ids.is_empty() {
        ids.extend(hovered.filter(|id| document.get(*id).is_some()));
    }
    let is_visible = |id: &EntityId| document.get(*id).is_some_and(|e| e.visible);
    match key {
        VisibilityKey::ShowAll if document.entities().iter().all(|e| e.visible) => Err("everything is shown already"),
        VisibilityKey::ShowAll => Ok(Command::ShowAll),
        _ if ids.is_empty() => Err("nothing is selected; click a thing first"),
        VisibilityKey::Hide => {
            ids.retain(is_visible);
            if ids.is_empty() {
                return Err("the selection is hidden already; Alt+H shows everything");
            }
            Ok(Command::SetVisible { ids, visible: false })
        }
        VisibilityKey::Isolate => {
            let alone = document.entities().iter().all(|e| e.visible == ids.contains(&e.id));
            if alone {
                Err("the selection is alone already; Alt+H shows everything")
            } else {
                Ok(Command::Isolate { ids })
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::DVec3;

    use super::*;
    use crate::kernel::geom::Curve;
    use crate::model::document::{Shape, Unit};
    use crate::model::history::History;

    #[test]
    fn each_key_does_its_thing_once_and_undo_takes_it_back() {
        let mut document = Document::new(Unit::Millimetre);
        let curve = Arc::new(Curve::segment(DVec3::ZERO, DVec3::X).unwrap());
        let ids: Vec<EntityId> = (0..3).map(|_| document.add("c", Shape::Curve(Arc::clone(&curve)), None)).collect();
        let mut history = History::new(document, true);
        let mut selection = Selection::default();
        let shown = |h: &History| h.document().entities().iter().map(|e| e.visible).collect::<Vec<_>>();
        let run = |h: &mut History, key, s: &Selection, hovered| -> Result<(), &'static str> {
            let command = command(key, h.document(), s, hovered)?;
            h.apply(&command).map_err(|_| "failed")
        };
        assert!(run(&mut history, VisibilityKey::Hide, &selection, None).is_err());
        assert!(run(&mut history, VisibilityKey::ShowAll, &selection, None).is_err());
        run(&mut history, VisibilityKey::Hide, &selection, Some(ids[2])).unwrap();
        assert_eq!(shown(&history), [true, true, false]);
        selection.set([ids[1]]);
        run(&mut history, VisibilityKey::Isolate, &selection, None).unwrap();
        assert_eq!(shown(&history), [false, true, false]);
        assert!(run(&mut history, VisibilityKey::Isolate, &selection, None).is_err());
        run(&mut history, VisibilityKey::ShowAll, &selection, None).unwrap();
        assert_eq!(shown(&history), [true; 3]);
        history.undo();
        history.undo();
        assert_eq!(shown(&history), [true, true, false]);
    }
}
