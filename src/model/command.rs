//! Commands: every change of a document, as data. A journal of them replays a session.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::document::{Document, EntityId, Patch, Shape, Unit};
use crate::kernel::geom::{Curve, Surface};

/// One change of a document.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub enum Command {
    /// Gives an entity another name.
    Rename {
        /// Which one.
        id: EntityId,
        /// The new name; must not be empty.
        name: String,
    },
    /// Shows or hides entities.
    SetVisible {
        /// Which ones.
        ids: Vec<EntityId>,
        /// Whether they are drawn.
        visible: bool,
    },
    /// Hides all entities but these.
    Isolate {
        /// The ones that stay.
        ids: Vec<EntityId>,
    },
    /// Shows every entity.
    ShowAll,
    /// Removes entities.
    Delete {
        /// Which ones.
        ids: Vec<EntityId>,
    },
    /// Gives entities a colour (linear RGB), or takes it away.
    SetColor {
        /// Which ones.
        ids: Vec<EntityId>,
        /// The colour.
        color: Option<[f32; 3]>,
    },
    /// Says what the lengths of the document are measured in (no number changes).
    SetUnit {
        /// The unit.
        unit: Unit,
    },
    /// Adds healed patches and puts others, which were healed together with them or anew, in the places of the patches that they
    /// come from: all at once, so that one undo takes back one heal.
    Heal {
        /// Names and patches that are new.
        added: Vec<(String, Patch)>,
        /// Patches that keep their id; one whose specification has another name than before gets that name.
        replaced: Vec<(EntityId, Arc<Patch>)>,
    },
    /// Adds free curves.
    AddCurves {
        /// Names and curves.
        curves: Vec<(String, Arc<Curve>)>,
    },
    /// Adds surfaces.
    AddSurfaces {
        /// Names and surfaces.
        surfaces: Vec<(String, Arc<Surface>)>,
    },
    /// Puts another surface in the place of one, under the same id.
    ReplaceSurface {
        /// Which one.
        id: EntityId,
        /// What takes its place.
        surface: Arc<Surface>,
    },
}

/// Why a command could not be applied. The document is untouched.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CommandError {
    /// The command names an entity that is not there.
    #[error("there is no entity {id} in this document; it may have been deleted")]
    NoEntity {
        /// Its number.
        id: u64,
    },
    /// The command needs a patch and got something else.
    #[error("entity {id} is no healed patch")]
    NoPatch {
        /// Its number.
        id: u64,
    },
    /// The command needs a surface and got something else.
    #[error("entity {id} is no surface")]
    NoSurface {
        /// Its number.
        id: u64,
    },
    /// A name is empty.
    #[error("a name must have at least one character that is not a space")]
    EmptyName,
    /// There is nothing to do it to.
    #[error("nothing is selected for \"{command}\"")]
    Nothing {
        /// The command's label.
        command: String,
    },
}

impl Command {
    /// What the History panel calls it.
    pub fn label(&self) -> String {
        let count =
            |what: &str, n: usize| if n == 1 { format!("{what} 1 entity") } else { format!("{what} {n} entities") };
        match self {
            Self::Rename { name, .. } => format!("Rename to {name}"),
            Self::SetVisible { ids, visible } => count(if *visible { "Show" } else { "Hide" }, ids.len()),
            Self::Isolate { ids } => count("Isolate", ids.len()),
            Self::ShowAll => "Show all".to_owned(),
            Self::Delete { ids } => count("Delete", ids.len()),
            Self::SetColor { ids, .. } => count("Colour", ids.len()),
            Self::SetUnit { unit } if unit.symbol().is_empty() => "Unset unit".to_owned(),
            Self::SetUnit { unit } => format!("Set unit to {}", unit.symbol()),
            Self::Heal { added, replaced } => match (added.as_slice(), replaced.first()) {
                ([], Some((_, patch))) => format!("Adjust patch {}", patch.spec.name),
                ([(name, _)], _) => format!("Add patch {name}"),
                _ => format!("Add {} patches", added.len()),
            },
            Self::AddCurves { curves } => format!("Add {} curves", curves.len()),
            Self::AddSurfaces { surfaces } => format!("Add {} surfaces", surfaces.len()),
            Self::ReplaceSurface { .. } => "Change surface".to_owned(),
        }
    }

    /// The document after the command. On an error nothing has changed.
    pub fn apply(&self, document: &Document) -> Result<Document, CommandError> {
        let mut next = document.clone();
        let all_there = |ids: &[EntityId]| {
            if ids.is_empty() {
                return Err(CommandError::Nothing { command: self.label() });
            }
            ids.iter().try_for_each(|&id| match document.get(id) {
                Some(_) => Ok(()),
                None => Err(CommandError::NoEntity { id: id.0 }),
            })
        };
        match self {
            Self::Rename { id, name } => {
                all_there(&[*id])?;
                let name = name.trim();
                if name.is_empty() {
                    return Err(CommandError::EmptyName);
                }
                next.edit(*id, |e| name.clone_into(&mut e.name));
            }
            Self::SetVisible { ids, visible } => {
                all_there(ids)?;
                for &id in ids {
                    next.edit(id, |e| e.visible = *visible);
                }
            }
            Self::Isolate { ids } => {
                all_there(ids)?;
                for entity in document.entities() {
                    let stays = ids.contains(&entity.id);
                    if entity.visible != stays {
                        next.edit(entity.id, |e| e.visible = stays);
                    }
                }
            }
            Self::ShowAll => {
                for entity in document.entities().iter().filter(|e| !e.visible) {
                    next.edit(entity.id, |e| e.visible = true);
                }
            }
            Self::Delete { ids } => {
                all_there(ids)?;
                next.retain(|e| !ids.contains(&e.id));
            }
            Self::SetColor { ids, color } => {
                all_there(ids)?;
                for &id in ids {
                    next.edit(id, |e| e.color = *color);
                }
            }
            Self::SetUnit { unit } => next.unit = *unit,
            Self::Heal { added, replaced } => {
                for (id, patch) in replaced {
                    all_there(&[*id])?;
                    let Some(Shape::Patch(old)) = document.get(*id).map(|e| &e.shape) else {
                        return Err(CommandError::NoPatch { id: id.0 });
                    };
                    next.edit(*id, |e| {
                        if old.spec.name != patch.spec.name {
                            e.name.clone_from(&patch.spec.name);
                        }
                        e.shape = Shape::Patch(Arc::clone(patch));
                    });
                }
                for (name, patch) in added {
                    next.add(name.clone(), Shape::Patch(Arc::new(patch.clone())), None);
                }
            }
            Self::AddCurves { curves } => {
                for (name, curve) in curves {
                    next.add(name.clone(), Shape::Curve(Arc::clone(curve)), None);
                }
            }
            Self::AddSurfaces { surfaces } => {
                for (name, surface) in surfaces {
                    next.add(name.clone(), Shape::Surface(Arc::clone(surface)), None);
                }
            }
            Self::ReplaceSurface { id, surface } => {
                all_there(&[*id])?;
                if !matches!(document.get(*id).map(|e| &e.shape), Some(Shape::Surface(_))) {
                    return Err(CommandError::NoSurface { id: id.0 });
                }
                next.edit(*id, |e| e.shape = Shape::Surface(Arc::clone(surface)));
            }
        }
        Ok(next)
    }
}
