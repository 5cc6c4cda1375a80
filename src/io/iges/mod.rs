//! IGES 5.3, fixed 80-column ASCII: surfaces 128, 114, 118, 120, 122, 140, planes and quadrics 108 and 190 to 198; trimmed
//! faces 144, 143 and 510; curves 130, 126, 112, 110, 106, 104, 102 and 100; with transforms 124, subfigures 308 and 408,
//! groups 402, units, colours 314 and names 406.
//!
//! Nothing in a file is trusted: counts are checked against the bytes that are there, pointers may lead nowhere
//! or in circles, and whatever is wrong with one entity loses that entity only. Every entity either becomes
//! geometry, describes some (transform, colour, name), or has a line in the report. Cost: linear in the file.

mod analytic;
mod curves;
mod directory;
mod faces;
mod groups;
mod header;
mod instances;
mod kinds;
mod offset_curve;
mod params;
mod power_basis;
mod sections;
mod spline;
mod sweeps;
mod transform;
mod uses;
mod write;

pub use write::{IgesOptions, IgesWriteError, write, write_with_traces};

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use glam::{DAffine3, DVec3};

use self::directory::Directory;
use self::groups::Groups;
use self::header::Header;
use self::instances::Instances;
use self::params::Params;
use self::sections::{Line, Sections};
use self::uses::Uses;
use super::faces::{FaceJob, make, show_all_if_all_are_hidden};
use super::{ImportReport, Opened, Severity};
use crate::kernel::geom::{Curve, Surface};
use crate::model::document::{Document, Entity, EntityId, Shape};

/// Why a file is no IGES file that can be read.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum IgesError {
    /// No line has a section letter where IGES has it.
    #[error("{lines} of its lines have no section letter (S, G, D, P, T) in column 73, and no line is an entity")]
    NotIges {
        /// The number of such lines.
        lines: usize,
    },
    /// There is no entity at all.
    #[error("it has no directory section, hence no entities; it was probably cut off while it was written")]
    NoEntities,
    /// The binary form of IGES.
    #[error("it is IGES in binary form, which is not read; export it in fixed ASCII form")]
    Binary,
    /// The compressed form of IGES.
    #[error("it is IGES in compressed form, which is not read; export it in fixed ASCII form")]
    Compressed,
}

/// How often the bytes of a file may be read over again for composites of composites and for surfaces that stand
/// at several places: without a limit a small file could unfold without end.
const UNFOLDING: usize = 4;
/// The longest name that is kept, in characters.
const LONGEST_NAME: usize = 200;

/// Reads the bytes of a file.
pub fn read(bytes: &[u8]) -> Result<Opened, IgesError> {
    let sections = Sections::of(bytes)?;
    let mut report = ImportReport::default();
    if sections.directory.is_empty() {
        let found = sections.global.len() + sections.parameter.len();
        return Err(if found == 0 { IgesError::NotIges { lines: sections.strays } } else { IgesError::NoEntities });
    }
    let header = Header::of(&sections.global, &mut report);
    if sections.strays > 0 {
        let reason = format!("{} lines have no section letter in column 73 and were left out", sections.strays);
        report.add(Severity::Warning, "file", None, Some(sections.first_stray), reason);
    }
    if !sections.terminated {
        report.add(Severity::Warning, "file", None, None, "there is no terminate section; the file may be cut off");
    }
    let directory = Directory::of(&sections.directory, &mut report);
    if directory.entries.is_empty() {
        let lines = sections.strays;
        return Err(if lines > 0 { IgesError::NotIges { lines } } else { IgesError::NoEntities });
    }
    for entry in &directory.entries {
        *report.found.entry(format!("IGES {}", entry.kind)).or_default() += 1;
    }
    let unfolding_left = UNFOLDING * bytes.len();
    let reader = Reader {
        sections,
        header,
        directory,
        transforms: HashMap::new(),
        colors: HashMap::new(),
        first_line: None,
        report,
        entities: Vec::new(),
        counts: [0; 2],
        unfolding_left,
        instance: None,
        reach: Vec::new(),
        groups: Groups::default(),
        faces: Vec::new(),
        face_surfaces: HashMap::new(),
        read_surfaces: HashSet::new(),
        edges: HashMap::new(),
        edge_lists: HashMap::new(),
        vertex_lists: HashMap::new(),
        next_edge: 0,
    };
    Ok(reader.run())
}

