//! A bounding-volume tree over line segments, asked for the segments near a pixel.
//!
//! The tree lives in space and so outlasts every move of the camera. A query walks it with the pyramid (or, for
//! parallel projection, the prism) of all points that are seen within a square around the pixel, and decides on the
//! segments by their exact distance in pixels. Halved by count along the longest axis: polylines are spread evenly
//! enough for that. Build O(n log n), query O(log n + answers).

use glam::{DVec2, DVec3};

use super::camera::Projection;
use super::section::SectionPlane;
use super::viewport::View;
use crate::kernel::geom::Aabb;

const LEAF: usize = 4;

/// A segment of a polyline that stands for a curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment {
    /// The end points.
    pub ends: [DVec3; 2],
    /// The curve's parameters there.
    pub t: [f64; 2],
    /// The caller's number of the curve.
    pub curve: u32,
}

/// Where a segment comes nearest to a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Near {
    /// The caller's number of the curve.
    pub curve: u32,
    /// The curve's parameter there, interpolated.
    pub t: f64,
    /// The point of the segment.
    pub point: DVec3,
    /// Its pixel.
    pub pixel: DVec2,
    /// Its distance in pixels.
    pub distance: f64,
    /// Its depth.
    pub depth: f64,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    center: DVec3,
    half: DVec3,
    /// Leaf: its first segment. Inner: how far behind this node its right child is.
    link: u32,
    count: u32,
}

/// Segments and the tree over them.
#[derive(Clone, Debug, Default)]
pub struct SegmentTree {
    segments: Vec<Segment>,
    nodes: Vec<Node>,
}

/// What is seen within a radius of a pixel.
#[derive(Clone, Copy, Debug)]
pub struct Pyramid<'a> {
    view: &'a View,
    pixel: DVec2,
    radius: f64,
    section: Option<&'a SectionPlane>,
    /// Inner sides: normal . (p - eye) + constant >= 0.
    planes: [(DVec3, f64); 5],
}

impl<'a> Pyramid<'a> {
    /// The pyramid of a pixel and a radius in pixels; what the section plane cuts away does not count.
    pub fn new(view: &'a View, pixel: DVec2, radius: f64, section: Option<&'a SectionPlane>) -> Self {
        let mut out = Self { view, pixel, radius, section, planes: [(DVec3::ZERO, 0.0); 5] };
        out.set_radius(radius);
        out
    }

    /// Makes it narrower or wider.
    pub fn set_radius(&mut self, radius: f64) {
        self.radius = radius;
        let (forward, right, up) = (self.view.forward(), self.view.camera.right(), self.view.camera.up());
        let size = self.view.pixel_size_at(1.0);
        let middle = (self.pixel - self.view.viewport.center()) * DVec2::new(size, -size);
        let reach = radius * size;
        let side = |axis: DVec3, limit: f64| match self.view.camera.projection {
            Projection::Perspective => (forward * limit - axis, 0.0),
            Projection::Orthographic => (-axis, limit),
        };
        self.planes = [
            side(right, middle.x + reach),
            side(-right, -(middle.x - reach)),
            side(up, middle.y + reach),
            side(-up, -(middle.y - reach)),
            (forward, -self.view.near),
        ];
    }

