//! The search for self-intersections in the Inspect tool: what is shown of it, and how it is drawn in both views.

use std::sync::Arc;

use glam::DVec2;

use super::super::theme;
use super::super::viewport::{Overlay, linear};
use super::fresh;
use super::inspect::{InspectSession, Look};
use crate::model::document::EntityId;
use crate::render::{ColorScale, Dash, Field, Hidden, LineStyle, Sketch, srgb, with_alpha};
use crate::view::inspect::{
    LevelMesh, SETTLED, SETTLED_AT, STATES, Searched, WindowArea, corners, state_color, state_name,
};
use crate::view::intersection::marks::Focus;
use crate::view::intersection::{Drawing, domains};
use crate::view::uv::{UvDash, UvInk, UvMark, UvPicture};
use crate::work::{Jobs, Latest};

/// The number under which what is drawn of the search is kept on the graphics card.
const OWN: u64 = u64::MAX - 2;
/// The sizes of the windows.
pub const SIZES: [u32; 2] = [2, 3];
/// The most nodes that are outlined, in either view.
const OUTLINED: usize = 4000;

/// What is shown of the search.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SearchOptions {
    /// Splits above the nodes.
    pub level: u32,
    /// Whether the failed windows of either size are shown.
    pub windows: [bool; 2],
    /// Whether the pairs of leaves are shown in which a curve was looked for.
    pub pairs: bool,
    /// Whether the converted leaves are shown.
    pub leaves: bool,
}

/// A node of the ternary tree of one of the subjects.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SearchFocus {
    /// Of the first or the second subject.
    pub subject: usize,
    /// Its place in the record.
    pub node: usize,
    /// The parameters under the cursor.
    pub uv: DVec2,
}

/// What is looked at of the search.
#[derive(Default)]
pub struct SearchView {
    /// What is shown.
    pub options: SearchOptions,
    /// What is under the cursor.
    pub hovered: Option<SearchFocus>,
    /// What stays.
    pub pinned: Option<SearchFocus>,
    /// The converted leaf that is explained: subject and place in its record.
    pub leaf: Option<(usize, usize)>,
    /// What is drawn.
    pub dressed: Latest<SearchDressed>,
    asked: Option<(Vec<usize>, SearchOptions, bool)>,
    /// Whether the level was chosen by hand.
    chosen: bool,
}

impl SearchView {
    /// Forgets what was about other surfaces.
    pub fn forget(&mut self) {
        (self.hovered, self.pinned, self.leaf, self.asked) = (None, None, None, None);
    }

    /// What is under the cursor, otherwise what is pinned.
    pub fn focus(&self) -> Option<SearchFocus> {
        self.hovered.or(self.pinned)
    }
}

/// The search of one or two surfaces, ready to be drawn.
pub struct SearchDressed {
    /// Of which entities.
    pub entities: Vec<EntityId>,
    /// The options that it was made for.
    pub options: SearchOptions,
    /// How many windows of either size failed.
    pub failed: [usize; 2],
    /// Which states occur, by their places in [`STATES`] or [`SETTLED_AT`].
    pub states: [bool; SETTLED_AT + 1],
    /// Whether the level is too fine for its colours in space.
    pub too_fine: bool,
    /// Whether the level has too many nodes to outline them all.
    pub crowded: bool,
    sketch: Sketch,
    pictures: Vec<UvPicture>,
}

impl SearchDressed {
    fn new(all: &[Arc<Searched>], options: SearchOptions, dark: bool, number: u64) -> Self {
        let origin = all.first().and_then(|s| s.surface()).map(|s| s.bounds().center()).unwrap_or_default();
        let mut out = Self {
            entities: all.iter().filter_map(|s| s.entity()).collect(),
            options,
            failed: SIZES.map(|size| all.iter().map(|s| s.windows(size).count()).sum()),
            states: [false; SETTLED_AT + 1],
            too_fine: false,
            crowded: false,
            sketch: Sketch::new(OWN, number, origin),
            pictures: Vec::new(),
        };
        let steps = STATES.iter().map(|s| srgb(s.3)).chain([srgb(SETTLED)]).collect();
        let colors = ColorScale { steps, band: -1.0, ..ColorScale::sequential(0.0, (SETTLED_AT + 1) as f32) };
        let colors = Arc::new(colors);
        for searched in all {
            let mesh = LevelMesh::new(searched, options.level);
            for (k, seen) in out.states.iter_mut().enumerate() {
                *seen |= mesh.has(k);
            }
            out.too_fine |= mesh.too_fine;
            let values = mesh.states.iter().map(|&s| s as f32 + 0.5).collect();
            let normals = mesh.normals.iter().map(|n| n.as_vec3().to_array()).collect();
            let field = Field { revision: number, values: Arc::new(values), scale: Arc::clone(&colors) };
            out.sketch.mesh(&mesh.points, normals, mesh.triangles, srgb(0xffffff), Some(field));
            out.outlines(searched, dark);
            let picture = out.picture(searched, dark);
            out.pictures.extend(picture);
        }
        out
    }

