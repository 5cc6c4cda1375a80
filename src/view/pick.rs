//! What is under the cursor: points, curves and surfaces, on the CPU, by trees that outlast the camera's moves.
//!
//! Points and curves count within 8 pixels of the cursor, or within 16 when nothing that the filter allows is within
//! 8; surfaces count where the line of sight meets them. A point goes before a curve and a curve before a surface. Among
//! curves the nearest in pixels wins; those within two pixels of it are equals, and of these the nearest in depth
//! wins. What a surface hides is not hit (each candidate is asked with its own line of sight, so a curve 8 pixels
//! away on a steep surface is not lost), nor what is hidden or cut away. The winner's parameters are those of the
//! exact curve or surface: the polyline or triangle only starts a Newton iteration.
//!
//! Cost: one walk of the segment trees and one to a few rays, some ten microseconds for a million triangles.

use glam::{DMat3, DVec2, DVec3};

use super::display::{CurveRef, Geometry};
use super::scene::{Item, ItemKind, Scene};
use super::section::SectionPlane;
use super::segment_tree::{Near, Pyramid};
use super::viewport::{Ray, View};
use crate::kernel::geom::Surface;
use crate::model::document::EntityId;

/// How near in pixels the cursor must be to a point or curve.
pub const RADIUS: f64 = 8.0;
/// How near when nothing allowed is within [`RADIUS`].
pub const WIDE_RADIUS: f64 = 16.0;
/// Curves that differ by less than this in pixels are equally near.
const EQUAL: f64 = 2.0;
/// How many of the nearest curves are kept as candidates.
const CANDIDATES: usize = 24;

/// Which kinds of things may be picked. The active tool sets it, the filter bar shows it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Filter {
    /// Points that the tool offers.
    pub points: bool,
    /// Free curves.
    pub free_curves: bool,
    /// Borders of surfaces, patches, meshes and blocks, edges of faces, and feature edges of meshes.
    pub borders: bool,
    /// Iso-lines and grid lines, where they are drawn.
    pub iso_lines: bool,
    /// Surfaces, meshes and blocks of the model.
    pub surfaces: bool,
    /// Healed patches.
    pub patches: bool,
}

impl Filter {
    /// Everything but iso-lines.
    pub const ALL: Self =
        Self { points: true, free_curves: true, borders: true, iso_lines: false, surfaces: true, patches: true };
    /// Nothing.
    pub const NONE: Self =
        Self { points: false, free_curves: false, borders: false, iso_lines: false, surfaces: false, patches: false };
    /// Curves of every kind.
    pub const CURVES: Self = Self { free_curves: true, borders: true, iso_lines: true, ..Self::NONE };
    /// Surfaces and patches.
    pub const SURFACES: Self = Self { surfaces: true, patches: true, ..Self::NONE };

    /// What either allows.
    #[must_use]
    pub fn or(self, other: Self) -> Self {
        Self {
            points: self.points || other.points,
            free_curves: self.free_curves || other.free_curves,
            borders: self.borders || other.borders,
            iso_lines: self.iso_lines || other.iso_lines,
            surfaces: self.surfaces || other.surfaces,
            patches: self.patches || other.patches,
        }
    }

    /// What both allow.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        Self {
            points: self.points && other.points,
            free_curves: self.free_curves && other.free_curves,
            borders: self.borders && other.borders,
            iso_lines: self.iso_lines && other.iso_lines,
            surfaces: self.surfaces && other.surfaces,
            patches: self.patches && other.patches,
        }
    }

    fn curve(&self, curve: &CurveRef) -> bool {
        match curve {
            CurveRef::Free(_) => self.free_curves,
            CurveRef::Border(..) | CurveRef::Edge(..) | CurveRef::Chain(..) => self.borders,
            CurveRef::Iso(..) | CurveRef::GridLine(..) => self.iso_lines,
        }
    }

    fn any_curve(&self) -> bool {
        self.free_curves || self.borders || self.iso_lines
    }

    fn surface(&self, kind: ItemKind) -> bool {
        match kind {
            ItemKind::Surface | ItemKind::Mesh => self.surfaces,
            ItemKind::Patch => self.patches,
            ItemKind::Curve => false,
        }
    }
}

