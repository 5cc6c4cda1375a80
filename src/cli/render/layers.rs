//! What `render --show` takes, and the hierarchies among it: `bvh:4` is level 4 as rectangle-swept spheres.

use clap::ValueEnum;
use serde::Serialize;

use super::super::CliError;
use crate::kernel::job::Job;
use crate::render::{FrameData, Key, MeshItem, VolumeItem};
use crate::view::inspect::{Coloring, Hierarchy, MOST, Scale, Shown, VolumeForm, leaf_tori};
use crate::view::scene::{ItemKind, Scene};

/// The number under which hierarchies are kept on the graphics card.
const OWN: u64 = u64::MAX - 1;

/// What is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Show {
    /// Filled, lit surfaces
    Shaded,
    /// Edges of surfaces
    Edges,
    /// Iso-lines of surfaces
    Isolines,
    /// Edges and iso-lines only, nothing hidden
    Wireframe,
    /// Translucent surfaces
    Xray,
    /// The whole surfaces under trimmed faces
    Untrimmed,
    /// Zebra stripes
    Zebra,
    /// Every surface in a colour of its own
    Patches,
    /// Distance of the healed patches from the surfaces, in colour
    Deviation,
    /// Curves and points in which the surfaces meet each other
    Intersections,
    /// Curves in which surfaces meet themselves, and miter points
    SelfIntersections,
    /// A level of the hierarchies of all surfaces that are drawn
    #[value(skip)]
    Level(VolumeForm, u32, Coloring),
    /// The leaf tori of hierarchies of this height
    #[value(skip)]
    Tori(u32),
}

/// The highest level that is drawn.
const HIGHEST: u32 = 9;

/// Reads one word of `--show`.
pub fn show(text: &str) -> Result<Show, String> {
    let mut parts = text.split(':');
    let word = parts.next().unwrap_or_default();
    let form = match word {
        "bvh" => Some(VolumeForm::Swept),
        "spheres" => Some(VolumeForm::Spheres),
        "boxes" => Some(VolumeForm::Boxes),
        "tori" => None,
        _ => {
            return Show::from_str(text, true).map_err(|_| {
                let plain: Vec<String> = Show::value_variants()
                    .iter()
                    .filter_map(|v| Some(v.to_possible_value()?.get_name().to_owned()))
                    .collect();
                format!("expected {}, or bvh:N, spheres:N, boxes:N, tori:N with a level N", plain.join(", "))
            });
        }
    };
    let level = parts.next().and_then(|n| n.parse().ok()).filter(|n| *n <= HIGHEST);
    let level = level.ok_or_else(|| format!("{word} needs a level from 0 to {HIGHEST}, such as {word}:4"))?;
    let coloring = match parts.next() {
        None | Some("error") => Coloring::Error,
        Some("level") => Coloring::Level,
        Some("cone") => Coloring::Cone,
        Some(other) => return Err(format!("colours are by error, level or cone, not by {other}")),
    };
    match (form, parts.next()) {
        (_, Some(rest)) => Err(format!("{rest} after {word}:{level} means nothing")),
        (Some(form), None) => Ok(Show::Level(form, level, coloring)),
        (None, None) if level > 0 => Ok(Show::Tori(level)),
        (None, None) => Err("tori need a height of at least 1".into()),
    }
}

/// What the picture shows of hierarchies.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LevelReport {
    /// The level of volumes, or the height of tori.
    pub level: u32,
    /// Nodes of all surfaces.
    pub nodes: usize,
    /// What the colours mean.
    pub colors: String,
    /// The value at the lower end of the colours.
    pub low: f64,
    /// The value at the upper end.
    pub high: f64,
    /// Whether equal ratios are equally far apart.
    pub logarithmic: bool,
}

impl LevelReport {
    fn new(level: u32, nodes: usize, colors: &str, scale: &Scale) -> Self {
        let Scale { low, high, logarithmic } = *scale;
        Self { level, nodes, colors: colors.to_owned(), low, high, logarithmic }
    }
}

