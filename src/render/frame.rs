//! One frame as plain data. Nothing here touches the GPU, so a frame can be built, compared and tested anywhere.

use std::sync::Arc;

use glam::{DMat4, DVec3};

use super::color::{Color, ColorScale, srgb};
use super::mesh_data::MeshData;
use crate::view::rounded_box::RoundedBox;

/// Names one thing that has buffers on the GPU. Meshes, lines and glyphs have separate name spaces.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Key {
    /// The entity it belongs to (the number inside an `EntityId`), or any number for things that are no entity.
    pub entity: u64,
    /// Tells several things of one entity apart.
    pub part: u32,
}

impl Key {
    /// Part `part` of an entity.
    pub fn new(entity: u64, part: u32) -> Self {
        Self { entity, part }
    }
}

/// The camera: two matrices, right-handed, the eye looks along its -z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraData {
    /// World to eye; a rigid motion.
    pub view: DMat4,
    /// Eye to clip space with depth reversed: 1 at the near plane, 0 at the far plane or at infinity.
    /// Perspective or orthographic.
    pub projection: DMat4,
}

impl CameraData {
    /// A perspective camera with its far plane at infinity. `fov_y` in radians, `aspect` is width over height.
    pub fn perspective(eye: DVec3, target: DVec3, up: DVec3, fov_y: f64, aspect: f64, near: f64) -> Self {
        let f = 1.0 / (fov_y * 0.5).tan();
        let projection = DMat4::from_cols_array(&[
            f / aspect,
            0.0,
            0.0,
            0.0, //
            0.0,
            f,
            0.0,
            0.0, //
            0.0,
            0.0,
            0.0,
            -1.0, //
            0.0,
            0.0,
            near,
            0.0,
        ]);
        Self { view: look_at(eye, target, up), projection }
    }

    /// An orthographic camera that sees `height` model units from bottom to top, from `near` to `far` along its
    /// view direction.
    pub fn orthographic(eye: DVec3, target: DVec3, up: DVec3, height: f64, aspect: f64, near: f64, far: f64) -> Self {
        let depth = 1.0 / (far - near);
        let projection = DMat4::from_cols_array(&[
            2.0 / (height * aspect),
            0.0,
            0.0,
            0.0, //
            0.0,
            2.0 / height,
            0.0,
            0.0, //
            0.0,
            0.0,
            depth,
            0.0, //
            0.0,
            0.0,
            far * depth,
            1.0,
        ]);
        Self { view: look_at(eye, target, up), projection }
    }

    /// Whether parallel lines stay parallel.
    pub fn is_orthographic(&self) -> bool {
        self.projection.w_axis.w != 0.0
    }
}

fn look_at(eye: DVec3, target: DVec3, up: DVec3) -> DMat4 {
    let back = (eye - target).try_normalize().unwrap_or(DVec3::Z);
    let right = up.cross(back).try_normalize().unwrap_or_else(|| back.any_orthonormal_vector());
    let up = back.cross(right);
    let turn = DMat4::from_cols(
        DVec3::new(right.x, up.x, back.x).extend(0.0),
        DVec3::new(right.y, up.y, back.y).extend(0.0),
        DVec3::new(right.z, up.z, back.z).extend(0.0),
        DVec3::ZERO.extend(1.0),
    );
    turn * DMat4::from_translation(-eye)
}

/// What is shown of surfaces. With `shaded` off and neither `wireframe` nor `xray`, surfaces hide what is behind
/// them but show no colour: a hidden-line drawing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Display {
    /// Surfaces are filled and lit.
    pub shaded: bool,
    /// Lines of role [`LineRole::Edge`] are drawn.
    pub edges: bool,
    /// Lines of role [`LineRole::Iso`] are drawn.
    pub isolines: bool,
    /// Surfaces are not drawn at all and hide nothing: edges and iso-lines only, whatever the other flags say.
    pub wireframe: bool,
    /// Surfaces are translucent and hide nothing.
    pub xray: bool,
    /// Surfaces reflect a striped room, which shows breaks of tangent and curvature.
    pub zebra: bool,
}

impl Default for Display {
    fn default() -> Self {
        Self { shaded: true, edges: true, isolines: false, wireframe: false, xray: false, zebra: false }
    }
}

/// The backdrop: a vertical gradient.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Background {
    /// At the upper edge.
    pub top: Color,
    /// At the lower edge.
    pub bottom: Color,
}

impl Background {
    /// For the light theme.
    pub fn light() -> Self {
        Self { top: srgb(0xf7f9fb), bottom: srgb(0xcfd8e1) }
    }

    /// For the dark theme.
    pub fn dark() -> Self {
        Self { top: srgb(0x3a424d), bottom: srgb(0x14171b) }
    }
}

/// A plane that removes the half of the model into which its normal points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Section {
    /// Unit normal.
    pub normal: DVec3,
    /// Points with `normal . p > offset` are not drawn.
    pub offset: f64,
}

