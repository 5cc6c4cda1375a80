//! Documents: immutable sets of entities, cheap to clone. Undo is a stack of documents.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::kernel::geom::trim::{Face, Sheet};
use crate::kernel::geom::{Aabb, Curve, Surface};
use crate::kernel::mesh::body::Body;
use crate::kernel::mesh::facets::Facets;
use crate::kernel::tol::Tolerances;

/// Names one entity for the life of a document, whatever is added or removed around it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct EntityId(pub u64);

/// The unit of all lengths of a document.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Unit {
    /// The file named none, or one without a metric meaning.
    #[default]
    Unknown,
    /// Inches.
    Inch,
    /// Millimetres.
    Millimetre,
    /// Feet.
    Foot,
    /// Miles.
    Mile,
    /// Metres.
    Metre,
    /// Kilometres.
    Kilometre,
    /// Thousandths of an inch.
    Mil,
    /// Micrometres.
    Micrometre,
    /// Centimetres.
    Centimetre,
    /// Millionths of an inch.
    Microinch,
}

impl Unit {
    /// The short name that is written behind a length, empty when unknown.
    pub fn symbol(self) -> &'static str {
        match self {
            Self::Unknown => "",
            Self::Inch => "in",
            Self::Millimetre => "mm",
            Self::Foot => "ft",
            Self::Mile => "mi",
            Self::Metre => "m",
            Self::Kilometre => "km",
            Self::Mil => "mil",
            Self::Micrometre => "um",
            Self::Centimetre => "cm",
            Self::Microinch => "uin",
        }
    }
}

/// The shape of an entity.
#[derive(Clone, Debug)]
pub enum Shape {
    /// A surface of the model.
    Surface(Arc<Surface>),
    /// A trimmed face of the model.
    Face(Arc<Face>),
    /// A free curve of the model.
    Curve(Arc<Curve>),
    /// A healed patch: its surface, how it was asked for, and the evidence.
    Patch(Arc<Patch>),
    /// A triangle mesh of the model.
    Mesh(Arc<Facets>),
    /// A structured block of the model (Plot3D).
    Block(Arc<Facets>),
}

/// A healed patch as the document keeps it.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Patch {
    /// The B-spline surface (bicubic, C1, double interior knots).
    pub surface: Arc<Surface>,
    /// What it was made from; running it again with `settings`, together with the patches that it shares boundaries with,
    /// gives the same surface.
    pub spec: super::spec::PatchSpec,
    /// The settings of the heal that made it, without patches.
    pub settings: super::spec::HealSpec,
    /// What was measured.
    pub report: super::spec::PatchReport,
}

/// One thing in a document.
#[derive(Clone, Debug)]
pub struct Entity {
    /// Its name for programs.
    pub id: EntityId,
    /// Its name for people.
    pub name: String,
    /// What it is.
    pub shape: Shape,
    /// Whether it is drawn.
    pub visible: bool,
    /// The colour that the file or the user gave it, linear RGB.
    pub color: Option<[f32; 3]>,
}

impl Entity {
    /// The surface of a surface or patch; of a face the whole surface under it.
    pub fn surface(&self) -> Option<&Arc<Surface>> {
        match &self.shape {
            Shape::Surface(surface) => Some(surface),
            Shape::Face(face) => Some(face.surface()),
            Shape::Patch(patch) => Some(&patch.surface),
            Shape::Curve(_) | Shape::Mesh(_) | Shape::Block(_) => None,
        }
    }

    /// The triangles of a mesh or block.
    pub fn facets(&self) -> Option<&Arc<Facets>> {
        match &self.shape {
            Shape::Mesh(facets) | Shape::Block(facets) => Some(facets),
            _ => None,
        }
    }

    /// The face of a face.
    pub fn face(&self) -> Option<&Arc<Face>> {
        match &self.shape {
            Shape::Face(face) => Some(face),
            _ => None,
        }
    }

    /// The part of a surface that is there: all of it, or a face on it.
    pub fn sheet(&self) -> Option<Sheet> {
        match &self.shape {
            Shape::Face(face) => Some(Sheet::Trimmed(Arc::clone(face))),
            _ => self.surface().map(|s| Sheet::Whole(Arc::clone(s))),
        }
    }

    /// The curve of a curve.
    pub fn curve(&self) -> Option<&Arc<Curve>> {
        match &self.shape {
            Shape::Curve(curve) => Some(curve),
            _ => None,
        }
    }

    /// A box around it.
    pub fn bounds(&self) -> Aabb {
        match &self.shape {
            Shape::Surface(surface) => surface.bounds(),
            Shape::Face(face) => face.bounds(),
            Shape::Curve(curve) => curve.bounds(),
            Shape::Patch(patch) => patch.surface.bounds(),
            Shape::Mesh(facets) | Shape::Block(facets) => facets.bounds(),
        }
    }
}