/// Adds the hierarchies that are asked for to a frame.
pub fn add(frame: &mut FrameData, scene: &Scene, shows: &[Show], job: &Job) -> Result<Vec<LevelReport>, CliError> {
    let mut reports = Vec::new();
    let wrong = |e: &dyn std::fmt::Display| CliError::BadArguments(format!("--show: {e}"));
    for (at, show) in (0_u32..).zip(shows) {
        let (Show::Level(_, height, _) | Show::Tori(height)) = *show else { continue };
        let mut trees = Vec::new();
        for item in scene.items().iter().filter(|i| i.visible() && i.kind != ItemKind::Curve) {
            let Some(surface) = item.entity.surface() else { continue };
            let built = Hierarchy::build(item.id(), surface.clone(), height.max(1), job);
            trees.push(built.map_err(|e| wrong(&format!("{}: {e}", item.entity.name)))?);
        }
        let key = |k: usize| Key::new(OWN - u64::from(at), k as u32);
        let most = |nodes: usize| {
            let why =
                || format!("{nodes} nodes are more than the {MOST} that are drawn; choose a coarser level or --only");
            if nodes > MOST { Err(CliError::BadArguments(why())) } else { Ok(()) }
        };
        if let Show::Level(form, level, coloring) = *show {
            let dress = |h: &Hierarchy| Shown::new(&h.tree, &h.surface, level, form, coloring, job);
            let mut shown = trees.iter().map(dress).collect::<Result<Vec<_>, _>>().map_err(|e| wrong(&e))?;
            let nodes = shown.iter().map(|s| s.nodes.len()).sum();
            most(nodes)?;
            let values: Vec<f32> = shown.iter().flat_map(|s| s.values.iter().copied()).collect();
            let scale = if coloring == Coloring::Level { Scale::levels(HIGHEST) } else { Scale::of(&values) };
            for (k, (shown, tree)) in shown.iter_mut().zip(&trees).enumerate() {
                shown.scale = scale;
                frame.volumes.extend(VolumeItem::of_level(key(k), 1, shown, tree.surface.bounds().center()));
            }
            reports.push(LevelReport::new(level, nodes, coloring.title(), &scale));
        } else {
            let leaves: Vec<_> = trees.iter().map(|h| h.tree.level(height)).collect();
            let nodes = leaves.iter().map(Vec::len).sum();
            most(nodes)?;
            let made = trees.iter().zip(&leaves).filter_map(|(h, leaves)| leaf_tori(&h.tree, leaves, job));
            let meshes: Vec<_> = made.collect();
            let ends: Vec<f32> =
                meshes.iter().filter_map(|m| m.scale).flat_map(|s| [s.low as f32, s.high as f32]).collect();
            let scale = Scale::of(&ends);
            // The tori stand for the surfaces, which would flicker through them.
            frame.meshes.retain(|m| !trees.iter().any(|h| h.entity.0 == m.key.entity));
            for (k, (mesh, tree)) in meshes.iter().zip(&trees).enumerate() {
                frame.meshes.push(MeshItem::of_tori(key(k), 1, mesh, &scale, tree.surface.bounds().center()));
            }
            reports.push(LevelReport::new(height, nodes, "Torus deviation", &scale));
        }
    }
    Ok(reports)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_of_show_are_read_or_refused_with_what_is_expected() {
        assert_eq!(show("shaded"), Ok(Show::Shaded));
        assert_eq!(show("bvh:4"), Ok(Show::Level(VolumeForm::Swept, 4, Coloring::Error)));
        assert_eq!(show("boxes:0:cone"), Ok(Show::Level(VolumeForm::Boxes, 0, Coloring::Cone)));
        assert_eq!(show("tori:3"), Ok(Show::Tori(3)));
        for (bad, says) in [
            ("bvh", "bvh:4"),
            ("bvh:x", "level"),
            ("bvh:99", "0 to 9"),
            ("bvh:1:red", "cone"),
            ("bvh:1:cone:2", "nothing"),
            ("tori:0", "height"),
            ("shade", "isolines"),
        ] {
            let error = show(bad).unwrap_err();
            assert!(error.contains(says), "{bad}: {error}");
        }
    }
}
