//! How a heal is asked for, as data: the RON that `patchwright heal --patches` reads and that the picking tool
//! writes, so that a session can be replayed; and what a heal reports.

use serde::{Deserialize, Serialize};

pub use crate::kernel::heal::report::{BoundaryMode, HealStep, PatchReport};

/// A whole heal: several patches with common settings.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HealSpec {
    /// What two picked curve ends may be apart and still be joined, in model units. Default: 1e-3 of the diagonal.
    #[serde(default)]
    pub joining_tol: Option<f64>,
    /// The largest error wanted, in model units. Default: 1e-4 of the diagonal.
    #[serde(default)]
    pub tol: Option<f64>,
    /// The number of spans along each side that the refinement starts with.
    #[serde(default = "default_min_resolution")]
    pub min_resolution: usize,
    /// The largest number of spans along one side.
    #[serde(default = "default_max_resolution")]
    pub max_resolution: usize,
    /// The bodies to project on, by number (surfaces first, then meshes and blocks); all when left out.
    #[serde(default)]
    pub onto: Option<Vec<usize>>,
    /// Half the thickness of the box of influence (d of HJR99 (7)); from the corners when left out.
    #[serde(default)]
    pub slab: Option<f64>,
    /// How many known projections an artificial one is made from (K of HJR99 (12)).
    #[serde(default = "default_neighbours")]
    pub neighbours: usize,
    /// The exponent of HJR99 (12).
    #[serde(default = "default_gamma")]
    pub gamma: f64,
    /// R of HJR99 (12); half the sum of the mean parameter spacings when left out.
    #[serde(default)]
    pub radius: Option<f64>,
    /// How far the triangles that find projections may be off the surfaces, in model units. Projections lie on the
    /// surfaces themselves, but which one is nearest depends on it in the last bits. Default: 5e-4 of the diagonal.
    #[serde(default)]
    pub chord_tol: Option<f64>,
    /// The patches. They are healed together: those that share a boundary agree along it bit for bit.
    pub patches: Vec<PatchSpec>,
    /// Further heals of the same model, each on its own and with its own settings.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub then: Vec<HealSpec>,
}

impl Default for HealSpec {
    fn default() -> Self {
        Self {
            joining_tol: None,
            tol: None,
            min_resolution: default_min_resolution(),
            max_resolution: default_max_resolution(),
            onto: None,
            slab: None,
            neighbours: default_neighbours(),
            gamma: default_gamma(),
            radius: None,
            chord_tol: None,
            patches: Vec::new(),
            then: Vec::new(),
        }
    }
}

/// Why a text is no patch specification.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("line {line}, column {column}: {reason}")]
pub struct SpecError {
    /// Where it goes wrong, from 1.
    pub line: usize,
    /// Where in the line, from 1.
    pub column: usize,
    /// What is wrong there.
    pub reason: String,
}

impl HealSpec {
    /// The settings alone.
    #[must_use]
    pub fn settings(&self) -> Self {
        Self { onto: self.onto.clone(), patches: Vec::new(), then: Vec::new(), ..*self }
    }

    /// The same settings for other patches.
    #[must_use]
    pub fn with_patches(&self, patches: Vec<PatchSpec>) -> Self {
        Self { patches, ..self.settings() }
    }

    /// This heal and those after it, each alone; those without patches are left out.
    pub fn heals(&self) -> Vec<Self> {
        let own = (!self.patches.is_empty()).then(|| self.with_patches(self.patches.clone()));
        own.into_iter().chain(self.then.iter().flat_map(Self::heals)).collect()
    }

    /// Changes the wanted error of this heal and those after it.
    pub fn set_tol(&mut self, tol: f64) {
        self.tol = Some(tol);
        self.then.iter_mut().for_each(|spec| spec.set_tol(tol));
    }