/// How to pick.
#[derive(Clone, Copy, Debug)]
pub struct PickOptions<'a> {
    /// What may be picked.
    pub filter: Filter,
    /// Whether surfaces hide what is behind them; false in wireframe and x-ray.
    pub occlusion: bool,
    /// What is cut away.
    pub section: Option<SectionPlane>,
    /// Points that the tool offers, by their place in this list.
    pub points: &'a [DVec3],
}

impl Default for PickOptions<'_> {
    fn default() -> Self {
        Self { filter: Filter::ALL, occlusion: true, section: None, points: &[] }
    }
}

/// What was hit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Target {
    /// A point that the tool offered, by its place in the list.
    Point(usize),
    /// A curve and the parameter on it.
    Curve {
        /// Which curve.
        curve: CurveRef,
        /// Its parameter.
        t: f64,
    },
    /// A surface, patch, mesh or block and the parameters on it.
    Surface {
        /// Which one.
        entity: EntityId,
        /// Its parameters; the number of the triangle and 0 where there are no parameters.
        uv: DVec2,
    },
}

impl Target {
    fn rank(&self) -> u8 {
        match self {
            Self::Point(_) => 0,
            Self::Curve { .. } => 1,
            Self::Surface { .. } => 2,
        }
    }

    /// Whether it is the same thing, wherever on it.
    pub fn same_thing(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Point(a), Self::Point(b)) => a == b,
            (Self::Curve { curve: a, .. }, Self::Curve { curve: b, .. }) => a == b,
            (Self::Surface { entity: a, .. }, Self::Surface { entity: b, .. }) => a == b,
            _ => false,
        }
    }
}

/// A hit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PickHit {
    /// What was hit.
    pub target: Target,
    /// The point of it.
    pub point: DVec3,
    /// Its distance from the cursor in pixels; 0 for a surface.
    pub distance: f64,
    /// Its depth.
    pub depth: f64,
    /// Whether a surface is in front of it (only [`pick_all`] lists such).
    pub hidden: bool,
}

/// The best hit at a pixel, if there is one.
pub fn pick(scene: &Scene, view: &View, pixel: DVec2, options: &PickOptions) -> Option<PickHit> {
    let mut pyramid = Pyramid::new(view, pixel, RADIUS, options.section.as_ref());
    for radius in [RADIUS, WIDE_RADIUS] {
        pyramid.set_radius(radius);
        let found = best_point(scene, &pyramid, options).or_else(|| best_curve(scene, &mut pyramid, options));
        if found.is_some() {
            return found;
        }
        // A surface under the cursor is a hit at distance 0: the wider circle is only for when there is none.
        let surface = first_surface(scene, view, &view.ray(pixel), options, |item| options.filter.surface(item.kind));
        if surface.is_some() {
            return surface;
        }
    }
    None
}

/// All things at a pixel, each once, in the order of [`pick`], those behind a surface after the others: for clicking
/// again at the same place and for the list of Alt+click.
pub fn pick_all(scene: &Scene, view: &View, pixel: DVec2, options: &PickOptions) -> Vec<PickHit> {
    let mut hits: Vec<PickHit> = Vec::new();
    for radius in [RADIUS, WIDE_RADIUS] {
        if options.filter.points {
            hits.extend((0..options.points.len()).filter_map(|k| point_hit(view, pixel, radius, options, k)));
        }
        let mut pyramid = Pyramid::new(view, pixel, radius, options.section.as_ref());
        hits.extend(curve_candidates(scene, &mut pyramid, options, usize::MAX));
        if !hits.is_empty() {
            break;
        }
    }
    let cover = Cover::new(scene, &Pyramid::new(view, pixel, WIDE_RADIUS, options.section.as_ref()), options);
    for hit in &mut hits {
        hit.hidden = cover.hides(hit.point);
    }
    let ray = view.ray(pixel);
    let mut in_front = false;
    for hit in surface_hits(scene, view, &ray, options) {
        let listed = hits.iter().any(|h| h.target.same_thing(&hit.0.target));
        if options.filter.surface(hit.1) && !listed {
            hits.push(PickHit { hidden: options.occlusion && in_front, ..hit.0 });
        }
        in_front = true;
    }
    let nearest = |rank: u8| {
        let of_rank = hits.iter().filter(|h| h.target.rank() == rank && !h.hidden);
        of_rank.map(|h| h.distance).fold(f64::INFINITY, f64::min)
    };
    let nearest = [nearest(0), nearest(1), nearest(2)];
    // Equals (see the module's text) form the first band; behind it the distance in pixels decides.
    let key = |h: &PickHit| {
        let rank = h.target.rank();
        let band = if h.distance <= nearest[rank as usize] + EQUAL { 0.0 } else { h.distance };
        (h.hidden, rank, band, h.depth)
    };
    hits.sort_by(|a, b| {
        let (a, b) = (key(a), key(b));
        a.0.cmp(&b.0).then(a.1.cmp(&b.1)).then(a.2.total_cmp(&b.2)).then(a.3.total_cmp(&b.3))
    });
    hits
}

