//! One level of a hierarchy, dressed: a volume and a value for every node, and the scale of the values.

use std::sync::Arc;

use crate::kernel::bvh::{BvhError, BvhOptions, NodeId, SurfaceTree, VolumeKind, VolumeTree};
use crate::kernel::geom::Surface;
use crate::kernel::job::Job;
use crate::view::colormap::Sequential;
use crate::view::rounded_box::RoundedBox;
use crate::view::viewport::Ray;

/// The most nodes of a level that are drawn: beyond, the level is only counted.
pub const MOST: usize = 1 << 19;

/// What is drawn for a node.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum VolumeForm {
    /// Rectangle-swept spheres.
    #[default]
    Swept,
    /// Bounding spheres.
    Spheres,
    /// Boxes along the axes.
    Boxes,
    /// Nothing.
    None,
}

impl VolumeForm {
    /// All of them with their names.
    pub const ALL: [(Self, &'static str); 4] = [
        (Self::Swept, "Rectangle-swept spheres"),
        (Self::Spheres, "Bounding spheres"),
        (Self::Boxes, "Axis-aligned boxes"),
        (Self::None, "No volumes"),
    ];
}

/// What decides the colour of a node.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Coloring {
    /// Its level.
    Level,
    /// How far the surface may be from the node's rectangle: the radius of the swept sphere.
    #[default]
    Error,
    /// Half the angle of its normal cone.
    Cone,
}

impl Coloring {
    /// All of them with their names.
    pub const ALL: [(Self, &'static str); 3] =
        [(Self::Level, "Level"), (Self::Error, "Error"), (Self::Cone, "Normal-cone angle")];

    /// What the legend is called.
    pub fn title(self) -> &'static str {
        match self {
            Self::Level => "Level",
            Self::Error => "Swept radius",
            Self::Cone => "Normal cone °",
        }
    }
}

/// From values to places on a colour map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    /// The value at the lower end.
    pub low: f64,
    /// The value at the upper end.
    pub high: f64,
    /// Whether equal ratios are equally far apart.
    pub logarithmic: bool,
}

/// Values over more than this ratio have a logarithmic scale.
const RATIO: f64 = 100.0;
/// The decades of a logarithmic scale at most: what is below is rounding.
const DECADES: f64 = 6.0;

impl Scale {
    /// The scale that holds all finite values.
    pub fn of(values: &[f32]) -> Self {
        let finite = || values.iter().map(|v| f64::from(*v)).filter(|v| v.is_finite());
        let (low, high) = finite().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
        if low > high {
            return Self { low: 0.0, high: 1.0, logarithmic: false };
        }
        // The least positive value decides: zeros are at the lower end.
        let least = finite().filter(|v| *v > 0.0).fold(f64::INFINITY, f64::min);
        if low >= 0.0 && high > RATIO * least {
            return Self { low: least.max(high * 10.0_f64.powf(-DECADES)), high, logarithmic: true };
        }
        let pad = if low == high { 0.5 * low.abs().max(1e-12) } else { 0.0 };
        Self { low: low - pad, high: high + pad, logarithmic: false }
    }

    /// The scale of levels from 0 to the height.
    pub fn levels(height: u32) -> Self {
        Self { low: 0.0, high: f64::from(height.max(1)), logarithmic: false }
    }

    /// The place of a value, 0..=1.
    pub fn place(&self, value: f64) -> f64 {
        let t = if self.logarithmic {
            (value.max(self.low) / self.low).ln() / (self.high / self.low).ln()
        } else {
            (value - self.low) / (self.high - self.low)
        };
        t.clamp(0.0, 1.0)
    }

    /// The value at a place.
    pub fn value(&self, place: f64) -> f64 {
        if self.logarithmic {
            self.low * (self.high / self.low).powf(place)
        } else {
            self.low + (self.high - self.low) * place
        }
    }

