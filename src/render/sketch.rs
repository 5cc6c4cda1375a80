//! What is drawn beside the model: lines, meshes and glyphs that belong to no entity, collected with a key each.

use std::sync::Arc;

use glam::DVec3;

use super::color::{Color, srgb, with_alpha};
use super::frame::{
    Dash, Emphasis, Field, FrameData, GlyphData, GlyphItem, GlyphShape, Hidden, Key, LineData, LineItem, LineRole,
    LineStyle, MeshItem,
};
use super::mesh_data::MeshData;
use crate::view::intersection::Drawing;
use crate::view::intersection::style::{Mark, Stroke};

/// Things to draw, around one origin and with one revision.
#[derive(Clone, Debug, Default)]
pub struct Sketch {
    /// Model position of the local (0, 0, 0).
    pub origin: DVec3,
    /// Meshes.
    pub meshes: Vec<MeshItem>,
    /// Lines.
    pub lines: Vec<LineItem>,
    /// Points.
    pub glyphs: Vec<GlyphItem>,
    owner: u64,
    revision: u64,
    part: u32,
}

impl Sketch {
    /// An empty sketch. `owner` stands where an entity's number would stand in the keys; `revision` must change whenever
    /// anything in the sketch does.
    pub fn new(owner: u64, revision: u64, origin: DVec3) -> Self {
        let origin = if origin.is_finite() { origin } else { DVec3::ZERO };
        Self { origin, owner, revision, ..Self::default() }
    }

    fn key(&mut self) -> Key {
        self.part += 1;
        Key::new(self.owner, self.part)
    }

    /// Adds a polyline.
    pub fn line(
        &mut self,
        points: impl IntoIterator<Item = DVec3>,
        width: f32,
        color: Color,
        dash: Dash,
        hidden: Hidden,
    ) {
        self.polylines([points], LineStyle { width, color, dash, hidden });
    }

    /// Adds several polylines of one style.
    pub fn polylines<P: IntoIterator<Item = DVec3>>(&mut self, all: impl IntoIterator<Item = P>, style: LineStyle) {
        let mut lines = LineData::new(self.origin);
        for points in all {
            lines.push(points);
        }
        if lines.points.is_empty() {
            return;
        }
        let item = LineItem {
            key: self.key(),
            revision: self.revision,
            lines: Arc::new(lines),
            style,
            role: LineRole::Curve,
            emphasis: Emphasis::Normal,
            sectioned: false,
        };
        self.lines.push(item);
    }

    /// Adds a mesh, coloured by `field` where there is one.
    pub fn mesh(
        &mut self,
        points: &[DVec3],
        normals: Vec<[f32; 3]>,
        triangles: Vec<[u32; 3]>,
        color: Color,
        field: Option<Field>,
    ) {
        if triangles.is_empty() {
            return;
        }
        let positions: Vec<[f32; 3]> = points.iter().map(|p| (*p - self.origin).as_vec3().to_array()).collect();
        let mesh = MeshData::new(self.origin, &positions, &normals, triangles);
        let item = MeshItem {
            key: self.key(),
            revision: self.revision,
            mesh: Arc::new(mesh),
            color,
            emphasis: Emphasis::Normal,
            field,
            sectioned: true,
        };
        self.meshes.push(item);
    }

    /// Adds glyphs.
    pub fn glyphs(&mut self, glyphs: GlyphData, hidden: Hidden) {
        if glyphs.glyphs.is_empty() {
            return;
        }
        let (key, revision) = (self.key(), self.revision);
        self.glyphs.push(GlyphItem { key, revision, glyphs: Arc::new(glyphs), hidden, sectioned: false });
    }

    /// Adds the drawing of an intersection; `strength` below 1 fades what is out of date. Under every unbroken line lies a
    /// wider one in the colour of the backdrop, so that it stands out from surfaces of any colour.
    pub fn intersection(&mut self, drawing: &Drawing, strength: f32, dark: bool) {
        let casing = with_alpha(srgb(if dark { 0x0b0d10 } else { 0xffffff }), 0.75 * strength);
        let (hatching, rgb) = &drawing.hatching;
        let color = with_alpha(srgb(*rgb), 0.8 * strength);
        self.polylines(
            hatching.iter().cloned(),
            LineStyle { width: 1.2, color, dash: Dash::Solid, hidden: Hidden::Dashed },
        );
        for line in &drawing.lines {
            let color = with_alpha(srgb(line.style.rgb), strength);
            let dash = match line.style.stroke {
                Stroke::Solid => Dash::Solid,
                Stroke::Dashed(on, off) => Dash::Dashed { on, off },
                Stroke::Double => Dash::Double,
            };
            if dash != Dash::Double {
                self.line(line.points.iter().copied(), line.style.width + 2.0, casing, dash, Hidden::Gone);
            }
            self.line(line.points.iter().copied(), line.style.width, color, dash, Hidden::Dashed);
        }
        let mut glyphs = GlyphData::new(self.origin);
        for glyph in &drawing.glyphs {
            let shape = match glyph.mark {
                Mark::End => GlyphShape::Round,
                Mark::Junction => GlyphShape::Diamond,
                Mark::Isolated => GlyphShape::Square,
                Mark::Miter => GlyphShape::Triangle,
                Mark::Loop => GlyphShape::Ring,
                Mark::Unresolved => GlyphShape::Cross,
            };
            if matches!(shape, GlyphShape::Round | GlyphShape::Diamond | GlyphShape::Square | GlyphShape::Triangle) {
                glyphs.push(glyph.at, shape, glyph.size + 4.0, casing);
            }
            glyphs.push(glyph.at, shape, glyph.size, with_alpha(srgb(glyph.rgb), strength));
        }
        self.glyphs(glyphs, Hidden::OnTop);
    }

    /// Puts everything into a frame.
    pub fn into_frame(self, frame: &mut FrameData) {
        frame.meshes.extend(self.meshes);
        frame.lines.extend(self.lines);
        frame.glyphs.extend(self.glyphs);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_item_has_a_key_of_its_own() {
        let mut sketch = Sketch::new(7, 3, DVec3::NAN);
        assert_eq!(sketch.origin, DVec3::ZERO);
        for _ in 0..3 {
            sketch.line([DVec3::ZERO, DVec3::X], 1.0, srgb(0), Dash::Solid, Hidden::OnTop);
        }
        let mut glyphs = GlyphData::new(DVec3::ZERO);
        glyphs.push(DVec3::ZERO, GlyphShape::Round, 3.0, srgb(0));
        sketch.glyphs(glyphs, Hidden::OnTop);
        sketch.glyphs(GlyphData::default(), Hidden::OnTop);
        let mut keys: Vec<Key> =
            sketch.lines.iter().map(|l| l.key).chain(sketch.glyphs.iter().map(|g| g.key)).collect();
        keys.dedup();
        assert_eq!(keys.len(), 4, "and what is empty adds nothing");
        assert!(keys.iter().all(|k| k.entity == 7));
    }
}
