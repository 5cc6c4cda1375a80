//! Writing IGES 5.3: surfaces as 128, trimmed faces as 144 with their curves in the parameter plane and in space, curves as
//! 126, curves on surfaces as 142, names as property 406 form 15, colours as 314.
//!
//! Numbers are written with the fewest digits that give the same double back (17 at most), so that reading is
//! bit for bit. For other readers: knots are clamped (exactly refined where the document's are not), weights are
//! all 1 and PROP3 is set for polynomial geometry, no value crosses a line, strings are ASCII.

use std::collections::HashMap;
use std::fmt::Write as _;
use std::time::SystemTime;

use glam::DVec3;

use super::header;
use crate::io::Saved;
use crate::io::number::real;
use crate::io::stamp::civil;
use crate::kernel::geom::trim::{EdgeRole, Face};
use crate::kernel::geom::{Aabb, Curve, Knots, Surface};
use crate::kernel::tol::Tolerances;
use crate::model::document::{Document, EntityId, Shape};
use crate::model::traces::SurfaceTrace;

/// Why a document cannot be written as IGES.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum IgesWriteError {
    /// IGES numbers its lines with seven digits.
    #[error("it needs {lines} lines, IGES can number {limit}; save it in several files")]
    TooLong {
        /// The lines needed.
        lines: usize,
        /// The most that can be numbered.
        limit: usize,
    },
}

const MOST_LINES: usize = 9_999_999;

/// How a file is written.
#[derive(Clone, Debug)]
pub struct IgesOptions {
    /// The file name that the header states.
    pub file_name: String,
    /// The time that the header states.
    pub time: SystemTime,
}

/// The text of a document.
pub fn write(document: &Document, options: &IgesOptions) -> Result<(String, Saved), IgesWriteError> {
    write_with_traces(document, &[], options)
}

/// The text of a document and of curves on its surfaces. Traces whose surface is not there are noted and left out.
pub fn write_with_traces(
    document: &Document,
    traces: &[SurfaceTrace],
    options: &IgesOptions,
) -> Result<(String, Saved), IgesWriteError> {
    let mut writer = Writer::default();
    let mut places: HashMap<EntityId, usize> = HashMap::new();
    let mut saved = Saved::default();
    let mut colors: HashMap<[u32; 3], usize> = HashMap::new();
    let left_out = document.meshes().count();
    if left_out > 0 {
        let note =
            "meshes and blocks were left out: this format holds surfaces and curves; save those as STL, OBJ or Plot3D";
        saved.notes.push(format!("{left_out} {note}"));
    }
    for entity in document.entities().iter().filter(|e| e.facets().is_none()) {
        let color = entity.color.map_or(0, |color| {
            *colors.entry(color.map(f32::to_bits)).or_insert_with(|| {
                let mut record = Record::new(314);
                color.iter().for_each(|&c| record.real(crate::io::color::percent_of_linear(c)));
                writer.add(&record, &Attributes { status: "00000200", ..Attributes::default() })
            })
        });
        let name = ascii(&entity.name);
        if name != entity.name {
            saved.notes.push(format!("the name `{}` was written as `{name}`: IGES is ASCII", entity.name));
        }
        let property = (!name.is_empty()).then(|| {
            let mut record = Record::new(406);
            record.integer(1);
            record.text(&name);
            writer.add(&record, &Attributes { status: "00010201", form: 15, ..Attributes::default() })
        });
        let mut record = match &entity.shape {
            Shape::Surface(surface) => surface_record(surface),
            Shape::Patch(patch) => surface_record(&patch.surface),
            Shape::Curve(curve) => curve_record(curve),
            Shape::Mesh(_) | Shape::Block(_) => continue,
            Shape::Face(face) => {
                let (record, surface) = writer.face(face);
                places.insert(entity.id, surface);
                record
            }
        };
        if let Some(property) = property {
            record.integer(0);
            record.integer(1);
            record.integer(property);
        }
        let status = if entity.visible { "00000000" } else { "01000000" };
        let number = writer.add(&record, &Attributes { status, color, form: 0 });
        // Curves lie on the surface under a face.
        places.entry(entity.id).or_insert(number);
        saved.entities += 1;
    }
    for trace in traces {
        let Some(&surface) = places.get(&trace.surface) else {
            saved.notes.push("a curve on a surface that is not in the document was left out".to_owned());
            continue;
        };
        // Parts of the curve on the surface; the first is a curve in two parameters.
        let part = |status| Attributes { status, ..Attributes::default() };
        let in_surface = writer.add(&curve_record(&trace.in_surface), &part("00010500"));
        let space = writer.add(&curve_record(&trace.space), &part("00010000"));
        let mut record = Record::new(142);
        // Made by intersection; both representations are equally good.
        [2, surface, in_surface, space, 3].iter().for_each(|&v| record.integer(v));
        writer.add(&record, &Attributes::default());
        saved.entities += 1;
    }
    let text = writer.finish(document, options)?;
    Ok((text, saved))
}