    /// The borders of nodes, windows and leaves in space, and the curves that were found.
    fn outlines(&mut self, searched: &Searched, dark: bool) {
        let t = theme::tokens(dark);
        let nodes = searched.level(self.options.level);
        self.crowded |= nodes.len() > OUTLINED;
        let boxes = nodes.iter().take(OUTLINED).filter_map(|&k| searched.node(k)).map(|n| n.uv_box);
        let ink = with_alpha(srgb(if dark { 0x14181d } else { 0xffffff }), 0.85);
        let thin = |width, color| LineStyle { width, color, dash: Dash::Solid, hidden: Hidden::Gone };
        self.sketch.polylines(boxes.map(|b| searched.outline(b)), thin(1.2, ink));
        if let Some(surface) = searched.surface() {
            for (k, &size) in SIZES.iter().enumerate().filter(|(k, _)| self.options.windows[*k]) {
                let area = WindowArea::new(&searched.record, size);
                let border = area.border.iter().map(|l| l.iter().map(|&uv| surface.eval(uv)).collect::<Vec<_>>());
                let style = LineStyle { dash: [Dash::SHORT, Dash::Solid][k], ..thin(2.2, linear(t.bad)) };
                self.sketch.polylines(border, style);
            }
        }
        if self.options.leaves {
            let cells = searched.record.leaves.iter().map(|l| searched.outline(l.cell));
            self.sketch.polylines(cells, LineStyle { hidden: Hidden::OnTop, ..thin(2.0, linear(t.accent)) });
        }
        self.sketch.intersection(&Drawing::new(&searched.found, Focus::default(), dark), 1.0, dark);
    }

    /// The same in the domain.
    fn picture(&mut self, searched: &Searched, dark: bool) -> Option<UvPicture> {
        let own = |rgb: u32| UvInk::Own([16, 8, 0].map(|s| (rgb >> s & 255) as f32 / 255.0));
        let (surface, entity) = (searched.surface()?, searched.entity()?);
        let options = self.options;
        let title = format!("{} · self-intersection search, level {}", searched.found.name(0), options.level);
        let mut picture = UvPicture::plain(entity, title, surface);
        let mut nodes: Vec<_> = searched.covering(options.level).filter_map(|k| searched.node(k)).collect();
        // What is split comes last, on top of settled neighbours that it overlaps.
        nodes.sort_by_key(|n| {
            (n.level == options.level, STATES.iter().position(|s| s.0 == n.state).unwrap_or_default())
        });
        self.crowded |= nodes.len() > OUTLINED;
        for node in nodes.iter().rev().take(OUTLINED).rev() {
            let here = node.level == options.level;
            let (rgb, fill) = if here { (state_color(node.state), 0.45) } else { (SETTLED, 0.22) };
            let mark = UvMark::rectangle(corners(node.uv_box)).ink(own(rgb)).fill(fill);
            picture.marks.push(mark.width(if here { 1.2 } else { 0.0 }));
        }
        for (k, &size) in SIZES.iter().enumerate().filter(|(k, _)| options.windows[*k]) {
            let area = WindowArea::new(&searched.record, size);
            let fill = |run: &[[f64; 2]; 2]| UvMark::rectangle(corners(*run)).ink(UvInk::Bad).width(0.0).fill(0.25);
            picture.marks.extend(area.runs.iter().map(fill));
            let dash = [UvDash::Short, UvDash::Solid][k];
            let line = |l: &Vec<DVec2>| UvMark::polyline(l.clone()).ink(UvInk::Bad).width(1.5).dash(dash);
            picture.marks.extend(area.border.iter().map(line));
        }
        if options.pairs {
            let boxes = searched.record.leaf_pairs.iter().flatten();
            let outline = |b: &[[f64; 2]; 2]| UvMark::rectangle(corners(*b)).ink(UvInk::Text).width(1.0).fill(0.15);
            picture.marks.extend(boxes.take(OUTLINED).map(outline));
            self.crowded |= 2 * searched.record.leaf_pairs.len() > OUTLINED;
        }
        if options.leaves {
            picture.marks.extend(leaf_marks(searched));
        }
        let found = domains::pictures(&searched.found, Focus::default(), None, dark);
        picture.marks.extend(found.into_iter().flat_map(|p| p.marks));
        Some(picture)
    }
}