/// How much an item stands out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Emphasis {
    /// Stepped back: paler and closer to the background.
    Muted,
    /// As it is.
    #[default]
    Normal,
    /// Under the cursor: brighter, lines one pixel wider.
    Hovered,
    /// Chosen: in the accent colour.
    Selected,
}

/// One number per vertex, shown in colour.
#[derive(Clone, Debug)]
pub struct Field {
    /// Changes whenever the values do.
    pub revision: u64,
    /// One value per vertex of the mesh; NaN where there is no data (hatched grey).
    pub values: Arc<Vec<f32>>,
    /// What the numbers look like.
    pub scale: Arc<ColorScale>,
}

/// A mesh to draw.
#[derive(Clone, Debug)]
pub struct MeshItem {
    /// Its name on the GPU.
    pub key: Key,
    /// Changes whenever the mesh does.
    pub revision: u64,
    /// The triangles.
    pub mesh: Arc<MeshData>,
    /// Colour of the front; the back is a muted tint of it. Alpha below 1 is translucent (preview ghosts).
    pub color: Color,
    /// How much it stands out.
    pub emphasis: Emphasis,
    /// A number per vertex in place of the colour.
    pub field: Option<Field>,
    /// Whether the section plane cuts it.
    pub sectioned: bool,
}

/// Polylines, relative to an origin.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LineData {
    /// Model position of the local (0, 0, 0).
    pub origin: DVec3,
    /// The points of all polylines, one after the other.
    pub points: Vec<[f32; 3]>,
    /// Where each polyline ends in `points` (exclusive), ascending.
    pub ends: Vec<u32>,
}

impl LineData {
    /// No lines yet, around `origin`.
    pub fn new(origin: DVec3) -> Self {
        Self { origin, ..Self::default() }
    }

    /// Adds a polyline of model points. It is drawn closed when its last point is its first. Fewer than two points
    /// draw nothing.
    pub fn push(&mut self, polyline: impl IntoIterator<Item = DVec3>) -> &mut Self {
        self.points.extend(polyline.into_iter().map(|p| (p - self.origin).as_vec3().to_array()));
        self.ends.push(u32::try_from(self.points.len()).unwrap_or(u32::MAX));
        self
    }

    /// The polylines.
    pub fn polylines(&self) -> impl Iterator<Item = &[[f32; 3]]> {
        let mut start = 0;
        self.ends.iter().map(move |&end| {
            let run = self.points.get(start..end as usize).unwrap_or(&[]);
            start = end as usize;
            run
        })
    }
}

/// The stroke of a line.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Dash {
    /// Unbroken.
    #[default]
    Solid,
    /// Strokes and gaps, in points on screen.
    Dashed {
        /// Length of a stroke.
        on: f32,
        /// Length of a gap.
        off: f32,
    },
    /// Two parallel strokes.
    Double,
}

impl Dash {
    /// Long strokes.
    pub const LONG: Self = Self::Dashed { on: 9.0, off: 5.0 };
    /// Short strokes.
    pub const SHORT: Self = Self::Dashed { on: 4.0, off: 3.5 };
}

/// What happens to the part of a line or glyph behind a surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Hidden {
    /// It is dashed, at 40 % (glyphs: not dashed).
    #[default]
    Dashed,
    /// It is not drawn.
    Gone,
    /// It is drawn as if nothing were in front.
    OnTop,
}

/// What a line is for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LineRole {
    /// An edge of a surface; follows [`Display::edges`].
    #[default]
    Edge,
    /// An iso-curve of a surface; follows [`Display::isolines`].
    Iso,
    /// Anything else: always drawn.
    Curve,
}

/// How a line is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LineStyle {
    /// Width in points (pixels on a screen without scaling).
    pub width: f32,
    /// Its colour.
    pub color: Color,
    /// Solid, dashed or double.
    pub dash: Dash,
    /// The part behind surfaces.
    pub hidden: Hidden,
}

impl Default for LineStyle {
    fn default() -> Self {
        Self { width: 1.5, color: srgb(0x1b1f24), dash: Dash::Solid, hidden: Hidden::Dashed }
    }
}

/// Lines to draw. Later items lie over earlier ones at equal depth.
#[derive(Clone, Debug)]
pub struct LineItem {
    /// Its name on the GPU.
    pub key: Key,
    /// Changes whenever the lines do.
    pub revision: u64,
    /// The polylines.
    pub lines: Arc<LineData>,
    /// Width, colour, dashes.
    pub style: LineStyle,
    /// What they are for.
    pub role: LineRole,
    /// How much they stand out.
    pub emphasis: Emphasis,
    /// Whether the section plane cuts them.
    pub sectioned: bool,
}