/// A file while it is read.
struct Reader<'a> {
    sections: Sections<'a>,
    header: Header,
    directory: Directory,
    transforms: HashMap<usize, transform::Known>,
    colors: HashMap<usize, Option<[f32; 3]>>,
    /// The place of the first parameter line of each entity by the pointers on the lines themselves; made when
    /// the directory was found to point elsewhere.
    first_line: Option<HashMap<usize, usize>>,
    report: ImportReport,
    entities: Vec<Entity>,
    /// Surfaces and curves so far.
    counts: [usize; 2],
    unfolding_left: usize,
    /// The subfigure whose members are being opened: its number and place.
    instance: Option<(usize, DAffine3)>,
    /// Points that the next unbounded surface must reach, in the coordinates of its record.
    reach: Vec<DVec3>,
    /// Which entities belong together.
    groups: Groups,
    /// Faces to be made at the end.
    faces: Vec<FaceJob<usize>>,
    /// Surfaces of faces by entry, transform of the face and subfigure.
    face_surfaces: HashMap<(usize, usize, usize), faces::FaceSurfaces>,
    read_surfaces: HashSet<usize>,
    edges: faces::Edges,
    edge_lists: HashMap<usize, Arc<Vec<[usize; 5]>>>,
    vertex_lists: HashMap<usize, Arc<Vec<DVec3>>>,
    next_edge: u64,
}

/// What a record describes.
enum Geometry {
    Surfaces(Vec<Surface>),
    Curves(Vec<Curve>),
}