/// The surface point under a pixel, whatever the filter: the anchor for orbit and zoom.
pub fn under_cursor(scene: &Scene, view: &View, pixel: DVec2, section: Option<SectionPlane>) -> Option<DVec3> {
    let options = PickOptions { section, ..PickOptions::default() };
    first_surface(scene, view, &view.ray(pixel), &options, |_| true).map(|hit| hit.point)
}

fn point_hit(view: &View, pixel: DVec2, radius: f64, options: &PickOptions, k: usize) -> Option<PickHit> {
    let point = options.points[k];
    if options.section.is_some_and(|s| s.height(point) > 0.0) {
        return None;
    }
    let at = view.project(point).filter(|at| at.depth >= view.near)?;
    let distance = at.pixel.distance(pixel);
    (distance <= radius).then_some(PickHit {
        target: Target::Point(k),
        point,
        distance,
        depth: at.depth,
        hidden: false,
    })
}

fn best_point(scene: &Scene, pyramid: &Pyramid, options: &PickOptions) -> Option<PickHit> {
    if !options.filter.points || options.points.is_empty() {
        return None;
    }
    let (view, pixel, radius) = (pyramid.view(), pyramid.pixel(), pyramid.radius());
    let mut hits: Vec<PickHit> =
        (0..options.points.len()).filter_map(|k| point_hit(view, pixel, radius, options, k)).collect();
    in_order(&mut hits);
    let cover = Cover::new(scene, pyramid, options);
    hits.into_iter().find(|hit| !cover.hides(hit.point))
}

fn best_curve(scene: &Scene, pyramid: &mut Pyramid, options: &PickOptions) -> Option<PickHit> {
    let hits = curve_candidates(scene, pyramid, options, CANDIDATES);
    if hits.is_empty() {
        return None;
    }
    let cover = Cover::new(scene, pyramid, options);
    // The nearest that is seen, and then its equals by depth: nothing is asked of the surfaces twice.
    let first = hits.iter().position(|h| !cover.hides(h.point))?;
    let limit = hits[first].distance + EQUAL;
    let mut equals: Vec<&PickHit> = hits[first..].iter().take_while(|h| h.distance <= limit).collect();
    equals.sort_by(|a, b| a.depth.total_cmp(&b.depth));
    let best = equals.into_iter().find(|h| h.depth >= hits[first].depth || !cover.hides(h.point));
    best.copied().map(|hit| polished(scene, pyramid.view(), hit))
}

/// The nearest place of each of the `limit` nearest curves within the pyramid, nearest in pixels first.
pub(super) fn curve_candidates(
    scene: &Scene,
    pyramid: &mut Pyramid,
    options: &PickOptions,
    limit: usize,
) -> Vec<PickHit> {
    let mut found: Vec<(Near, CurveRef)> = Vec::new();
    if !options.filter.any_curve() {
        return Vec::new();
    }
    let full = pyramid.radius();
    for item in scene.items().iter().filter(|item| item.visible()) {
        let Some(display) = item.display.as_ref().filter(|_| pyramid.meets_box(&item.bounds)) else { continue };
        display.segments.visit(pyramid, |near, pyramid| {
            let curve = display.curves[near.curve as usize].curve;
            if !options.filter.curve(&curve) {
                return;
            }
            match found.iter().position(|(_, c)| *c == curve) {
                Some(at) if nearer(&near, &found[at].0) => found[at].0 = near,
                Some(_) => return,
                None => found.push((near, curve)),
            }
            if found.len() > limit {
                // Drop the farthest and look no farther than the farthest that is left.
                found.sort_by(|a, b| a.0.distance.total_cmp(&b.0.distance));
                found.pop();
                if let Some(last) = found.last() {
                    pyramid.set_radius(last.0.distance);
                }
            }
        });
    }
    pyramid.set_radius(full);
    let mut hits: Vec<PickHit> = found
        .into_iter()
        .map(|(near, curve)| PickHit {
            target: Target::Curve { curve, t: near.t },
            point: near.point,
            distance: near.distance,
            depth: near.depth,
            hidden: false,
        })
        .collect();
    in_order(&mut hits);
    hits
}