/// The outline of a glyph. All are screen-constant.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum GlyphShape {
    /// A filled disc: curve ends, samples that hit.
    #[default]
    Round = 0,
    /// An open circle: samples with several hits.
    Ring = 1,
    /// Two strokes: samples without a hit.
    Cross = 2,
    /// Branch points.
    Diamond = 3,
    /// Isolated points.
    Square = 4,
    /// Miter points.
    Triangle = 5,
    /// An arrow head that points along [`Glyph::direction`].
    Arrow = 6,
}

/// One point on screen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Glyph {
    /// Position relative to the origin.
    pub position: [f32; 3],
    /// Model direction that the glyph's own x axis follows; zero: upright.
    pub direction: [f32; 3],
    /// Diameter in points.
    pub size: f32,
    /// Its colour.
    pub color: Color,
    /// Its outline.
    pub shape: GlyphShape,
}

/// Glyphs, relative to an origin.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GlyphData {
    /// Model position of the local (0, 0, 0).
    pub origin: DVec3,
    /// The glyphs.
    pub glyphs: Vec<Glyph>,
}

impl GlyphData {
    /// No glyphs yet, around `origin`.
    pub fn new(origin: DVec3) -> Self {
        Self { origin, glyphs: Vec::new() }
    }

    /// Adds a glyph at a model point.
    pub fn push(&mut self, at: DVec3, shape: GlyphShape, size: f32, color: Color) -> &mut Self {
        let position = (at - self.origin).as_vec3().to_array();
        self.glyphs.push(Glyph { position, direction: [0.0; 3], size, color, shape });
        self
    }

    /// Adds an arrow head at a model point.
    pub fn push_arrow(&mut self, at: DVec3, direction: DVec3, size: f32, color: Color) -> &mut Self {
        let position = (at - self.origin).as_vec3().to_array();
        let direction = direction.normalize_or_zero().as_vec3().to_array();
        self.glyphs.push(Glyph { position, direction, size, color, shape: GlyphShape::Arrow });
        self
    }
}

/// Glyphs to draw.
#[derive(Clone, Debug)]
pub struct GlyphItem {
    /// Its name on the GPU.
    pub key: Key,
    /// Changes whenever the glyphs do.
    pub revision: u64,
    /// The glyphs.
    pub glyphs: Arc<GlyphData>,
    /// What happens behind surfaces.
    pub hidden: Hidden,
    /// Whether the section plane cuts them.
    pub sectioned: bool,
}

/// Boxes swept by spheres, each with a colour.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct VolumeData {
    /// Model position of the local (0, 0, 0) on the GPU.
    pub origin: DVec3,
    /// The volumes, in model coordinates. Neighbours in the list should be neighbours in space: the list is culled in
    /// runs.
    pub volumes: Arc<Vec<RoundedBox>>,
    /// Their colours: sRGB with alpha.
    pub colors: Vec<[u8; 4]>,
}

/// How volumes are drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum VolumeForm {
    /// As translucent bodies, the nearest only, with their silhouettes.
    Solid,
    /// As silhouettes with a faint inside.
    Outline {
        /// The width of the line in points.
        width: f32,
        /// How opaque the inside is, 0..=1.
        fill: f32,
    },
}

/// Volumes to draw. They lie over surfaces and lines.
#[derive(Clone, Debug)]
pub struct VolumeItem {
    /// Its name on the GPU.
    pub key: Key,
    /// Changes whenever the volumes do.
    pub revision: u64,
    /// The volumes.
    pub volumes: Arc<VolumeData>,
    /// Bodies or silhouettes.
    pub form: VolumeForm,
    /// How opaque they are, times the alpha of their colours.
    pub opacity: f32,
    /// Whether the section plane cuts them.
    pub sectioned: bool,
}

/// Everything one frame shows.
#[derive(Clone, Debug)]
pub struct FrameData {
    /// Width and height in pixels. At least 1 x 1; what exceeds the device's largest texture is scaled up.
    pub size: [u32; 2],
    /// Pixels per point: line widths and glyph sizes are multiplied by it.
    pub pixels_per_point: f32,
    /// The camera.
    pub camera: CameraData,
    /// The backdrop.
    pub background: Background,
    /// Colour of what is selected.
    pub accent: Color,
    /// What surfaces look like.
    pub display: Display,
    /// The section plane.
    pub section: Option<Section>,
    /// Meshes.
    pub meshes: Vec<MeshItem>,
    /// Lines.
    pub lines: Vec<LineItem>,
    /// Bounding volumes.
    pub volumes: Vec<VolumeItem>,
    /// Points.
    pub glyphs: Vec<GlyphItem>,
}

impl FrameData {
    /// An empty frame in the light theme.
    pub fn new(size: [u32; 2], camera: CameraData) -> Self {
        Self {
            size,
            pixels_per_point: 1.0,
            camera,
            background: Background::light(),
            accent: srgb(0xff8a1f),
            display: Display::default(),
            section: None,
            meshes: Vec::new(),
            lines: Vec::new(),
            volumes: Vec::new(),
            glyphs: Vec::new(),
        }
    }
}