/// The converted leaves: the cell, its slabs, R, and the triangles around the quadrangle, which is drawn with its miter
/// point.
fn leaf_marks(searched: &Searched) -> impl Iterator<Item = UvMark> {
    searched.record.leaves.iter().flat_map(|leaf| {
        let slab = |b: &[[f64; 2]; 2]| UvMark::rectangle(corners(*b)).ink(UvInk::Accent).width(1.0).fill(0.06);
        let mut marks = vec![UvMark::rectangle(corners(leaf.cell)).ink(UvInk::Accent).width(2.0).fill(0.12)];
        marks.extend(leaf.slabs.iter().map(slab));
        marks.extend(leaf.middle.iter().map(slab));
        for t in &leaf.triangles {
            let line = t.iter().chain(t.first()).copied().collect();
            marks.push(UvMark::polyline(line).ink(UvInk::Text).width(1.0));
        }
        marks
    })
}

impl InspectSession {
    /// The search of a subject.
    pub fn searched(&self, subject: usize) -> Option<&Arc<Searched>> {
        self.subjects.get(subject)?.searched.value()
    }

    /// The coarsest level that no subject goes beyond.
    pub fn deepest(&self) -> u32 {
        let levels = self.subjects.iter().filter_map(|s| s.searched.value()).map(|s| s.levels.len() as u32);
        levels.max().unwrap_or(1).saturating_sub(1)
    }

    /// Changes the level of the ternary trees.
    pub fn set_search_level(&mut self, level: u32) {
        let level = level.min(self.deepest());
        if level != self.search.options.level {
            self.search.chosen = true;
            self.search.options.level = level;
        }
    }

    /// The failed windows of both sizes, or none.
    pub fn toggle_windows(&mut self) {
        let on = self.search.options.windows == [false; 2];
        self.search.options.windows = [on; 2];
    }

    /// The node under a parameter pair.
    pub fn search_over(&self, entity: EntityId, uv: DVec2) -> Option<SearchFocus> {
        let subject = self.subjects.iter().position(|s| s.entity == entity)?;
        let node = self.searched(subject)?.over(self.search.options.level, uv)?;
        Some(SearchFocus { subject, node, uv })
    }

    /// Moves what is under the cursor.
    pub fn hover_search(&mut self, focus: Option<SearchFocus>) {
        let place = |f: Option<SearchFocus>| f.map(|f| (f.subject, f.node, f.uv));
        if place(focus) != place(self.search.hovered) {
            self.search.hovered = focus;
            self.moved = true;
            self.revision += 1;
        }
    }

    /// Pins a node, or lets go of it when it was pinned.
    pub fn pin_search(&mut self, focus: Option<SearchFocus>) {
        let node = |f: Option<SearchFocus>| f.map(|f| (f.subject, f.node));
        self.search.pinned = if node(focus) == node(self.search.pinned) { None } else { focus };
        self.moved = true;
        self.revision += 1;
    }

    /// Asks a worker for what is to be drawn of the search, when that has changed.
    pub fn dress_search(&mut self, jobs: &mut Jobs, dark: bool) {
        if !self.is_built() {
            return;
        }
        if !self.search.chosen {
            // The level that shows most at once.
            let all = self.subjects.iter().filter_map(|s| s.searched.value());
            let most = all.flat_map(|s| &s.levels).filter(|l| !l.below_grid).max_by_key(|l| l.nodes);
            self.search.options.level = most.map_or(0, |l| l.level);
        }
        self.search.options.level = self.search.options.level.min(self.deepest());
        let all: Vec<Arc<Searched>> = self.subjects.iter().filter_map(|s| s.searched.value().cloned()).collect();
        let options = self.search.options;
        let stamp = (all.iter().map(|s| Arc::as_ptr(s) as usize).collect(), options, dark);
        if self.search.asked.as_ref() != Some(&stamp) {
            self.search.asked = Some(stamp);
            let number = fresh();
            self.search.dressed.request(jobs, "Draw the search", format!("{options:?}"), move |_| {
                SearchDressed::new(&all, options, dark, number)
            });
        }
    }