impl Reader<'_> {
    fn run(mut self) -> Opened {
        let uses = Uses::of(&mut self);
        let instances = Instances::of(&mut self);
        self.groups = Groups::of(&mut self);
        for at in 0..self.directory.entries.len() {
            match instances.places(at) {
                None => self.entity(at, &uses),
                Some([]) => self.note(Severity::Skipped, at, "it belongs to a subfigure that stands nowhere"),
                Some(places) => {
                    for (k, &place) in places.iter().enumerate() {
                        self.instance = Some((k + 1, place));
                        self.entity(at, &uses);
                    }
                    self.instance = None;
                }
            }
        }
        for (at, reason) in make(&std::mem::take(&mut self.faces), &mut self.entities) {
            self.note(Severity::Warning, at, reason);
        }
        self.report.lines.sort_by_key(|l| l.line);
        show_all_if_all_are_hidden(&mut self.entities, &mut self.report);
        [self.report.surfaces, self.report.curves] = self.counts;
        Opened { document: Document::from_parts(self.header.unit, self.entities, 0), report: self.report }
    }

    /// Opens what an entry describes, or says why not.
    fn entity(&mut self, at: usize, uses: &Uses) {
        let entry = &self.directory.entries[at];
        match entry.kind {
            128 | 114 | 118 | 120 | 122 | 140 | 190..=198 => self.surface(at, uses),
            108 if !uses.faces_of(at).is_empty() => self.surface(at, uses),
            130 | 126 | 112 | 110 | 104 | 100 | 102 => self.free_curve(at, uses),
            106 if matches!(entry.form, 11..=13 | 63) => self.free_curve(at, uses),
            144 | 143 | 510 => self.face(at, uses),
            124 | 314 | 0 => {}
            406 if entry.form == 15 => {}
            402 if matches!(entry.form, 1 | 7 | 14 | 15) => {
                if let Some(reason) = self.groups.note(at) {
                    self.note(Severity::Info, at, reason);
                }
            }
            kind => {
                let (severity, reason) = kinds::unread(kind, uses.is_consumed(at));
                self.note(severity, at, reason);
            }
        }
    }

    /// A report line on an entity.
    fn note(&mut self, severity: Severity, at: usize, reason: impl Into<String>) {
        let entry = &self.directory.entries[at];
        self.report.add(severity, format!("IGES {}", entry.kind), Some(entry.sequence), Some(entry.line), reason);
    }

    fn warn_all(&mut self, at: usize, notes: Vec<String>) {
        for note in notes {
            self.note(Severity::Warning, at, note);
        }
    }

    /// Runs `read` on the parameters of an entity, behind its type number.
    fn record<T>(&mut self, at: usize, read: impl FnOnce(&mut Self, &mut Params<'_>) -> T) -> Result<T, String> {
        let bytes = self.parameter_data(at)?;
        let mut params = Params::new(&bytes, self.header.delimiters);
        let kind = params.integer("the entity type").map_err(|e| e.to_string())?;
        let expected = self.directory.entries[at].kind;
        if kind != expected {
            return Err(format!("its parameters are those of type {kind}"));
        }
        Ok(read(self, &mut params))
    }

    /// The parameter data of an entity, without line ends. Data may reach into column 65.
    fn parameter_data(&mut self, at: usize) -> Result<Vec<u8>, String> {
        let entry = &self.directory.entries[at];
        let (sequence, pointer, count) = (entry.sequence, entry.parameters, entry.parameter_lines.max(1));
        let lines = &self.sections.parameter;
        let owner = |line: &Line<'_>| {
            let field = if line.columns(64, 65) == b" " { line.columns(65, 72) } else { line.columns(66, 72) };
            std::str::from_utf8(field.trim_ascii()).ok()?.parse::<usize>().ok()
        };
        let belongs = |line: &Line<'_>| owner(line).is_none_or(|o| o == sequence);
        let mut first = pointer.checked_sub(1).filter(|&first| lines.get(first).is_some_and(belongs));
        if first.is_none() {
            let index = self.first_line.get_or_insert_with(|| {
                let mut index = HashMap::new();
                for (place, line) in lines.iter().enumerate() {
                    if let Some(owner) = owner(line) {
                        index.entry(owner).or_insert(place);
                    }
                }
                index
            });
            first = index.get(&sequence).copied();
        }
        let Some(first) = first else {
            return Err(format!("its parameter data (line P {pointer}) is missing"));
        };
        let mut bytes = Vec::with_capacity(64 * count.min(lines.len() - first));
        for line in lines[first..].iter().take(count).take_while(|line| belongs(line)) {
            let width = if line.columns(64, 65) == b" " { 64 } else { 65 };
            bytes.extend_from_slice(line.columns(0, width));
        }
        Ok(bytes)
    }

    /// What a record describes, in the coordinates of the record, with its properties.
    fn geometry(&mut self, at: usize, depth: usize) -> Result<(Geometry, Vec<usize>), String> {
        let (kind, form) = (self.directory.entries[at].kind, self.directory.entries[at].form);
        let resolution = self.header.resolution;
        let mut notes = Vec::new();
        let read = self.record(at, |reader, params| {
            let notes = &mut notes;
            let one = |curve| Geometry::Curves(vec![curve]);
            let geometry = match kind {
                128 => Geometry::Surfaces(spline::surface(params, notes)?),
                114 => Geometry::Surfaces(power_basis::surface(params, resolution, notes)?),
                120 => Geometry::Surfaces(vec![reader.revolution(params, depth)?]),
                122 => Geometry::Surfaces(vec![reader.tabulated(params, depth)?]),
                118 => Geometry::Surfaces(vec![reader.ruled(form, params, depth, notes)?]),
                140 => Geometry::Surfaces(vec![reader.offset(params, depth, notes)?]),
                108 | 190 | 192 | 194 | 196 | 198 => Geometry::Surfaces(vec![reader.analytic(kind, form, params)?]),
                130 => one(reader.offset_curve(params, depth, notes)?),
                104 => one(analytic::conic(params)?),
                106 => one(analytic::copious(form, params)?),
                126 => Geometry::Curves(spline::curve(params, notes)?),
                112 => Geometry::Curves(power_basis::curve(params, resolution, notes)?),
                110 => one(curves::line(params)?),
                100 => one(curves::arc(params)?),
                102 => Geometry::Curves(reader.composite(params, depth, notes)?),
                other => return Err(format!("entity {other} has no curve or surface that can be read")),
            };
            if params.ran_out {
                return Err("its record is cut off: it ends without a delimiter".into());
            }
            Ok((geometry, params.properties()))
        });
        self.warn_all(at, notes);
        read?
    }

    /// Takes so much from what may still be unfolded.
    fn unfold(&mut self, cost: usize) -> Result<(), String> {
        match self.unfolding_left.checked_sub(cost) {
            Some(left) => self.unfolding_left = left,
            None => return Err("the entities of this file refer to each other too often".into()),
        }
        Ok(())
    }

    /// The curves that a pointer inside another entity names, moved by their own transform.
    fn placed_curves(&mut self, pointer: usize, depth: usize) -> Result<Vec<Curve>, String> {
        if depth >= 16 {
            return Err("entities are nested more than 16 deep, or lead back to themselves".into());
        }
        let Some(at) = self.directory.find(pointer) else { return Err(format!("entity {pointer} does not exist")) };
        let entry = &self.directory.entries[at];
        let transform = entry.transform;
        self.unfold(64 * entry.parameter_lines.clamp(1, self.sections.parameter.len().max(1)))?;
        match self.geometry(at, depth + 1)?.0 {
            Geometry::Curves(curves) => match self.transform(transform)? {
                Some(map) => Ok(curves.iter().map(|c| c.transformed(&map)).collect()),
                None => Ok(curves),
            },
            Geometry::Surfaces(_) => Err(format!("entity {pointer} is no curve")),
        }
    }

    /// The curves of a composite: its members, each moved by its own transform, joined.
    fn composite(
        &mut self,
        params: &mut Params<'_>,
        depth: usize,
        notes: &mut Vec<String>,
    ) -> Result<Vec<Curve>, String> {
        let count = params.count("members", 1).map_err(|e| e.to_string())?;
        let pointers: Vec<usize> =
            (0..count).map(|_| params.pointer()).collect::<Result<_, _>>().map_err(|e| e.to_string())?;
        let mut members = Vec::new();
        let mut lost: Option<(usize, String)> = None;
        for pointer in pointers {
            let kind = self.directory.find(pointer).map(|at| self.directory.entries[at].kind);
            if matches!(kind, Some(116 | 132)) {
                continue; // a point between two members says nothing that the members do not
            }
            match self.placed_curves(pointer, depth) {
                Ok(curves) => members.extend(curves),
                Err(reason) => lost.get_or_insert((0, reason)).0 += 1,
            }
        }
        if let Some((count, reason)) = lost {
            notes.push(format!("{count} of its members cannot be read; the first: {reason}"));
        }
        if members.is_empty() {
            return Err("it has no member that can be read".into());
        }
        Ok(curves::join(members, self.header.resolution, notes))
    }

    /// The map from the coordinates of an entity's record to the model's, `None` where it does nothing. A
    /// transform that cannot be followed is reported and left out.
    fn placement(&mut self, at: usize, outer: Option<usize>) -> Option<DAffine3> {
        let scale = 1.0 / self.header.scale;
        let mut map = (scale != 1.0).then(|| DAffine3::from_scale(DVec3::splat(scale)));
        if let Some((_, place)) = self.instance {
            map = Some(map.map_or(place, |map| map * place));
        }
        for owner in outer.into_iter().chain([at]) {
            match self.transform(self.directory.entries[owner].transform) {
                Ok(None) => {}
                Ok(Some(inner)) => map = Some(map.map_or(inner, |map| map * inner)),
                Err(reason) => self.note(Severity::Warning, owner, format!("not moved to its place: {reason}")),
            }
        }
        map.filter(|map| *map != DAffine3::IDENTITY)
    }

    /// A surface that is not trimmed. Those of faces are opened with their faces.
    fn surface(&mut self, at: usize, uses: &Uses) {
        if !uses.faces_of(at).is_empty() {
            return self.note(Severity::Info, at, "opened with the faces on it");
        }
        if uses.is_consumed(at) {
            return self.note(Severity::Info, at, "only describes another entity; no surface of its own");
        }
        let (geometry, properties) = match self.geometry(at, 0) {
            Ok((Geometry::Surfaces(surfaces), properties)) => (surfaces, properties),
            Ok(_) => return,
            Err(reason) => return self.note(Severity::Skipped, at, reason),
        };
        let map = self.placement(at, None);
        let name = self.name_of(at, &properties);
        let count = geometry.len();
        for (part, surface) in geometry.into_iter().enumerate() {
            let moved = map.map_or_else(|| surface.clone(), |map| surface.transformed(&map));
            if let Err(reason) = sound(moved.points()) {
                self.note(Severity::Skipped, at, reason);
                continue;
            }
            self.add(Shape::Surface(Arc::new(moved)), at, at, name.as_deref(), (part, count));
        }
    }

    /// A curve, when it is one of the model and not a means to describe something else.
    fn free_curve(&mut self, at: usize, uses: &Uses) {
        let entry = &self.directory.entries[at];
        if entry.usage == 5 || uses.is_consumed(at) {
            return self.note(Severity::Info, at, "only describes another entity; no free curve");
        }
        if entry.dependent && self.instance.is_none() {
            return self.note(Severity::Skipped, at, "belongs to another entity, which is not read");
        }
        let (curves, properties) = match self.geometry(at, 0) {
            Ok((Geometry::Curves(curves), properties)) => (curves, properties),
            Ok(_) => return,
            Err(reason) => return self.note(Severity::Skipped, at, reason),
        };
        let map = self.placement(at, None);
        let name = self.name_of(at, &properties);
        let count = curves.len();
        for (part, curve) in curves.into_iter().enumerate() {
            let moved = map.map_or_else(|| curve.clone(), |map| curve.transformed(&map));
            if let Err(reason) = sound(moved.points()) {
                self.note(Severity::Skipped, at, reason);
                continue;
            }
            self.add(Shape::Curve(Arc::new(moved)), at, at, name.as_deref(), (part, count));
        }
    }

    /// Adds an entity of the model, which shows like `owner` (the face, where there is one).
    fn add(&mut self, shape: Shape, owner: usize, at: usize, name: Option<&str>, (part, parts): (usize, usize)) {
        let (kind, count) = match shape {
            Shape::Curve(_) => ("Curve", &mut self.counts[1]),
            _ => ("Surface", &mut self.counts[0]),
        };
        let mut name = name.map_or_else(|| format!("{kind} {count}"), |n| n.chars().take(LONGEST_NAME).collect());
        *count += 1;
        if parts > 1 {
            name = format!("{name} part {}", part + 1);
        }
        let mut group = self.groups.path(owner);
        if group.is_empty() {
            group = self.groups.path(at);
        }
        let name = format!("{group}{name}");
        let color = self.color_of(owner).or_else(|| self.color_of(at));
        let visible = !self.directory.entries[owner].blanked;
        let id = EntityId(self.entities.len() as u64);
        self.entities.push(Entity { id, name, shape, visible, color });
    }

    /// The name that a property gives, or else the label of the directory entry.
    fn name_of(&mut self, at: usize, properties: &[usize]) -> Option<String> {
        for &pointer in properties.iter().take(64) {
            let Some(property) = self.directory.find(pointer) else { continue };
            let entry = &self.directory.entries[property];
            if entry.kind == 406 && entry.form == 15 {
                let name = self.record(property, |_, params| {
                    params.next(); // the number of values, always 1
                    params.text()
                });
                if let Some(name) = name.ok().filter(|name| !name.is_empty()) {
                    return Some(name);
                }
            }
        }
        let label = &self.directory.entries[at].label;
        (!label.is_empty()).then(|| label.clone())
    }

    /// The colour of an entity, linear RGB.
    fn color_of(&mut self, at: usize) -> Option<[f32; 3]> {
        let color = self.directory.entries[at].color;
        if color >= 0 {
            return kinds::standard_color(color);
        }
        let pointer = usize::try_from(color.unsigned_abs()).ok()?;
        if let Some(known) = self.colors.get(&pointer) {
            return *known;
        }
        let definition = self.directory.find(pointer).filter(|&at| self.directory.entries[at].kind == 314);
        let read = definition.and_then(|at| {
            let percent = self.record(at, |_, params| -> Result<[f64; 3], params::ParamError> {
                Ok([params.real("red")?, params.real("green")?, params.real("blue")?])
            });
            percent.ok()?.ok().filter(|p| p.iter().all(|v| v.is_finite()))
        });
        let color = read.map(|percent| percent.map(crate::io::color::linear_of_percent));
        if color.is_none() {
            self.note(Severity::Warning, at, format!("its colour (entity {pointer}) cannot be read"));
        }
        self.colors.insert(pointer, color);
        color
    }
}

/// Whether moved control points are finite and more than one point.
fn sound(points: &[DVec3]) -> Result<(), String> {
    if points.iter().any(|p| !p.is_finite()) {
        return Err("its transform moves it to infinity".into());
    }
    match points.first() {
        Some(first) if points.iter().any(|p| p != first) => Ok(()),
        _ => Err("it is a single point".into()),
    }
}