fn nearer(a: &Near, b: &Near) -> bool {
    a.distance < b.distance || (a.distance == b.distance && a.depth < b.depth)
}

fn in_order(hits: &mut [PickHit]) {
    // Stable, so equals keep the order of the document.
    hits.sort_by(|a, b| a.distance.total_cmp(&b.distance).then(a.depth.total_cmp(&b.depth)));
}

/// The surfaces that may be in front of something near a pixel: asked once, and then for every candidate there.
pub(super) struct Cover<'a> {
    items: Vec<&'a Item>,
    view: &'a View,
    options: PickOptions<'a>,
}

impl<'a> Cover<'a> {
    /// Those that a pyramid meets.
    pub(super) fn new(scene: &'a Scene, pyramid: &Pyramid<'a>, options: &PickOptions<'a>) -> Self {
        let meets = |item: &&Item| {
            options.occlusion && item.visible() && item.kind != ItemKind::Curve && pyramid.meets_box(&item.bounds)
        };
        Self { items: scene.items().iter().filter(meets).collect(), view: pyramid.view(), options: *options }
    }

    /// Whether one of them is in front of a point near the pixel by more than the triangles may err there. Without occlusion
    /// nothing is hidden.
    pub(super) fn hides(&self, point: DVec3) -> bool {
        if !self.options.occlusion {
            return false;
        }
        let Some(at) = self.view.project(point) else { return true };
        let ray = self.view.ray(at.pixel);
        let slack = 3.0 * self.view.pixel_size_at(at.depth.max(self.view.near));
        let reach = (point - ray.origin).dot(ray.direction) - slack;
        let Some([from, to]) = range(&ray, &self.options) else { return false };
        let start = ray.at(from);
        self.items.iter().filter_map(|item| item.display.as_ref()).any(|d| {
            // A coarse triangle in front of its own border is no cover.
            d.tree.is_hit(start, ray.direction, to.min(reach - 2.0 * d.chord_tol) - from)
        })
    }
}

/// Whether a surface is in front of a point. For many points near one pixel it costs less to ask for all at once.
pub fn is_hidden(scene: &Scene, view: &View, point: DVec3, options: &PickOptions) -> bool {
    let Some(at) = view.project(point) else { return true };
    Cover::new(scene, &Pyramid::new(view, at.pixel, RADIUS, options.section.as_ref()), options).hides(point)
}

/// The part of a ray that is not cut away.
fn range(ray: &Ray, options: &PickOptions) -> Option<[f64; 2]> {
    match &options.section {
        None => Some([0.0, f64::INFINITY]),
        Some(section) => section.kept(ray),
    }
}

fn first_surface(
    scene: &Scene,
    view: &View,
    ray: &Ray,
    options: &PickOptions,
    allowed: impl Fn(&Item) -> bool,
) -> Option<PickHit> {
    let [from, to] = range(ray, options)?;
    let start = ray.at(from);
    let mut best: Option<(f64, &Item, u32, DVec3)> = None;
    // A surface that the filter leaves out does not block the ones behind it: the nearest allowed one is meant.
    for item in scene.items().iter().filter(|item| item.visible() && allowed(item)) {
        let Some(display) = &item.display else { continue };
        let reach = best.map_or(to - from, |b| b.0);
        if let Some(hit) = display.tree.first_hit(start, ray.direction, reach)
            && best.is_none_or(|b| hit.t < b.0)
        {
            best = Some((hit.t, item, hit.triangle, hit.barycentric));
        }
    }
    let (_, item, triangle, barycentric) = best?;
    surface_hit(item, ray, view, triangle, barycentric)
}

