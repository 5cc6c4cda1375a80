//! What goes into an intersection: two sets of bodies, all pairs of the visible ones, or surfaces, each with itself.

use crate::kernel::intersect::Engine;
use crate::model::document::{Document, Entity, EntityId};

/// What is intersected with what.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Task {
    /// One set with another.
    #[default]
    Sets,
    /// Every visible surface with every other.
    Pairs,
    /// Surfaces, each with itself.
    Itself,
}

/// The surfaces that were picked.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Picks {
    /// What is done with them.
    pub task: Task,
    /// The first and the second set; [`Task::Itself`] uses the first only.
    pub sides: [Vec<EntityId>; 2],
    /// The set that the next click goes to.
    pub filling: usize,
    /// Which engine; the one that can take what is picked when left out.
    pub engine: Option<Engine>,
    /// What the last click was answered with, when it did not do what one would expect.
    pub notice: Option<String>,
}

impl Picks {
    /// Starts a task with what is selected: the first selected surface against the others.
    pub fn new(task: Task, selected: &[EntityId]) -> Self {
        let mut picks = Self { task, ..Self::default() };
        match (task, selected) {
            (Task::Itself, all) => picks.sides[0] = all.to_vec(),
            (_, []) => {}
            (_, [first, rest @ ..]) => {
                picks.sides = [vec![*first], rest.to_vec()];
                picks.filling = 1;
            }
        }
        picks
    }

    /// Whether an entity can be intersected in a task: meshes and blocks only with others.
    pub fn takes(task: Task, entity: &Entity) -> bool {
        entity.surface().is_some() || task != Task::Itself && entity.facets().is_some()
    }

    /// A click on something. Without `add` it alone becomes the set that is being filled and the next click goes to the
    /// other set; with `add` (Shift) it joins the set, or leaves it when it is in.
    pub fn click(&mut self, id: EntityId, add: bool) {
        self.notice = None;
        let side = if self.task == Task::Itself { 0 } else { self.filling };
        let other = &self.sides[1 - side];
        if self.task == Task::Sets && other.contains(&id) {
            let place = if side == 0 { "second" } else { "first" };
            self.notice = Some(format!(
                "It is in the {place} set already. A surface is intersected with itself by the self-intersection tool"
            ));
            return;
        }
        let set = &mut self.sides[side];
        if add {
            match set.iter().position(|other| *other == id) {
                Some(at) => drop(set.remove(at)),
                None => set.push(id),
            }
        } else {
            *set = vec![id];
            if self.task == Task::Sets {
                self.filling = 1 - side;
            }
        }
    }

    /// The next click goes to this set.
    pub fn fill(&mut self, side: usize) {
        self.filling = side.min(1);
        self.notice = None;
    }

    /// Takes the last pick back; false when there is none.
    pub fn back(&mut self) -> bool {
        self.notice = None;
        let last = if self.task == Task::Itself { 0 } else { self.filling };
        let side = [last, 1 - last].into_iter().find(|&s| !self.sides[s].is_empty());
        let Some(side) = side else { return false };
        self.sides[side].pop();
        self.filling = side;
        true
    }

    /// The two sets change places.
    pub fn swap(&mut self) {
        self.sides.swap(0, 1);
        self.filling = 1 - self.filling;
    }

    /// Forgets entities that are no longer in the document.
    pub fn prune(&mut self, document: &Document) {
        for side in &mut self.sides {
            side.retain(|&id| document.get(id).is_some_and(|e| Self::takes(self.task, e)));
        }
    }