fn ascii(name: &str) -> String {
    name.chars().map(|c| if c.is_ascii() && !c.is_ascii_control() { c } else { '?' }).collect()
}

fn surface_record(surface: &Surface) -> Record {
    let clamped = surface.knots().iter().all(Knots::is_clamped);
    let [u, v] = surface.domain();
    // A restriction to the whole domain clamps the knots; it cannot fail, and if it did the knots would be kept.
    let refined = if clamped { None } else { surface.restricted(u, v).ok() };
    let surface = refined.as_ref().unwrap_or(surface);
    let [nu, nv] = surface.counts();
    let mut record = Record::new(128);
    for value in [nu - 1, nv - 1, surface.knots()[0].degree(), surface.knots()[1].degree()] {
        record.integer(value);
    }
    let closed_u = (0..nv).all(|j| surface.point(0, j) == surface.point(nu - 1, j));
    let closed_v = (0..nu).all(|i| surface.point(i, 0) == surface.point(i, nv - 1));
    for flag in [closed_u, closed_v, surface.weights().is_none(), false, false] {
        record.integer(flag.into());
    }
    for knots in surface.knots() {
        knots.values().iter().for_each(|&k| record.real(k));
    }
    record.weights_and_points(surface.weights(), surface.points());
    surface.domain().as_flattened().iter().for_each(|&t| record.real(t));
    record
}

fn curve_record(curve: &Curve) -> Record {
    let [start, end] = curve.domain();
    let refined = if curve.knots().is_clamped() { None } else { curve.restricted(start, end).ok() };
    let curve = refined.as_ref().unwrap_or(curve);
    let points = curve.points();
    let mut record = Record::new(126);
    record.integer(points.len() - 1);
    record.integer(curve.knots().degree());
    // Not claimed to be planar; a reader that cares finds out.
    for flag in [false, points.first() == points.last(), curve.weights().is_none(), false] {
        record.integer(flag.into());
    }
    curve.knots().values().iter().for_each(|&k| record.real(k));
    record.weights_and_points(curve.weights(), points);
    curve.domain().iter().for_each(|&t| record.real(t));
    (0..3).for_each(|_| record.real(0.0));
    record
}

/// Free-format values, broken into lines of a given width.
struct Record {
    kind: usize,
    width: usize,
    lines: Vec<String>,
    line: String,
}

impl Record {
    fn new(kind: usize) -> Self {
        let mut record = Self { kind, width: 64, lines: Vec::new(), line: String::new() };
        record.integer(kind);
        record
    }

    fn integer(&mut self, value: usize) {
        self.value(&value.to_string());
    }

    fn real(&mut self, value: f64) {
        self.value(&real(value));
    }

    /// A value that stays on one line.
    fn value(&mut self, text: &str) {
        if self.line.len() + text.len() + 1 > self.width {
            self.lines.push(std::mem::take(&mut self.line));
        }
        self.line.push_str(text);
        self.line.push(',');
    }

    /// A string, which may run over lines.
    fn text(&mut self, text: &str) {
        if text.is_empty() {
            return self.value(""); // 0H is no string for IGES; left out is
        }
        let length = text.len().to_string();
        if self.line.len() + length.len() + 2 > self.width {
            self.lines.push(std::mem::take(&mut self.line));
        }
        self.line.push_str(&length);
        for c in std::iter::once('H').chain(text.chars()).chain(std::iter::once(',')) {
            if self.line.len() == self.width {
                self.lines.push(std::mem::take(&mut self.line));
            }
            self.line.push(c);
        }
    }

