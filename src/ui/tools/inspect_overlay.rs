//! What the Inspect tool draws: volumes, tori and uv pictures, made by a worker once for a choice of options.

use std::sync::Arc;

use super::super::theme;
use super::super::viewport::{Overlay, linear};
use super::inspect::{Focus, InspectSession, Look, Options};
use super::inspect_subject::Subject;
use crate::kernel::job::Job;
use crate::model::document::EntityId;
use crate::render::{Key, MeshItem, VolumeForm, VolumeItem, with_alpha};
use crate::view::inspect::{
    Coloring, Hierarchy, MOST, Overlaps, Scale, Shown, TorusMesh, cells, children, leaf_tori, whole_torus,
};
use crate::view::uv::{UvInk, UvMark, UvPicture};

/// The number under which the tool's own things are kept on the graphics card.
const OWN: u64 = u64::MAX - 1;
/// Its part for the whole torus.
const WHOLE: u32 = 0;
/// How far a whole torus is drawn, in diagonals of its surface.
const REACH: f64 = 2.0;
/// The colour of the levels above and below, sRGB: between the ends of viridis and seen on both backdrops.
const GHOST: [u8; 3] = [0x90, 0x96, 0xa0];
/// Partners of the node in focus that are marked.
pub const PARTNERS: usize = 256;

/// A level of one or two hierarchies, ready to be drawn.
#[derive(Debug)]
pub struct Dressed {
    /// Of which entities.
    pub entities: Vec<EntityId>,
    /// The nodes that are drawn, for each.
    pub shown: Vec<Shown>,
    /// How many nodes the level has, drawn or not.
    pub nodes: Vec<usize>,
    /// The options that it was made for.
    pub options: Options,
    /// The overlapping pairs, when they were asked for.
    pub overlaps: Option<Overlaps>,
    /// The scale of the volumes' colours.
    pub scale: Scale,
    /// The scale of the tori's colours.
    pub tori_scale: Option<Scale>,
    /// Leaf tori that are drawn, and how many of them have tubes thinner than they are wide.
    pub tori_count: [usize; 2],
    volumes: Vec<VolumeItem>,
    tori: Vec<MeshItem>,
    pictures: Vec<UvPicture>,
}

impl Dressed {
    /// Makes it. `number` is used by nobody else.
    pub fn new(
        trees: &[Arc<Hierarchy>],
        names: &[String],
        options: &Options,
        number: u64,
        job: &Job,
    ) -> Result<Self, String> {
        let dress = |h: &Hierarchy, level: u32| {
            Shown::new(&h.tree, &h.surface, level, options.form, options.coloring, job).map_err(|e| e.to_string())
        };
        let overlaps = match trees {
            [a, b] if options.pairs => Some(Overlaps::find(a, b, options.level, job)),
            _ => None,
        };
        let (mut shown, mut nodes) = (Vec::new(), Vec::new());
        for (k, hierarchy) in trees.iter().enumerate() {
            let level = dress(hierarchy, options.level)?;
            nodes.push(level.nodes.len());
            shown.push(match &overlaps {
                Some(overlaps) => {
                    let kept = overlaps.nodes(k == 1);
                    level.only(|id| kept.contains(&id))
                }
                None => level,
            });
        }
        // One scale for all, so that colours can be compared.
        let values: Vec<f32> = shown.iter().flat_map(|s| s.values.iter().copied()).collect();
        let scale = match (options.coloring, shown.first()) {
            (Coloring::Level, Some(first)) => first.scale,
            _ => Scale::of(&values),
        };
        shown.iter_mut().for_each(|s| s.scale = scale);

        let (mut volumes, mut pictures) = (Vec::new(), Vec::new());
        let mut part = WHOLE;
        let mut key = || {
            part += 1;
            Key::new(OWN, part)
        };
        for ((hierarchy, shown), name) in trees.iter().zip(&shown).zip(names) {
            let origin = hierarchy.surface.bounds().center();
            let mut level = VolumeItem::of_level(key(), number, shown, origin);
            if let Some(level) = level.as_mut().filter(|_| options.tori) {
                // Bodies would tint the tori.
                level.form = VolumeForm::Outline { width: 1.0, fill: 0.0 };
            }
            volumes.extend(level);
            let levels = [options.level.checked_sub(1), Some(options.level + 1).filter(|l| *l <= hierarchy.height())];
            for (level, width) in levels.into_iter().zip([1.6, 0.7]).filter(|_| options.ghosts) {
                if let Some(level) = level {
                    let ghost = dress(hierarchy, level)?;
                    volumes.extend(VolumeItem::ghost(key(), number, &ghost, GHOST, origin, width));
                }
            }
            let mut picture = UvPicture::plain(hierarchy.entity, title(name, options), &hierarchy.surface);
            picture.cells = Some(cells(&hierarchy.tree, &hierarchy.surface, shown, number));
            pictures.push(picture);
        }
        let mut out = Self {
            entities: trees.iter().map(|t| t.entity).collect(),
            shown,
            nodes,
            options: *options,
            overlaps,
            scale,
            tori_scale: None,
            tori_count: [0; 2],
            volumes,
            tori: Vec::new(),
            pictures,
        };
        if options.tori {
            out.add_tori(trees, number, job);
        }
        Ok(out)
    }