    /// Reads a specification. Options may be written without `Some`.
    pub fn from_ron(text: &str) -> Result<Self, SpecError> {
        ron_options().from_str(text).map_err(|error| SpecError {
            line: error.span.start.line,
            column: error.span.start.col,
            reason: error.code.to_string(),
        })
    }

    /// Writes a specification so that [`Self::from_ron`] reads the same.
    pub fn to_ron(&self) -> Result<String, ron::Error> {
        let pretty = ron::ser::PrettyConfig::new().depth_limit(4).indentor("  ").new_line("\n").struct_names(false);
        let mut text = ron_options().to_string_pretty(self, pretty)?;
        text.push('\n');
        Ok(text)
    }
}

fn ron_options() -> ron::Options {
    ron::Options::default().with_default_extension(ron::extensions::Extensions::IMPLICIT_SOME)
}

/// Four values as a list: RON writes arrays of fixed size as tuples, and four sides are a list to people.
mod four {
    use serde::de::{Deserialize, Deserializer, Error};
    use serde::ser::{Serialize, Serializer};

    pub fn serialize<T: Serialize, S: Serializer>(values: &[T; 4], to: S) -> Result<S::Ok, S::Error> {
        values.as_slice().serialize(to)
    }

    pub fn deserialize<'de, T: Deserialize<'de>, D: Deserializer<'de>>(from: D) -> Result<[T; 4], D::Error> {
        let values = Vec::<T>::deserialize(from)?;
        <[T; 4]>::try_from(values).map_err(|v| D::Error::invalid_length(v.len(), &"exactly four"))
    }
}

fn default_min_resolution() -> usize {
    8
}

fn default_max_resolution() -> usize {
    128
}

fn default_gamma() -> f64 {
    0.001
}

fn default_neighbours() -> usize {
    8
}

/// One patch: four sides, in any order and direction.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PatchSpec {
    /// What it is called.
    pub name: String,
    /// What becomes of each side's curve.
    #[serde(default, with = "four")]
    pub boundary: [BoundaryMode; 4],
    /// The pieces of each side, in any order and direction.
    #[serde(with = "four")]
    pub sides: [Vec<Piece>; 4],
    /// What was decided by hand about how the sides meet; nothing when left out.
    #[serde(default, skip_serializing_if = "Joining::is_default")]
    pub joining: Joining,
}

/// What was decided by hand about how four sides meet.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Joining {
    /// How the sides follow each other; the loop with the smallest gaps when left out.
    pub arrangement: Option<Arrangement>,
    /// What two ends may be apart and still be joined in this patch; the heal's when left out.
    pub tol: Option<f64>,
    /// Ends that are moved before the sides are joined.
    pub moves: Vec<EndMove>,
}

impl Joining {
    /// Whether nothing was decided by hand.
    pub fn is_default(&self) -> bool {
        *self == Self::default()
    }
}

/// How four sides follow each other: side `order[k]` (from 0) at place k, run backwards where `reversed[k]`. Backwards
/// is against the direction in which its pieces are chained.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Arrangement {
    /// The side at each place of the loop.
    pub order: [usize; 4],
    /// Whether it runs backwards there.
    pub reversed: [bool; 4],
}

/// The end of a side that is nearest to a point is moved onto it; the displacement fades along its last piece.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct EndMove {
    /// Which side, from 0.
    pub side: usize,
    /// Where its end goes.
    pub to: (f64, f64, f64),
}