    /// What is drawn of the search, when it is that of the present subjects.
    pub fn search_drawn(&self) -> Option<&SearchDressed> {
        let dressed = self.search.dressed.value().filter(|_| self.look == Look::Search)?;
        let same = dressed.entities.len() == self.subjects.len()
            && dressed.entities.iter().zip(&self.subjects).all(|(e, s)| *e == s.entity);
        same.then_some(dressed)
    }

    /// What is added to the picture.
    pub fn search_overlay(&self) -> Overlay {
        let mut overlay = Overlay { revision: self.revision, calm: true, ..Overlay::default() };
        if let Some(dressed) = self.search_drawn() {
            overlay.add(dressed.sketch.clone());
            if !dressed.too_fine {
                // The coloured level stands for the surface.
                overlay.without = dressed.entities.clone();
            }
        }
        overlay
    }

    /// The pictures of the uv view: the level by what was proved, the node in focus, its children, the window there.
    pub fn search_pictures(&self) -> Vec<Arc<UvPicture>> {
        let Some(dressed) = self.search_drawn() else {
            let plain = self.subjects.iter().map(|s| UvPicture::plain(s.entity, s.name.clone(), &s.surface));
            return plain.map(Arc::new).collect();
        };
        let mut pictures = dressed.pictures.clone();
        for focus in [self.search.pinned, self.search.hovered].into_iter().flatten() {
            let (Some(searched), Some(picture)) = (self.searched(focus.subject), pictures.get_mut(focus.subject))
            else {
                continue;
            };
            let mut mark = |uv_box, ink, width, fill| {
                picture.marks.push(UvMark::rectangle(corners(uv_box)).ink(ink).width(width).fill(fill));
            };
            for child in searched.children(focus.node).iter().filter_map(|&k| searched.node(k)) {
                mark(child.uv_box, UvInk::Text, 1.0, 0.0);
            }
            if let Some(node) = searched.node(focus.node) {
                mark(node.uv_box, UvInk::Accent, 2.5, 0.25);
            }
            for window in self.windows_at(focus) {
                mark(window, UvInk::Bad, 2.5, 0.3);
            }
            if let Some(partner) = self.partner_of(focus) {
                mark(partner, UvInk::Warn, 2.5, 0.4);
            }
        }
        pictures.into_iter().map(Arc::new).collect()
    }

    /// The failed windows at the cursor, of the sizes that are shown.
    pub fn windows_at(&self, focus: SearchFocus) -> Vec<[[f64; 2]; 2]> {
        let Some(searched) = self.searched(focus.subject) else { return Vec::new() };
        let sizes = SIZES.iter().zip(self.search.options.windows).filter(|(_, on)| *on);
        sizes.filter_map(|(&size, _)| Some(searched.window_over(size, focus.uv)?.uv_box)).collect()
    }

    /// The leaf that was paired with the one under the cursor, while pairs are shown.
    pub fn partner_of(&self, focus: SearchFocus) -> Option<[[f64; 2]; 2]> {
        let searched = self.searched(focus.subject).filter(|_| self.search.options.pairs)?;
        searched.partner(focus.uv)
    }
}

/// One line about a node.
pub fn node_line(searched: &Searched, at: usize) -> Option<String> {
    let node = searched.node(at)?;
    let cells = match node.cells {
        Some([u, v]) => format!("{} x {} cells", u[1] - u[0], v[1] - v[0]),
        None => "below the grid".to_owned(),
    };
    Some(format!("Level {} · {} · {} · {cells}", node.level, state_name(node.state), short_role(searched, at)))
}

fn short_role(searched: &Searched, at: usize) -> &'static str {
    let name = searched.node(at).map_or("", |n| crate::view::inspect::role_name(n.role));
    name.split(',').next().unwrap_or(name)
}