    /// The colour of a value, sRGB bytes; grey without one.
    pub fn color(&self, value: f32) -> [u8; 4] {
        if value.is_nan() {
            return [0x8a, 0x8a, 0x8a, 0xff];
        }
        let [r, g, b] = Sequential::Viridis.color(self.place(f64::from(value))).map(|c| (c * 255.0).round() as u8);
        [r, g, b, 0xff]
    }
}

/// A level as volumes.
#[derive(Clone, Debug, PartialEq)]
pub struct Shown {
    /// Which level.
    pub level: u32,
    /// Its nodes: neighbours in the list are neighbours in space.
    pub nodes: Vec<NodeId>,
    /// A volume for each; none when no volumes are wanted or there are more than [`MOST`].
    pub volumes: Arc<Vec<RoundedBox>>,
    /// A value for each; NaN where there is none.
    pub values: Vec<f32>,
    /// The scale of the values.
    pub scale: Scale,
}

impl Shown {
    /// Dresses a level. `surface` is that of the tree.
    pub fn new(
        tree: &SurfaceTree,
        surface: &Surface,
        level: u32,
        form: VolumeForm,
        coloring: Coloring,
        job: &Job,
    ) -> Result<Self, BvhError> {
        job.phase("Drawing the level");
        let nodes = tree.level(level);
        let values: Vec<f32> = nodes.iter().map(|&id| value(tree, id, level, coloring)).collect();
        let scale = match coloring {
            Coloring::Level => Scale::levels(tree.options().height),
            _ => Scale::of(&values),
        };
        let mut shown = Self { level, nodes, volumes: Arc::default(), values, scale };
        if shown.nodes.len() <= MOST {
            shown.volumes = Arc::new(volumes(tree, surface, &shown.nodes, level, form, job)?);
        }
        Ok(shown)
    }

    /// Whether the level has more nodes than are drawn.
    pub fn too_many(&self) -> bool {
        self.nodes.len() > MOST
    }

    /// The place of a node in the lists.
    pub fn find(&self, id: NodeId) -> Option<usize> {
        self.nodes.binary_search(&id).ok().or_else(|| self.nodes.iter().position(|n| *n == id))
    }