    /// What goes in, or what is missing.
    pub fn chosen(&self, document: &Document) -> Result<[Vec<EntityId>; 2], &'static str> {
        // On the exact surfaces meshes are left out of all pairs.
        let counts = |e: &Entity| e.surface().is_some() || self.engine == Some(Engine::Mesh) && e.facets().is_some();
        let visible = || document.entities().iter().filter(|e| e.visible && counts(e)).map(|e| e.id);
        let is_mesh = |id: &EntityId| document.get(*id).is_some_and(|e| !Self::takes(Task::Itself, e));
        match self.task {
            Task::Sets if self.sides[0].is_empty() => Err("pick a surface or mesh for the first set"),
            Task::Sets if self.sides[1].is_empty() => Err("pick a surface or mesh for the second set"),
            Task::Sets => Ok(self.sides.clone()),
            Task::Pairs if visible().count() < 2 => Err("fewer than two surfaces are visible"),
            Task::Itself if self.sides[0].iter().any(is_mesh) => Err("a mesh is not searched: pick surfaces only"),
            Task::Pairs => Ok([visible().collect(), Vec::new()]),
            Task::Itself if self.sides[0].is_empty() => Err("pick a surface, or search all visible ones"),
            Task::Itself => Ok([self.sides[0].clone(), Vec::new()]),
        }
    }

    /// What to do now.
    pub fn prompt(&self) -> &'static str {
        match (self.task, self.sides[0].is_empty(), self.sides[1].is_empty()) {
            (Task::Pairs, ..) => "Intersect all pairs of the visible surfaces",
            (Task::Itself, true, _) => "Click a surface",
            (Task::Itself, false, _) => "Find where it meets itself",
            (Task::Sets, true, _) => "Click a surface or mesh for the first set",
            (Task::Sets, _, true) => "Click a surface or mesh for the second set",
            (Task::Sets, ..) => "Intersect the two sets",
        }
    }

    /// The keys that count now.
    pub fn keys(&self) -> &'static str {
        match self.task {
            Task::Pairs => "Enter intersect · Esc leave",
            Task::Itself => "Shift more · Enter search · Backspace undo pick · Esc leave",
            Task::Sets => "Shift more · Tab other set · Enter intersect · Backspace undo pick · Esc leave",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::intersection::testing::two_planes;

    #[test]
    fn two_clicks_fill_two_sets_and_shift_adds() {
        let mut picks = Picks::new(Task::Sets, &[]);
        picks.click(EntityId(3), false);
        assert_eq!((picks.sides[0].as_slice(), picks.filling), ([EntityId(3)].as_slice(), 1));
        picks.click(EntityId(3), false);
        assert!(picks.notice.is_some() && picks.sides[1].is_empty(), "a surface is never on both sides");
        picks.click(EntityId(5), true);
        picks.click(EntityId(6), true);
        picks.click(EntityId(5), true);
        assert_eq!(picks.sides[1], [EntityId(6)]);
        assert!(picks.back() && picks.sides[1].is_empty());
        assert!(picks.back() && picks.sides[0].is_empty() && picks.filling == 0);
        assert!(!picks.back());
    }

    #[test]
    fn a_selection_is_taken_over() {
        let selected = [EntityId(4), EntityId(1), EntityId(2)];
        let picks = Picks::new(Task::Sets, &selected);
        assert_eq!(picks.sides, [vec![EntityId(4)], vec![EntityId(1), EntityId(2)]]);
        assert_eq!(Picks::new(Task::Itself, &selected).sides[0], selected);
    }

    #[test]
    fn what_is_missing_is_said_and_hidden_surfaces_make_no_pairs() {
        let document = two_planes();
        let ids: Vec<EntityId> = document.entities().iter().map(|e| e.id).collect();
        let mut picks = Picks::new(Task::Sets, &[]);
        assert!(picks.chosen(&document).is_err());
        picks.click(ids[0], false);
        assert!(picks.chosen(&document).unwrap_err().contains("second"));
        picks.click(ids[1], false);
        assert_eq!(picks.chosen(&document).unwrap(), [vec![ids[0]], vec![ids[1]]]);
        let all = Picks::new(Task::Pairs, &[]);
        assert_eq!(all.chosen(&document).unwrap()[0], ids);
        let mut hidden = document.clone();
        hidden.edit(ids[1], |e| e.visible = false);
        assert!(all.chosen(&hidden).is_err());
        picks.prune(&Document::default());
        assert!(picks.sides.iter().all(Vec::is_empty));
    }
}