/// A set of entities. Cloning costs a few pointers.
#[derive(Clone, Debug, Default)]
pub struct Document {
    entities: Arc<Vec<Arc<Entity>>>,
    /// The unit of all lengths.
    pub unit: Unit,
    next_id: u64,
}

impl Document {
    /// An empty document.
    pub fn new(unit: Unit) -> Self {
        Self { unit, ..Self::default() }
    }

    /// A document of entities that have their ids already (read from a project). The ids must be distinct;
    /// `next_id` is raised where an entity has it already.
    pub fn from_parts(unit: Unit, entities: Vec<Entity>, next_id: u64) -> Self {
        let used = entities.iter().map(|e| e.id.0.saturating_add(1)).max().unwrap_or(0);
        Self { entities: Arc::new(entities.into_iter().map(Arc::new).collect()), unit, next_id: next_id.max(used) }
    }

    /// The id that the next entity gets.
    pub fn next_id(&self) -> u64 {
        self.next_id
    }

    /// All entities, in file order.
    pub fn entities(&self) -> &[Arc<Entity>] {
        &self.entities
    }

    /// The entity with this id.
    pub fn get(&self, id: EntityId) -> Option<&Arc<Entity>> {
        self.entities.iter().find(|e| e.id == id)
    }

    /// The original surfaces in file order, whole, those under faces among them: a surface's number on the command line
    /// is its place here.
    pub fn surfaces(&self) -> impl Iterator<Item = (EntityId, &Arc<Surface>)> {
        self.entities.iter().filter_map(|e| match &e.shape {
            Shape::Surface(surface) => Some((e.id, surface)),
            Shape::Face(face) => Some((e.id, face.surface())),
            _ => None,
        })
    }

    /// The same surfaces, of faces the trimmed part only.
    pub fn sheets(&self) -> impl Iterator<Item = (EntityId, Sheet)> {
        self.entities.iter().filter_map(|e| match &e.shape {
            Shape::Surface(surface) => Some((e.id, Sheet::Whole(Arc::clone(surface)))),
            Shape::Face(face) => Some((e.id, Sheet::Trimmed(Arc::clone(face)))),
            _ => None,
        })
    }

    /// The trimmed faces.
    pub fn faces(&self) -> impl Iterator<Item = (EntityId, &Arc<Face>)> {
        self.entities.iter().filter_map(|e| e.face().map(|f| (e.id, f)))
    }

    /// The free curves in file order: `Curve(id)` of a patch specification counts these.
    pub fn curves(&self) -> impl Iterator<Item = (EntityId, &Arc<Curve>)> {
        self.entities.iter().filter_map(|e| e.curve().map(|c| (e.id, c)))
    }

    /// The meshes and blocks in file order: `Chain(mesh: ..)` of a patch specification counts these.
    pub fn meshes(&self) -> impl Iterator<Item = (EntityId, &Arc<Facets>)> {
        self.entities.iter().filter_map(|e| e.facets().map(|f| (e.id, f)))
    }

    /// All originals that can be projected on or intersected, in the order of their numbers: first the surfaces,
    /// then meshes and blocks.
    pub fn bodies(&self) -> impl Iterator<Item = (EntityId, Body)> {
        let surfaces = self.sheets().map(|(id, sheet)| (id, Body::from(sheet)));
        surfaces.chain(self.meshes().map(|(id, f)| (id, Body::Facets(Arc::clone(f)))))
    }

    /// The healed patches.
    pub fn patches(&self) -> impl Iterator<Item = (EntityId, &Arc<Patch>)> {
        self.entities.iter().filter_map(|e| match &e.shape {
            Shape::Patch(patch) => Some((e.id, patch)),
            _ => None,
        })
    }

    /// Adds a visible entity and says which id it got.
    pub fn add(&mut self, name: impl Into<String>, shape: Shape, color: Option<[f32; 3]>) -> EntityId {
        let id = EntityId(self.next_id);
        self.next_id += 1;
        let entity = Entity { id, name: name.into(), shape, visible: true, color };
        Arc::make_mut(&mut self.entities).push(Arc::new(entity));
        id
    }

    /// Keeps only the entities for which `keep` is true.
    pub fn retain(&mut self, keep: impl Fn(&Entity) -> bool) {
        Arc::make_mut(&mut self.entities).retain(|e| keep(e));
    }

    /// Changes one entity in place (its id stays); false when there is none with this id.
    pub fn edit(&mut self, id: EntityId, change: impl FnOnce(&mut Entity)) -> bool {
        let Some(at) = self.entities.iter().position(|e| e.id == id) else { return false };
        change(Arc::make_mut(&mut Arc::make_mut(&mut self.entities)[at]));
        true
    }

    /// A box around all entities.
    pub fn bounds(&self) -> Aabb {
        self.entities.iter().fold(Aabb::EMPTY, |all, e| all.union(&e.bounds()))
    }

    /// The default tolerances for this model.
    pub fn tolerances(&self) -> Tolerances {
        Tolerances::of(&self.bounds())
    }
}