    /// The view that it belongs to.
    pub fn view(&self) -> &'a View {
        self.view
    }

    /// The pixel around which it is.
    pub fn pixel(&self) -> DVec2 {
        self.pixel
    }

    /// Its radius in pixels.
    pub fn radius(&self) -> f64 {
        self.radius
    }

    fn meets(&self, center: DVec3, half: DVec3) -> bool {
        let d = center - self.view.eye();
        self.planes.iter().all(|(n, c)| n.dot(d) + n.abs().dot(half) + c >= 0.0)
    }

    /// Whether a box may hold something near the pixel.
    pub fn meets_box(&self, bounds: &Aabb) -> bool {
        !bounds.is_empty() && self.meets(bounds.center(), 0.5 * bounds.size())
    }

    /// Where a segment comes nearest to the pixel, when that is within the radius.
    pub fn nearest(&self, segment: &Segment) -> Option<Near> {
        let [a, b] = segment.ends;
        let mut range = [0.0, 1.0];
        let mut keep_inside = |fa: f64, fb: f64| {
            // The part of 0..=1 where the linear function from fa to fb is not negative.
            if fa < 0.0 && fb < 0.0 {
                range = [1.0, 0.0];
            } else if fa < 0.0 {
                range[0] = f64::max(range[0], fa / (fa - fb));
            } else if fb < 0.0 {
                range[1] = f64::min(range[1], fa / (fa - fb));
            }
        };
        let view = self.view;
        keep_inside(view.depth(a) - view.near, view.depth(b) - view.near);
        if let Some(section) = self.section {
            keep_inside(-section.height(a), -section.height(b));
        }
        if range[0] > range[1] {
            return None;
        }
        let (start, end) = (a.lerp(b, range[0]), a.lerp(b, range[1]));
        let (p, q) = (view.project(start)?, view.project(end)?);
        let d = q.pixel - p.pixel;
        let squared = d.length_squared();
        let s = if squared > 0.0 { ((self.pixel - p.pixel).dot(d) / squared).clamp(0.0, 1.0) } else { 0.0 };
        let pixel = p.pixel + d * s;
        let distance = pixel.distance(self.pixel);
        if distance > self.radius {
            return None;
        }
        // Halfway on the picture is not halfway in space: 1/depth is what is linear there.
        let s = match view.camera.projection {
            Projection::Perspective if squared > 0.0 => {
                let (near, far) = ((1.0 - s) / p.depth, s / q.depth);
                far / (near + far)
            }
            _ => s,
        };
        let along = range[0] + (range[1] - range[0]) * s;
        let point = a.lerp(b, along);
        let t = segment.t[0] + (segment.t[1] - segment.t[0]) * along;
        Some(Near { curve: segment.curve, t, point, pixel, distance, depth: view.depth(point) })
    }
}

impl SegmentTree {
    /// Builds the tree. Segments with an end that is not finite are left out.
    pub fn new(mut segments: Vec<Segment>) -> Self {
        segments.retain(|s| s.ends.iter().all(|p| p.is_finite()));
        let mut tree = Self { nodes: Vec::with_capacity(segments.len() / 2 + 1), segments: Vec::new() };
        if !segments.is_empty() {
            build(&mut segments, 0, &mut tree.nodes);
        }
        tree.segments = segments;
        tree
    }

    /// How many segments it holds.
    pub fn len(&self) -> usize {
        self.segments.len()
    }

    /// Whether it holds none.
    pub fn is_empty(&self) -> bool {
        self.segments.is_empty()
    }

    /// Calls `found` for every segment within the pyramid's radius of its pixel; `found` may narrow the pyramid.
    pub fn visit<'a>(&self, pyramid: &mut Pyramid<'a>, mut found: impl FnMut(Near, &mut Pyramid<'a>)) {
        // Children follow their parents, and halving by count keeps the depth at log2 of the number of segments.
        let mut stack = [0_u32; 64];
        let mut depth = usize::from(!self.nodes.is_empty());
        while depth > 0 {
            depth -= 1;
            let at = stack[depth];
            let node = &self.nodes[at as usize];
            if !pyramid.meets(node.center, node.half) {
                continue;
            }
            if node.count > 0 {
                for segment in &self.segments[node.link as usize..(node.link + node.count) as usize] {
                    if let Some(near) = pyramid.nearest(segment) {
                        found(near, pyramid);
                    }
                }
            } else {
                stack[depth] = at + node.link;
                stack[depth + 1] = at + 1;
                depth += 2;
            }
        }
    }
}