/// One piece of a side.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Piece {
    /// An iso-curve of a surface between two surface parameters: at `U(c)` it runs along v, at `V(c)` along u.
    Iso {
        /// The number of the surface.
        surface: usize,
        /// The parameter that stays fixed.
        at: IsoAt,
        /// Where it starts.
        from: f64,
        /// Where it ends.
        to: f64,
    },
    /// An edge of a face, between two fractions of its arc length.
    Edge {
        /// The number of the face.
        face: usize,
        /// The loop: 0 is the outer one.
        #[serde(rename = "loop")]
        ring: usize,
        /// The edge of the loop. An untrimmed surface has v = min, u = max, v = max, u = min.
        edge: usize,
        /// Where it starts, 0..=1.
        from: f64,
        /// Where it ends, 0..=1.
        to: f64,
    },
    /// A straight segment.
    Line((f64, f64, f64), (f64, f64, f64)),
    /// A polyline.
    Polyline(Vec<(f64, f64, f64)>),
    /// A free curve of the file, between two fractions of its arc length.
    Curve {
        /// Its number among the file's curves.
        id: usize,
        /// Where it starts, 0..=1.
        from: f64,
        /// Where it ends, 0..=1.
        to: f64,
    },
    /// A border or feature edge of a mesh or a grid line of a block, between two fractions of its arc length.
    Chain {
        /// The number of the mesh or block among the file's meshes and blocks.
        mesh: usize,
        /// Its number among the curves of that mesh or block, as `info --all` counts and names them.
        chain: usize,
        /// Where it starts, 0..=1.
        from: f64,
        /// Where it ends, 0..=1.
        to: f64,
    },
    /// A curve drawn across several surfaces: the polyline of the points, put onto the nearest surface.
    Drawn(Vec<(f64, f64, f64)>),
}

/// The fixed parameter of an iso-curve.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum IsoAt {
    /// u is fixed; the curve runs along v.
    U(f64),
    /// v is fixed; the curve runs along u.
    V(f64),
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The example of the manual.
    const MANUAL: &str = "(joining_tol: 1e-3, tol: 1e-4, max_resolution: 128, onto: [0, 1, 2, 3], slab: None, \
        neighbours: 8, patches: [ (name: \"nose\", boundary: [Keep, Keep, Project, Keep], sides: [ \
        [Iso(surface: 0, at: U(1.0), from: 1.0, to: 7.0)], // at U(c): runs along v\n \
        [Edge(face: 2, loop: 0, edge: 3, from: 0.0, to: 1.0), Line((0,0,0), (1,0,0))], \
        [Polyline([(0,0,0), (1,0,0)])], [Curve(id: 12, from: 0.0, to: 0.4)]])])";

    #[test]
    fn the_manual_is_read_and_written_back_the_same() {
        let spec = HealSpec::from_ron(MANUAL).unwrap();
        assert_eq!((spec.tol, spec.onto.as_deref()), (Some(1e-4), Some(&[0, 1, 2, 3][..])));
        assert_eq!(spec.patches[0].boundary[2], BoundaryMode::Project);
        assert_eq!(spec.patches[0].sides[1].len(), 2);
        let text = spec.to_ron().unwrap();
        assert_eq!(HealSpec::from_ron(&text).unwrap(), spec, "{text}");
    }

    #[test]
    fn short_specifications_take_the_defaults() {
        let side = "[Polyline([(0,0,0), (1,0,0)])]";
        let spec =
            HealSpec::from_ron(&format!("(patches: [(name: \"a\", sides: [{}])])", [side; 4].join(", "))).unwrap();
        assert_eq!((spec.tol, spec.max_resolution, spec.neighbours), (None, 128, 8));
        assert_eq!(spec.patches[0].boundary, [BoundaryMode::Keep; 4]);
    }

    #[test]
    fn errors_say_where() {
        let three = MANUAL.replace(", [Curve(id: 12, from: 0.0, to: 0.4)]", "");
        let error = HealSpec::from_ron(&three).unwrap_err();
        assert!(error.reason.contains("four"), "{error}");
        let error = HealSpec::from_ron("(\n  patchs: [])").unwrap_err();
        assert!(error.line == 2 && error.reason.contains("patchs"), "{error}");
        for garbage in ["", "\u{0}\u{1}", "(patches: [(name: \"a\"", "(patches: 1e999)"] {
            assert!(HealSpec::from_ron(garbage).is_err());
        }
    }
}