    fn weights_and_points(&mut self, weights: Option<&[f64]>, points: &[DVec3]) {
        (0..points.len()).for_each(|i| self.real(weights.map_or(1.0, |w| w[i])));
        points.iter().flat_map(DVec3::to_array).for_each(|c| self.real(c));
    }

    /// The lines, the last value closed by the record delimiter.
    fn closed(&self) -> Vec<String> {
        let mut lines = self.lines.clone();
        let mut last = self.line.clone();
        if last.is_empty() {
            last = lines.pop().unwrap_or_default();
        }
        last.pop();
        last.push(';');
        lines.push(last);
        lines
    }
}

/// What a directory entry says beside the type.
struct Attributes {
    status: &'static str,
    /// The entry of a colour definition, 0 for none.
    color: usize,
    form: usize,
}

impl Default for Attributes {
    fn default() -> Self {
        Self { status: "00000000", color: 0, form: 0 }
    }
}

#[derive(Default)]
struct Writer {
    directory: String,
    directory_lines: usize,
    parameter: String,
    parameter_lines: usize,
}

impl Writer {
    /// The trimmed surface (144) of a face and the entry of the surface under it; what it consists of is added before it.
    fn face(&mut self, face: &Face) -> (Record, usize) {
        let dependent = |status| Attributes { status, ..Attributes::default() };
        let surface = self.add(&surface_record(face.surface()), &dependent("00010000"));
        let mut record = Record::new(144);
        record.integer(surface);
        record.integer(1);
        record.integer(face.rings().len() - 1);
        for ring in face.rings() {
            let (mut in_plane, mut in_space) = (Vec::new(), Vec::new());
            for edge in &ring.edges {
                let turned = |curve: &Curve| if edge.reversed { curve.reversed() } else { curve.clone() };
                in_plane.push(self.add(&curve_record(&turned(&edge.pcurve)), &dependent("00010500")));
                // A pole is a point in space and no curve there.
                if edge.role != EdgeRole::Pole {
                    in_space.push(self.add(&curve_record(&turned(&edge.curve)), &dependent("00010000")));
                }
            }
            let [plane, space] = [(in_plane, "00010500"), (in_space, "00010000")].map(|(parts, status)| {
                let mut composite = Record::new(102);
                composite.integer(parts.len());
                parts.iter().for_each(|&part| composite.integer(part));
                if parts.is_empty() { 0 } else { self.add(&composite, &dependent(status)) }
            });
            let mut bound = Record::new(142);
            // Made by no particular method; the curve in the parameter plane is preferred.
            [0, surface, plane, space, 1].iter().for_each(|&v| bound.integer(v));
            let bound = self.add(&bound, &dependent("00010000"));
            record.integer(bound);
        }
        (record, surface)
    }

    /// Adds an entity and says which directory entry it got.
    fn add(&mut self, record: &Record, attributes: &Attributes) -> usize {
        let lines = record.closed();
        let sequence = self.directory_lines + 1;
        let (kind, first, count) = (record.kind, self.parameter_lines + 1, lines.len());
        let (status, form) = (attributes.status, attributes.form);
        let color = if attributes.color == 0 { "0".to_owned() } else { format!("-{}", attributes.color) };
        // Writing to a string cannot fail.
        let _ = writeln!(self.directory, "{kind:8}{first:8}{0:8}{0:8}{0:8}{0:8}{0:8}{0:8}{status}D{sequence:7}", 0);
        let _ = writeln!(
            self.directory,
            "{kind:8}{0:8}{color:>8}{count:8}{form:8}{empty:8}{empty:8}{empty:8}{0:8}D{next:7}",
            0,
            empty = "",
            next = sequence + 1
        );
        self.directory_lines += 2;
        for line in lines {
            self.parameter_lines += 1;
            let _ = writeln!(self.parameter, "{line:64}{sequence:8}P{:7}", self.parameter_lines);
        }
        sequence
    }