fn build(segments: &mut [Segment], first: usize, nodes: &mut Vec<Node>) {
    let bounds = Aabb::of(segments.iter().flat_map(|s| s.ends));
    let at = nodes.len();
    let count = segments.len();
    nodes.push(Node { center: bounds.center(), half: 0.5 * bounds.size(), link: first as u32, count: count as u32 });
    if count <= LEAF {
        return;
    }
    let size = Aabb::of(segments.iter().map(|s| s.ends[0] + s.ends[1])).size();
    let axis = if size.x >= size.y && size.x >= size.z { 0 } else { 1 + usize::from(size.z > size.y) };
    let middle = count / 2;
    let key = |s: &Segment| s.ends[0][axis] + s.ends[1][axis];
    segments.select_nth_unstable_by(middle, |a, b| {
        key(a).total_cmp(&key(b)).then(a.curve.cmp(&b.curve)).then(a.t[0].total_cmp(&b.t[0]))
    });
    let (left, right) = segments.split_at_mut(middle);
    build(left, first, nodes);
    nodes[at].link = (nodes.len() - at) as u32;
    nodes[at].count = 0;
    build(right, first + middle, nodes);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::camera::Camera;
    use crate::view::viewport::Viewport;

    fn numbers(seed: u64) -> impl FnMut() -> f64 {
        let mut state = seed;
        move || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        }
    }

    /// The distance in pixels by dense sampling, from above.
    fn sampled(view: &View, segment: &Segment, pixel: DVec2, section: Option<&SectionPlane>) -> f64 {
        (0..=2000)
            .map(|i| segment.ends[0].lerp(segment.ends[1], f64::from(i) / 2000.0))
            .filter(|&p| view.depth(p) >= view.near && section.is_none_or(|s| s.height(p) <= 0.0))
            .filter_map(|p| view.project(p))
            .map(|p| p.pixel.distance(pixel))
            .fold(f64::INFINITY, f64::min)
    }

    #[test]
    fn the_tree_finds_what_sampling_finds() {
        let mut next = numbers(11);
        let mut point = |scale: f64| DVec3::new(next(), next(), next()) * scale;
        let segments: Vec<Segment> = (0..120)
            .map(|curve| {
                let a = point(3.0);
                Segment { ends: [a, a + point(1.5)], t: [0.0, 1.0], curve }
            })
            .collect();
        let tree = SegmentTree::new(segments.clone());
        let section = SectionPlane::new(DVec3::new(0.2, 0.0, 0.0), DVec3::new(1.0, 0.3, 0.0)).unwrap();
        let scene = Aabb { min: DVec3::splat(-4.5), max: DVec3::splat(4.5) };
        let mut counts = [0, 0];
        for projection in [Projection::Perspective, Projection::Orthographic] {
            for (distance, section) in [(12.0, None), (2.0, None), (12.0, Some(&section))] {
                let camera = Camera { projection, distance, ..Camera::default() };
                let view = View::new(&camera, Viewport::new(500.0, 400.0), &scene);
                for pixel in [DVec2::new(250.0, 200.0), DVec2::new(100.0, 330.0)] {
                    let mut found = vec![None; segments.len()];
                    let mut pyramid = Pyramid::new(&view, pixel, 60.0, section);
                    tree.visit(&mut pyramid, |near, _| found[near.curve as usize] = Some(near));
                    for (segment, found) in segments.iter().zip(&found) {
                        let slow = sampled(&view, segment, pixel, section);
                        counts[usize::from(found.is_some())] += 1;
                        match found {
                            Some(near) => {
                                assert!(near.distance <= slow + 1e-9, "{} {slow}", near.distance);
                                let seen = view.project(near.point).unwrap();
                                assert!(seen.pixel.distance(pixel) - near.distance < 1e-6);
                                assert!((seen.depth - near.depth).abs() < 1e-9);
                                let on = segment.ends[0].lerp(segment.ends[1], near.t);
                                assert!(on.distance(near.point) < 1e-12);
                            }
                            None => assert!(slow > 60.0, "missed at {slow}"),
                        }
                    }
                }
            }
        }
        assert!(counts[0] > 100 && counts[1] > 80, "{counts:?}");
    }

    #[test]
    fn nothing_is_found_in_nothing() {
        let tree = SegmentTree::new(vec![Segment { ends: [DVec3::NAN, DVec3::X], t: [0.0, 1.0], curve: 0 }]);
        assert!(tree.is_empty());
        let camera = Camera::default();
        let view = View::new(&camera, Viewport::new(500.0, 400.0), &Aabb::EMPTY);
        tree.visit(&mut Pyramid::new(&view, DVec2::ZERO, 9.0, None), |_, _| panic!("found in nothing"));
    }
}
