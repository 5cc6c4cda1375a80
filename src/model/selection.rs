//! What is selected: an ordered set of entities. It is not part of the document, so undo does not touch it.

use super::document::{Document, EntityId};

/// The selected entities, the one picked last at the end.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Selection {
    ids: Vec<EntityId>,
}

impl Selection {
    /// The selected entities in the order in which they were picked.
    pub fn ids(&self) -> &[EntityId] {
        &self.ids
    }

    /// Whether an entity is selected.
    pub fn contains(&self, id: EntityId) -> bool {
        self.ids.contains(&id)
    }

    /// Whether nothing is selected.
    pub fn is_empty(&self) -> bool {
        self.ids.is_empty()
    }

    /// Selects these and nothing else.
    pub fn set(&mut self, ids: impl IntoIterator<Item = EntityId>) {
        self.ids.clear();
        for id in ids {
            if !self.contains(id) {
                self.ids.push(id);
            }
        }
    }

    /// Adds an entity, or takes it away when it is selected.
    pub fn toggle(&mut self, id: EntityId) {
        match self.ids.iter().position(|&other| other == id) {
            Some(at) => {
                self.ids.remove(at);
            }
            None => self.ids.push(id),
        }
    }

    /// Selects nothing.
    pub fn clear(&mut self) {
        self.ids.clear();
    }

    /// Forgets entities that are no longer in the document.
    pub fn prune(&mut self, document: &Document) {
        self.ids.retain(|&id| document.get(id).is_some());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn toggling_twice_is_nothing_and_order_is_kept() {
        let mut selection = Selection::default();
        selection.set([EntityId(4), EntityId(2), EntityId(4)]);
        selection.toggle(EntityId(9));
        assert_eq!(selection.ids(), [EntityId(4), EntityId(2), EntityId(9)]);
        selection.toggle(EntityId(2));
        assert_eq!(selection.ids(), [EntityId(4), EntityId(9)]);
        selection.prune(&Document::default());
        assert!(selection.is_empty());
    }
}