/// All hits of the surfaces along a ray, nearest first, one for each crossing.
fn surface_hits(scene: &Scene, view: &View, ray: &Ray, options: &PickOptions) -> Vec<(PickHit, ItemKind)> {
    let mut out = Vec::new();
    let Some([from, to]) = range(ray, options) else { return out };
    let far = scene.items().iter().fold(0.0_f64, |far, item| {
        let reach = (item.bounds.center() - ray.origin).dot(ray.direction) + item.bounds.diagonal();
        far.max(reach)
    });
    let to = to.min(far);
    if from >= to {
        return out;
    }
    let mut hits = Vec::new();
    for item in scene.items().iter().filter(|item| item.visible() && item.kind != ItemKind::Curve) {
        let Some(display) = &item.display else { continue };
        display.tree.segment_hits(ray.at(from), ray.at(to), &mut hits);
        let mut last = f64::NEG_INFINITY;
        for hit in &hits {
            // A ray through an edge meets both its triangles.
            let t = from + hit.t * (to - from);
            if t - last > 2.0 * display.chord_tol
                && let Some(found) = surface_hit(item, ray, view, hit.triangle, hit.barycentric)
            {
                out.push((found, item.kind));
                last = t;
            }
        }
    }
    out.sort_by(|a, b| a.0.depth.total_cmp(&b.0.depth));
    out
}

fn surface_hit(item: &Item, ray: &Ray, view: &View, triangle: u32, barycentric: DVec3) -> Option<PickHit> {
    let mesh = &item.display.as_ref()?.mesh;
    let corners = mesh.triangles.get(triangle as usize)?.map(|k| k as usize);
    let weights = barycentric.to_array();
    let flat = corners.iter().zip(weights).map(|(&k, w)| mesh.points[k] * w).sum();
    let (uv, point) = match (&item.geometry, item.geometry.surface()) {
        (_, Some(surface)) => {
            let uv = corners.iter().zip(weights).map(|(&k, w)| mesh.uv[k] * w).sum();
            on_surface(surface, ray, view, uv, flat)
        }
        (Geometry::Facets(_), None) => (DVec2::new(f64::from(triangle), 0.0), flat),
        _ => return None,
    };
    let target = Target::Surface { entity: item.id(), uv };
    Some(PickHit { target, point, distance: 0.0, depth: view.depth(point), hidden: false })
}

/// Newton's iteration for S(u, v) = origin + t direction from a point of the triangles. Where it leads away (edge-on
/// triangles, poles) the point of the triangles and its parameters stand.
fn on_surface(surface: &Surface, ray: &Ray, view: &View, uv: DVec2, flat: DVec3) -> (DVec2, DVec3) {
    let start = uv;
    let mut uv = uv;
    let scale = surface.domain().map(|d| d[1] - d[0]);
    for _ in 0..6 {
        let jet = surface.jet(uv, 1);
        let off = jet.p() - ray.origin;
        let off = off - ray.direction * off.dot(ray.direction);
        let matrix = DMat3::from_cols(jet.u(), jet.v(), -ray.direction);
        let det = matrix.determinant();
        if det == 0.0 || !det.is_finite() {
            return (start, flat);
        }
        let step = matrix.inverse() * -off;
        let next = surface.clamped(uv + step.truncate());
        let moved = (next - uv).abs() / DVec2::from_array(scale);
        uv = next;
        if moved.max_element() < 1e-14 {
            break;
        }
    }
    let point = surface.eval(uv);
    let off = |p: DVec3| (p - ray.origin).cross(ray.direction).length();
    let far = (uv - start).abs() / DVec2::from_array(scale);
    let tol = 1e-3 * view.pixel_size_at(view.depth(flat).max(view.near));
    let good = point.is_finite() && far.max_element() < 0.05 && off(point) <= tol;
    if good { (uv, point) } else { (start, surface.eval(start)) }
}

/// Newton's iteration for the point of the exact curve nearest to the line of sight through the place that was found
/// on its polyline. Kept only when it stays near that place.
fn polished(scene: &Scene, view: &View, hit: PickHit) -> PickHit {
    let Target::Curve { curve, t } = hit.target else { return hit };
    let Some(item) = scene.curve_item(&curve) else { return hit };
    let Some([start, end]) = item.geometry.curve_domain(&curve) else { return hit };
    let Some(from) = view.project(hit.point) else { return hit };
    let ray = view.ray(from.pixel);
    let across = |v: DVec3| v - ray.direction * v.dot(ray.direction);
    let mut best = t;
    for _ in 0..5 {
        let Some([p, d, dd]) = item.geometry.curve_jet(&curve, best) else { return hit };
        let off = across(p - ray.origin);
        let slope = off.dot(d);
        let curvature = across(d).length_squared() + off.dot(dd);
        if curvature <= 0.0 {
            break;
        }
        let next = (best - slope / curvature).clamp(start, end);
        let moved = (next - best).abs();
        best = next;
        if moved < 1e-14 * (end - start) {
            break;
        }
    }
    let Some([point, ..]) = item.geometry.curve_jet(&curve, best) else { return hit };
    let Some(at) = view.project(point).filter(|_| (best - t).abs() < 0.02 * (end - start)) else { return hit };
    if at.pixel.distance(from.pixel) > 2.0 {
        return hit;
    }
    PickHit { target: Target::Curve { curve, t: best }, point, depth: at.depth, ..hit }
}