    /// The node whose volume a ray meets first, by its place in the list, and how far along that is.
    pub fn on_ray(&self, ray: &Ray) -> Option<(usize, f64)> {
        let hits = self.volumes.iter().enumerate().filter_map(|(k, volume)| Some((k, volume.hit(ray)?)));
        hits.min_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// The colours of the nodes.
    pub fn colors(&self) -> Vec<[u8; 4]> {
        self.values.iter().map(|v| self.scale.color(*v)).collect()
    }

    /// Only the nodes for which `keep` is true.
    #[must_use]
    pub fn only(&self, keep: impl Fn(NodeId) -> bool) -> Self {
        let kept: Vec<usize> = (0..self.nodes.len()).filter(|&k| keep(self.nodes[k])).collect();
        let volumes = Arc::new(kept.iter().filter_map(|&k| self.volumes.get(k).copied()).collect());
        Self {
            nodes: kept.iter().map(|&k| self.nodes[k]).collect(),
            values: kept.iter().map(|&k| self.values[k]).collect(),
            volumes,
            ..*self
        }
    }
}

fn value(tree: &SurfaceTree, id: NodeId, level: u32, coloring: Coloring) -> f32 {
    let node = tree.node(id);
    match coloring {
        Coloring::Level => level as f32,
        Coloring::Error => node.radius() as f32,
        Coloring::Cone => node.cone().map_or(f32::NAN, |cone| cone.half_angle().to_degrees() as f32),
    }
}

fn volumes(
    tree: &SurfaceTree,
    surface: &Surface,
    nodes: &[NodeId],
    level: u32,
    form: VolumeForm,
    job: &Job,
) -> Result<Vec<RoundedBox>, BvhError> {
    Ok(match form {
        VolumeForm::None => Vec::new(),
        VolumeForm::Swept => nodes.iter().map(|&id| RoundedBox::swept(tree.node(id), tree.origin(id))).collect(),
        VolumeForm::Spheres => nodes.iter().map(|&id| RoundedBox::sphere(tree.node(id), tree.origin(id))).collect(),
        VolumeForm::Boxes => {
            let options = BvhOptions { height: level.min(tree.options().height), ..*tree.options() };
            let boxes = VolumeTree::build(surface, &options, VolumeKind::Aabb, job)?;
            nodes.iter().map(|&id| RoundedBox::aligned(&boxes.aabb(id))).collect()
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::display::tests::sphere;

    fn tree(height: u32) -> (Surface, SurfaceTree) {
        let surface = sphere();
        let tree = SurfaceTree::new(&surface, &BvhOptions { height, ..BvhOptions::default() }).unwrap();
        (surface, tree)
    }

    #[test]
    fn every_form_of_volume_holds_the_surface_over_its_node() {
        let (surface, tree) = tree(3);
        for form in [VolumeForm::Swept, VolumeForm::Spheres, VolumeForm::Boxes] {
            let shown = Shown::new(&tree, &surface, 2, form, Coloring::Error, &Job::new()).unwrap();
            assert_eq!(shown.nodes.len(), 16 * tree.patches().len());
            for (id, volume) in shown.nodes.iter().zip(shown.volumes.iter()) {
                let [low, high] = tree.rectangle(*id);
                for k in 0..9 {
                    let t = glam::DVec2::new(f64::from(k % 3), f64::from(k / 3)) / 2.0;
                    let p = surface.eval(low + (high - low) * t);
                    assert!(volume.distance(p) < 1e-9, "{form:?} {id:?}");
                }
            }
        }
    }

    #[test]
    fn errors_and_cones_shrink_from_level_to_level() {
        let (surface, tree) = tree(4);
        let largest = |level, coloring| {
            let shown = Shown::new(&tree, &surface, level, VolumeForm::None, coloring, &Job::new()).unwrap();
            assert!(shown.volumes.is_empty());
            shown.values.iter().copied().fold(0.0, f32::max)
        };
        for level in 1..4 {
            for coloring in [Coloring::Error, Coloring::Cone] {
                assert!(largest(level + 1, coloring) < 0.75 * largest(level, coloring), "{level} {coloring:?}");
            }
        }
    }

    #[test]
    fn a_scale_runs_from_the_least_to_the_largest_value() {
        let linear = Scale::of(&[1.0, 3.0, f32::NAN, 2.0]);
        assert_eq!((linear.low, linear.high, linear.logarithmic), (1.0, 3.0, false));
        assert_eq!(linear.place(2.0), 0.5);
        let wide = Scale::of(&[1e-6, 1e-3, 0.0, 1.0]);
        assert!(wide.logarithmic && (wide.place(1e-3) - 0.5).abs() < 1e-9 && wide.place(0.0) == 0.0);
        assert!((wide.value(wide.place(0.02)) - 0.02).abs() < 1e-12);
        assert_ne!(wide.color(1e-6), wide.color(1.0));
        let one = Scale::of(&[5.0, 5.0]);
        assert!(one.low < 5.0 && one.high > 5.0);
        assert!(Scale::of(&[]).high > 0.0);
    }

    #[test]
    fn what_is_kept_keeps_its_volume_and_value() {
        let (surface, tree) = tree(2);
        let shown = Shown::new(&tree, &surface, 2, VolumeForm::Swept, Coloring::Error, &Job::new()).unwrap();
        let some = shown.only(|id| id.index % 3 == 0);
        assert!(!some.nodes.is_empty() && some.nodes.len() < shown.nodes.len());
        for (k, id) in some.nodes.iter().enumerate() {
            let at = shown.find(*id).unwrap();
            assert_eq!((some.volumes[k], some.values[k]), (shown.volumes[at], shown.values[at]));
        }
    }
}