    fn finish(self, document: &Document, options: &IgesOptions) -> Result<String, IgesWriteError> {
        let lines = self.directory_lines.max(self.parameter_lines);
        if lines > MOST_LINES {
            return Err(IgesWriteError::TooLong { lines, limit: MOST_LINES });
        }
        let global = global_section(document, options);
        let mut text = String::with_capacity(self.directory.len() + self.parameter.len() + 1000);
        let _ = writeln!(text, "{:72}S{:7}", "Written by Patchwright.", 1);
        for (i, line) in global.iter().enumerate() {
            let _ = writeln!(text, "{line:72}G{:7}", i + 1);
        }
        text.push_str(&self.directory);
        text.push_str(&self.parameter);
        let counts = format!("S{:7}G{:7}D{:7}P{:7}", 1, global.len(), self.directory_lines, self.parameter_lines);
        let _ = writeln!(text, "{counts:72}T{:7}", 1);
        Ok(text)
    }
}

fn global_section(document: &Document, options: &IgesOptions) -> Vec<String> {
    let mut record = Record { kind: 0, width: 72, lines: Vec::new(), line: String::new() };
    let (flag, unit) = header::flag_and_name(document.unit);
    // Of what is written: under a face that is the whole surface.
    let bounds = (document.entities().iter())
        .fold(Aabb::EMPTY, |all, e| all.union(&e.surface().map_or_else(|| e.bounds(), |s| s.bounds())));
    let date = date(options.time);
    let name = ascii(&options.file_name);
    record.text(",");
    record.text(";");
    record.text(&name);
    record.text(&name);
    record.text(concat!("Patchwright ", env!("CARGO_PKG_VERSION")));
    record.text(concat!("Patchwright ", env!("CARGO_PKG_VERSION")));
    [32, 38, 6, 308, 15].iter().for_each(|&v| record.integer(v));
    record.text(&name);
    record.real(1.0);
    record.value(&flag.to_string());
    record.text(unit);
    record.integer(1);
    record.real(0.0);
    record.text(&date);
    record.real(Tolerances::of(&bounds).follow);
    record.real(bounds.max_abs());
    record.text("");
    record.text("");
    record.integer(11);
    record.integer(0);
    record.text(&date);
    record.closed()
}

/// YYYYMMDD.HHNNSS of a time, in UTC.
fn date(time: SystemTime) -> String {
    let [year, month, day, hour, minute, second] = civil(time);
    format!("{year:04}{month:02}{day:02}.{hour:02}{minute:02}{second:02}")
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn numbers_read_back_as_themselves() {
        let mut values =
            vec![0.0, -0.0, 1.0, -2.5, 0.1, 1.0 / 3.0, 1e16, 1e17, 1e-7, f64::MIN_POSITIVE, f64::MAX, 5e-324];
        values.extend((0..2000u64).map(|i| f64::from_bits(i.wrapping_mul(0x9E37_79B9_7F4A_7C15))));
        for value in values.into_iter().filter(|v| v.is_finite()) {
            let text = real(value);
            let back = super::super::params::number(text.as_bytes()).unwrap();
            assert_eq!(back.to_bits(), value.to_bits(), "{text}");
            assert!(text.contains('.') && text.len() <= 24, "{text}");
        }
        assert_eq!((real(1.0), real(1e-7), real(1.5e300)), ("1.".into(), "1.E-7".into(), "1.5E300".into()));
    }

    #[test]
    fn dates_have_two_digits_for_each_part() {
        assert_eq!(date(SystemTime::UNIX_EPOCH + Duration::from_secs(951_782_400)), "20000229.000000");
    }

    #[test]
    fn strings_run_over_lines_and_values_do_not() {
        let mut record = Record::new(406);
        record.text(&"abcdefghi ".repeat(20));
        record.real(0.123_456_789_012_345_6);
        let lines = record.closed();
        assert!(lines.len() > 3 && lines.iter().all(|l| l.len() <= 64));
        assert!(lines[..3].iter().all(|l| l.len() == 64));
        let mut params = super::super::Params::new(b"", super::super::params::Delimiters::default());
        assert!(params.text().is_empty());
        let joined: String = lines.concat();
        let mut params = super::super::Params::new(joined.as_bytes(), super::super::params::Delimiters::default());
        assert_eq!(params.integer("type"), Ok(406));
        assert_eq!(params.text().len(), 199, "trimmed at the end");
        assert_eq!(params.real("x"), Ok(0.123_456_789_012_345_6));
    }
}