/// Clicking again at the same pixel goes through all hits there.
#[derive(Clone, Debug, Default)]
pub struct Cycle {
    pixel: Option<DVec2>,
    turn: usize,
}

impl Cycle {
    /// Which of the hits of [`pick_all`] a click at `pixel` means: the first at a new place, the next one
    /// at the same place (within 3 pixels). `None` when there are no hits.
    pub fn click<'a>(&mut self, pixel: DVec2, hits: &'a [PickHit]) -> Option<&'a PickHit> {
        let again = self.pixel.is_some_and(|p| p.distance(pixel) <= 3.0);
        self.turn = if again { self.turn + 1 } else { 0 };
        if !again {
            self.pixel = Some(pixel);
        }
        if hits.is_empty() {
            self.reset();
            return None;
        }
        hits.get(self.turn % hits.len())
    }

    /// The next click starts anew (the camera or the tool has changed).
    pub fn reset(&mut self) {
        *self = Self::default();
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::kernel::geom::{Aabb, Curve, Direction, Side};
    use crate::model::command::Command;
    use crate::model::document::{Document, Shape, Unit};
    use crate::view::camera::{Axis, Camera, Projection};
    use crate::view::display::tests::sphere;
    use crate::view::viewport::Viewport;

    const SCREEN: Viewport = Viewport { width: 800.0, height: 600.0 };

    fn square(z: f64) -> Shape {
        let corner = |x: f64, y: f64| DVec3::new(x, y, z);
        let corners = [corner(0.0, 0.0), corner(1.0, 0.0), corner(0.0, 1.0), corner(1.0, 1.0)];
        Shape::Surface(Arc::new(Surface::bilinear(corners).unwrap()))
    }

    fn segment(a: DVec3, b: DVec3) -> Shape {
        Shape::Curve(Arc::new(Curve::segment(a, b).unwrap()))
    }

    /// The scene of the shapes, and a view from an axis that shows all of it.
    fn look(shapes: Vec<Shape>, axis: Axis, projection: Projection) -> (Document, Scene, View) {
        let mut document = Document::new(Unit::Millimetre);
        for shape in shapes {
            document.add("x", shape, None);
        }
        let mut scene = Scene::default();
        scene.sync(&document);
        let mut camera = Camera { projection, ..Camera::default() };
        camera.look_along(axis);
        camera.frame(&scene.bounds(), SCREEN);
        let view = View::new(&camera, SCREEN, &scene.bounds());
        scene.refine(&view);
        (document, scene, view)
    }

    fn pixel(view: &View, p: DVec3) -> DVec2 {
        view.project(p).unwrap().pixel
    }

    #[test]
    fn a_sphere_is_hit_where_it_is_and_on_the_near_side() {
        for projection in [Projection::Perspective, Projection::Orthographic] {
            for axis in [Axis::Front, Axis::Oblique, Axis::Top] {
                let (_, scene, view) = look(vec![Shape::Surface(Arc::new(sphere()))], axis, projection);
                let options = PickOptions { filter: Filter::SURFACES, ..PickOptions::default() };
                let mut seen = 0;
                for k in 0..60 {
                    let a = f64::from(k);
                    let p = DVec3::new((a * 0.7).cos() * a.sin(), (a * 0.7).sin() * a.sin(), a.cos());
                    let towards = (view.eye() - p).normalize();
                    let towards = if projection == Projection::Orthographic { -view.forward() } else { towards };
                    if p.dot(towards) < 0.15 {
                        continue;
                    }
                    seen += 1;
                    let hit = pick(&scene, &view, pixel(&view, p), &options).unwrap();
                    assert!(hit.point.distance(p) < 1e-7, "{} for {p}", hit.point);
                    let Target::Surface { uv, .. } = hit.target else { panic!("{hit:?}") };
                    assert!(sphere().eval(uv).distance(p) < 1e-7);
                }
                assert!(seen > 15);
            }
        }
    }

    #[test]
    fn a_curve_within_eight_pixels_goes_before_the_surface_and_a_point_before_the_curve() {
        let (document, scene, view) = look(vec![square(0.0)], Axis::Top, Projection::Perspective);
        let id = document.entities()[0].id;
        let edge = pixel(&view, DVec3::new(0.4, 0.0, 0.0));
        let options = PickOptions::default();
        for off in [0.0, -7.0, 7.0] {
            let hit = pick(&scene, &view, edge + DVec2::new(0.0, off), &options).unwrap();
            let Target::Curve { curve, t } = hit.target else { panic!("{hit:?}") };
            assert_eq!(curve, CurveRef::Border(id, Side::VMin));
            assert!((t - 0.4).abs() < 1e-9 && (hit.distance - off.abs()).abs() < 1e-9);
        }
        let hit = pick(&scene, &view, edge - DVec2::new(0.0, 9.0), &options).unwrap();
        assert!(matches!(hit.target, Target::Surface { .. }), "inside, farther than 8 pixels");
        let hit = pick(&scene, &view, edge + DVec2::new(0.0, 15.0), &options).unwrap();
        assert!(matches!(hit.target, Target::Curve { .. }), "outside, nothing else within 8 pixels");
        assert!(pick(&scene, &view, edge + DVec2::new(0.0, 17.0), &options).is_none());
        let points = [DVec3::new(0.41, 0.005, 0.0)];
        let hit = pick(&scene, &view, edge, &PickOptions { points: &points, ..options }).unwrap();
        assert_eq!(hit.target, Target::Point(0));
    }

    #[test]
    fn what_is_behind_is_not_hit_but_is_listed() {
        let line = segment(DVec3::new(0.2, 0.3, -0.5), DVec3::new(0.8, 0.3, -0.5));
        let (document, scene, view) = look(vec![square(0.0), line], Axis::Top, Projection::Orthographic);
        let at = pixel(&view, DVec3::new(0.5, 0.3, -0.5));
        let [surface, line] = [0, 1].map(|k| document.entities()[k].id);
        let options = PickOptions::default();
        assert!(matches!(pick(&scene, &view, at, &options).unwrap().target, Target::Surface { .. }));
        let all = pick_all(&scene, &view, at, &options);
        assert_eq!(all.len(), 2);
        assert!(!all[0].hidden && all[1].hidden);
        assert!(matches!(all[1].target, Target::Curve { curve: CurveRef::Free(id), .. } if id == line));
        let through = PickOptions { occlusion: false, ..options };
        assert!(matches!(pick(&scene, &view, at, &through).unwrap().target, Target::Curve { .. }));
        // A hidden entity neither hits nor hides; neither does what is cut away.
        let hidden = Command::SetVisible { ids: vec![surface], visible: false }.apply(&document).unwrap();
        let mut without = scene.clone();
        without.sync(&hidden);
        assert!(matches!(pick(&without, &view, at, &options).unwrap().target, Target::Curve { .. }));
        let cut = SectionPlane::new(DVec3::new(0.0, 0.0, -0.25), DVec3::Z);
        let hit = pick(&scene, &view, at, &PickOptions { section: cut, ..options }).unwrap();
        assert!(matches!(hit.target, Target::Curve { .. }));
        let cover = Cover::new(&scene, &Pyramid::new(&view, at, RADIUS, None), &options);
        assert!(cover.hides(DVec3::new(0.5, 0.3, -0.5)) && !cover.hides(DVec3::new(0.5, 0.3, 0.5)));
        let cut = SectionPlane::new(DVec3::new(0.0, 0.0, -2.0), DVec3::Z);
        assert!(pick(&scene, &view, at, &PickOptions { section: cut, ..options }).is_none());
    }

    #[test]
    fn a_border_seen_on_a_steep_surface_is_not_lost() {
        // The surface is nearly edge-on: 8 pixels beside its far border its own triangles are much nearer.
        let (_, scene, _) = look(vec![square(0.0)], Axis::Front, Projection::Orthographic);
        let mut camera = Camera::default();
        camera.look_along(Axis::Front);
        camera.orbit(DVec3::ZERO, DVec2::new(0.0, 10.0), SCREEN);
        camera.frame(&Aabb { min: DVec3::ZERO, max: DVec3::new(1.0, 1.0, 0.0) }, SCREEN);
        let view = View::new(&camera, SCREEN, &scene.bounds());
        let far_edge = pixel(&view, DVec3::new(0.5, 1.0, 0.0));
        let options = PickOptions::default();
        for off in [-6.0, 0.0, 6.0] {
            let hit = pick(&scene, &view, far_edge + DVec2::new(0.0, off), &options).unwrap();
            assert!(matches!(hit.target, Target::Curve { curve: CurveRef::Border(_, Side::VMax), .. }), "{hit:?}");
        }
    }

    #[test]
    fn among_equally_near_curves_the_one_in_front_is_meant() {
        let a = segment(DVec3::new(0.0, 0.0, 1.0), DVec3::new(1.0, 0.0, 1.0));
        let b = segment(DVec3::new(0.5, -0.5, 0.0), DVec3::new(0.5, 0.5, 0.0));
        let (document, scene, view) = look(vec![b, a], Axis::Top, Projection::Orthographic);
        let front = document.entities()[1].id;
        let at = pixel(&view, DVec3::new(0.5, 0.0, 0.0)) + DVec2::new(0.2, 1.0);
        let hit = pick(&scene, &view, at, &PickOptions::default()).unwrap();
        let Target::Curve { curve, t } = hit.target else { panic!("{hit:?}") };
        assert_eq!(curve, CurveRef::Free(front));
        assert!((t - 0.5 - (at - SCREEN.center()).x * view.pixel_size_at(1.0)).abs() < 1e-12);
        let away = pixel(&view, DVec3::new(0.5, 0.0, 0.0)) + DVec2::new(0.0, 5.0);
        let hit = pick(&scene, &view, away, &PickOptions::default()).unwrap();
        assert!(matches!(hit.target, Target::Curve { curve: CurveRef::Free(id), .. } if id != front));
    }

    #[test]
    fn the_filter_lets_the_nearest_allowed_thing_through() {
        let line = segment(DVec3::new(0.0, 0.5, 0.2), DVec3::new(1.0, 0.5, 0.2));
        let (_, scene, view) = look(vec![square(0.0), line], Axis::Top, Projection::Orthographic);
        let at = pixel(&view, DVec3::new(0.5, 0.5, 0.2));
        let only = |filter| pick(&scene, &view, at, &PickOptions { filter, ..PickOptions::default() });
        assert!(matches!(only(Filter::ALL).unwrap().target, Target::Curve { curve: CurveRef::Free(_), .. }));
        assert!(matches!(only(Filter::SURFACES).unwrap().target, Target::Surface { .. }));
        let iso = only(Filter { iso_lines: true, ..Filter::NONE }).unwrap().target;
        assert!(
            matches!(iso, Target::Curve { curve: CurveRef::Iso(_, Direction::U | Direction::V, c), .. } if c == 0.5)
        );
        assert!(only(Filter { patches: true, ..Filter::NONE }).is_none());
        assert!(only(Filter::NONE).is_none());
    }

    #[test]
    fn clicking_again_goes_through_all_and_round() {
        let (_, scene, view) = look(vec![square(0.0), square(-0.2), square(-0.4)], Axis::Top, Projection::Orthographic);
        let at = pixel(&view, DVec3::new(0.6, 0.6, 0.0)) + DVec2::new(20.0, 10.0);
        let hits = pick_all(&scene, &view, at, &PickOptions { filter: Filter::SURFACES, ..PickOptions::default() });
        assert_eq!(hits.len(), 3);
        let mut cycle = Cycle::default();
        let ids: Vec<u64> = (0..4)
            .map(|_| match cycle.click(at, &hits).unwrap().target {
                Target::Surface { entity, .. } => entity.0,
                other => panic!("{other:?}"),
            })
            .collect();
        assert_eq!(ids, [0, 1, 2, 0]);
        cycle.click(at + 10.0, &hits);
        assert_eq!(cycle.click(at + 10.0, &hits), hits.get(1));
        assert_eq!(cycle.click(at + 50.0, &[]), None);
    }
}