    fn add_tori(&mut self, trees: &[Arc<Hierarchy>], number: u64, job: &Job) {
        let mut meshes: Vec<TorusMesh> = Vec::new();
        for hierarchy in trees {
            let leaves = hierarchy.tree.level(hierarchy.height());
            if leaves.len() > MOST {
                return;
            }
            let Some(mesh) = leaf_tori(&hierarchy.tree, &leaves, job) else { return };
            meshes.push(mesh);
        }
        let scales: Vec<Scale> = meshes.iter().filter_map(|m| m.scale).collect();
        let ends: Vec<f32> = scales.iter().flat_map(|s| [s.low as f32, s.high as f32]).collect();
        let scale = match scales.as_slice() {
            [only] => *only,
            _ => Scale::of(&ends),
        };
        for (k, (mesh, hierarchy)) in meshes.iter().zip(trees).enumerate() {
            let origin = hierarchy.surface.bounds().center();
            self.tori.push(MeshItem::of_tori(Key::new(OWN, 100 + k as u32), number, mesh, &scale, origin));
            self.tori_count[0] += mesh.leaves[0];
            self.tori_count[1] += mesh.leaves[1];
        }
        self.tori_scale = Some(scale);
    }

    /// Whether the tori were asked for and are too many to be drawn.
    pub fn too_many_tori(&self) -> bool {
        self.options.tori && self.tori.is_empty()
    }

    /// The nodes of the other subject that overlap a node.
    pub fn partners(&self, focus: Focus) -> &[crate::kernel::bvh::NodeId] {
        let Some(overlaps) = &self.overlaps else { return &[] };
        let table = if focus.subject == 0 { &overlaps.partners } else { &overlaps.back };
        table.get(&focus.node).map_or(&[], |list| list.as_slice())
    }
}

fn title(name: &str, options: &Options) -> String {
    let what = match options.coloring {
        Coloring::Level => "level",
        Coloring::Error => "swept radius",
        Coloring::Cone => "normal cone",
    };
    format!("{name} · level {} · {what}", options.level)
}

impl InspectSession {
    /// What is added to the picture.
    pub fn overlay(&self, dark: bool) -> Overlay {
        if self.look == Look::Search {
            return self.search_overlay();
        }
        let mut overlay = Overlay { revision: self.revision, calm: true, ..Overlay::default() };
        let Some(dressed) = self.current() else { return overlay };
        overlay.volumes = dressed.volumes.clone();
        overlay.meshes = dressed.tori.clone();
        if !dressed.tori.is_empty() {
            // The tori stand for the surface, which would flicker through them.
            overlay.without = dressed.entities.clone();
        }
        let focus = self.focus().filter(|_| self.whole_torus);
        let torus = focus.and_then(|f| {
            let hierarchy = self.subjects.get(f.subject)?.hierarchy.value()?;
            Some((hierarchy.tree.torus(f.node)?, hierarchy))
        });
        if let Some((torus, hierarchy)) = torus {
            let bounds = hierarchy.surface.bounds();
            let mesh = whole_torus(&torus, REACH * bounds.diagonal());
            let color = with_alpha(linear(theme::tokens(dark).warn), 0.35);
            overlay.meshes.push(MeshItem::of_torus(Key::new(OWN, WHOLE), self.revision, &mesh, color, bounds.center()));
        }
        overlay
    }

    /// The pictures of the uv view: the level in colour, the node in focus, its children, its partners.
    pub fn draw_pictures(&self) -> Vec<Arc<UvPicture>> {
        let Some(dressed) = self.current() else {
            let plain = |s: &Subject| UvPicture::plain(s.entity, s.name.clone(), &s.surface);
            return self.subjects.iter().map(|s| Arc::new(plain(s))).collect();
        };
        let mut pictures = dressed.pictures.clone();
        for focus in [self.pinned, self.hovered].into_iter().flatten() {
            let tree = |k: usize| self.subjects.get(k).and_then(|s| s.hierarchy.value()).map(|h| &h.tree);
            let (Some(own), Some(picture)) = (tree(focus.subject), pictures.get_mut(focus.subject)) else { continue };
            for child in children(own, focus.node) {
                picture.marks.push(UvMark::rectangle(own.rectangle(child)).ink(UvInk::Text).width(1.0).fill(0.0));
            }
            picture.marks.push(UvMark::rectangle(own.rectangle(focus.node)).ink(UvInk::Accent).width(2.5).fill(0.25));
            let other = 1 - focus.subject.min(1);
            let (Some(tree), Some(picture)) = (tree(other), pictures.get_mut(other)) else { continue };
            for &partner in dressed.partners(focus).iter().take(PARTNERS) {
                picture.marks.push(UvMark::rectangle(tree.rectangle(partner)).ink(UvInk::Warn).width(1.5).fill(0.2));
            }
        }
        pictures.into_iter().map(Arc::new).collect()
    }
}
