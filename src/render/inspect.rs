//! Levels of hierarchies and leaf tori dressed for drawing.

use std::sync::Arc;

use glam::DVec3;

use super::color::{Color, ColorScale, srgb};
use super::frame::{Emphasis, Field, Key, MeshItem, VolumeData, VolumeForm, VolumeItem};
use super::mesh_data::MeshData;
use crate::view::colormap::Sequential;
use crate::view::inspect::{Scale, Shown, TorusMesh};

/// Up to this many volumes are bodies; more are silhouettes.
pub const BODIES: usize = 2000;

/// Steps of the colour scale of tori.
const STEPS: usize = 32;

impl VolumeItem {
    /// A level in the colours of its values: bodies, or silhouettes where there are many. `None` without volumes.
    pub fn of_level(key: Key, revision: u64, shown: &Shown, origin: DVec3) -> Option<Self> {
        let bodies = shown.volumes.len() <= BODIES;
        let form = if bodies { VolumeForm::Solid } else { VolumeForm::Outline { width: 1.0, fill: 0.35 } };
        let opacity = if bodies { 0.55 } else { 0.8 };
        Self::of(key, revision, shown, shown.colors(), origin, form, opacity)
    }

    /// A level as faint outlines in one colour, sRGB.
    pub fn ghost(key: Key, revision: u64, shown: &Shown, color: [u8; 3], origin: DVec3, width: f32) -> Option<Self> {
        let [r, g, b] = color;
        let colors = vec![[r, g, b, 0xff]; shown.volumes.len()];
        Self::of(key, revision, shown, colors, origin, VolumeForm::Outline { width, fill: 0.0 }, 0.5)
    }

    fn of(
        key: Key,
        revision: u64,
        shown: &Shown,
        colors: Vec<[u8; 4]>,
        origin: DVec3,
        form: VolumeForm,
        opacity: f32,
    ) -> Option<Self> {
        let volumes = Arc::clone(&shown.volumes);
        let data = || Arc::new(VolumeData { origin, volumes, colors });
        let shown = !shown.volumes.is_empty();
        shown.then(|| Self { key, revision, volumes: data(), form, opacity, sectioned: true })
    }
}

impl MeshItem {
    /// Leaf tori in the colours of their deviations; tubes thinner than their leaves stand out.
    pub fn of_tori(key: Key, revision: u64, tori: &TorusMesh, scale: &Scale, origin: DVec3) -> Self {
        // The steps of the scale are equal in place, so a logarithmic one is applied to the values.
        let place = |v: &f32| if v.is_finite() { scale.place(f64::from(*v)) as f32 } else { f32::INFINITY };
        let linear = |t: f64| {
            let [r, g, b] = crate::view::colormap::linear(Sequential::Viridis.color(t));
            [r, g, b, 1.0]
        };
        let steps = (0..STEPS).map(|k| linear((k as f64 + 0.5) / STEPS as f64)).collect();
        let colors = ColorScale { steps, band: -1.0, above: srgb(THIN), ..ColorScale::sequential(0.0, 1.0) };
        let field =
            Field { revision, values: Arc::new(tori.values.iter().map(place).collect()), scale: Arc::new(colors) };
        Self { field: Some(field), ..Self::of_torus(key, revision, tori, srgb(0xffffff), origin) }
    }

    /// Tori in one colour.
    pub fn of_torus(key: Key, revision: u64, tori: &TorusMesh, color: Color, origin: DVec3) -> Self {
        let positions: Vec<[f32; 3]> = tori.points.iter().map(|p| (*p - origin).as_vec3().to_array()).collect();
        let normals: Vec<[f32; 3]> = tori.normals.iter().map(|n| n.as_vec3().to_array()).collect();
        let mesh = MeshData::new(origin, &positions, &normals, tori.triangles.clone());
        let (mesh, emphasis) = (Arc::new(mesh), Emphasis::Normal);
        Self { key, revision, mesh, color, emphasis, field: None, sectioned: true }
    }
}

/// The colour of tori whose tubes are thinner than their leaves are wide, sRGB.
pub const THIN: u32 = 0xd62f5c;
