//! The global section: delimiters, unit, scale, resolution.

use super::params::{Delimiters, Params, Value, number};
use super::sections::Line;
use crate::io::{ImportReport, Severity};
use crate::model::document::Unit;

/// What the reader needs of the global section.
#[derive(Clone, Debug)]
pub(super) struct Header {
    pub delimiters: Delimiters,
    pub unit: Unit,
    /// Model space over real world (0.125: 1 unit of the file is 8 units of the real thing).
    pub scale: f64,
    /// The smallest distance that the writer told apart, 0 when not given.
    pub resolution: f64,
}

impl Header {
    pub fn of(lines: &[Line<'_>], report: &mut ImportReport) -> Self {
        let first = lines.first().map(|l| l.number);
        let mut warn = |reason: String| report.add(Severity::Warning, "header", None, first, reason);
        let mut bytes = Vec::with_capacity(72 * lines.len());
        for line in lines {
            let text = line.columns(0, 72);
            bytes.extend_from_slice(text);
            bytes.resize(bytes.len() + 72 - text.len(), b' ');
        }
        let delimiters = delimiters(&bytes);
        let mut header = Self { delimiters, unit: Unit::Unknown, scale: 1.0, resolution: 0.0 };
        if lines.is_empty() {
            warn("there is no global section; the unit is unknown".into());
            return header;
        }
        let mut params = Params::new(&bytes, delimiters);
        // A delimiter that names itself (1H,,) is a string of one character like any other.
        let values: Vec<Value<'_>> = (0..26).map(|_| params.next()).collect();
        let real = |at: usize| match values[at] {
            Value::Plain(text) => number(text),
            _ => None,
        };
        match real(12).unwrap_or(1.0) {
            scale if scale > 0.0 && scale.is_finite() => header.scale = scale,
            scale => warn(format!("the scale is {scale}, which is no scale; 1 was taken")),
        }
        if header.scale != 1.0 {
            warn(format!("the scale is {}; all lengths were divided by it", header.scale));
        }
        let name = match values[14] {
            Value::Text(text) | Value::Plain(text) => String::from_utf8_lossy(text).trim().to_ascii_uppercase(),
            Value::Empty => String::new(),
        };
        let named = unit_of_name(&name);
        header.unit = match real(13) {
            Some(3.0) => named,
            Some(flag) => unit_of_flag(flag),
            None => named,
        };
        if header.unit == Unit::Unknown {
            warn(format!("the unit is unknown (flag {:?}, name `{name}`)", real(13)));
        } else if named != Unit::Unknown && named != header.unit {
            warn(format!("the unit flag says {}, the unit name `{name}`; the flag holds", header.unit.symbol()));
        }
        header.resolution = real(18).filter(|r| *r > 0.0 && r.is_finite()).unwrap_or(0.0);
        header
    }
}

/// The first two values name the delimiters, and are themselves delimited by the first of them.
fn delimiters(bytes: &[u8]) -> Delimiters {
    let mut found = Delimiters::default();
    let bytes = bytes.trim_ascii_start();
    let rest = match bytes {
        [b'1', b'H' | b'h', value, rest @ ..] => {
            found.value = *value;
            rest
        }
        _ => bytes,
    };
    if let [delimiter, b'1', b'H' | b'h', record, ..] = rest
        && *delimiter == found.value
    {
        found.record = *record;
    }
    if found.value == found.record || found.value.is_ascii_alphanumeric() || found.record.is_ascii_alphanumeric() {
        return Delimiters::default();
    }
    found
}

const UNITS: [(Unit, &[&str]); 10] = [
    (Unit::Inch, &["IN", "INCH", "INCHES"]),
    (Unit::Millimetre, &["MM", "MILLIMETER", "MILLIMETERS", "MILLIMETRE"]),
    (Unit::Foot, &["FT", "FOOT", "FEET"]),
    (Unit::Mile, &["MI", "MILE"]),
    (Unit::Metre, &["M", "METER", "METERS", "METRE"]),
    (Unit::Kilometre, &["KM"]),
    (Unit::Mil, &["MIL"]),
    (Unit::Micrometre, &["UM", "MICRON"]),
    (Unit::Centimetre, &["CM", "CENTIMETER"]),
    (Unit::Microinch, &["UIN"]),
];

fn unit_of_name(name: &str) -> Unit {
    UNITS.iter().find(|(_, names)| names.contains(&name)).map_or(Unit::Unknown, |(unit, _)| *unit)
}

fn unit_of_flag(flag: f64) -> Unit {
    (1..=11).find(|&f| f64::from(f) == flag).map_or(Unit::Unknown, |f| match flag_table(f) {
        Some((unit, _)) => unit,
        None => Unit::Unknown,
    })
}

/// Unit flags 1 to 11 with their names; 3 means "see the name".
fn flag_table(flag: i32) -> Option<(Unit, &'static str)> {
    let at = match flag {
        1 | 2 => flag - 1,
        4..=11 => flag - 2,
        _ => return None,
    };
    UNITS.get(usize::try_from(at).ok()?).map(|(unit, names)| (*unit, names[0]))
}

/// The flag and the name of a unit, as the writer needs them. A unit that is unknown is written by name.
pub(super) fn flag_and_name(unit: Unit) -> (i32, &'static str) {
    (1..=11)
        .find_map(|flag| flag_table(flag).filter(|(u, _)| *u == unit).map(|(_, name)| (flag, name)))
        .unwrap_or((3, "UNKNOWN"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn header(text: &str) -> (Header, ImportReport) {
        let mut report = ImportReport::default();
        let lines: Vec<Line<'_>> =
            text.as_bytes().chunks(72).enumerate().map(|(i, text)| Line { text, number: i + 1 }).collect();
        (Header::of(&lines, &mut report), report)
    }

    #[test]
    fn units_scale_and_resolution_are_read() {
        let (h, report) = header("1H,,1H;,1Ha,1Hb,1Hc,1Hd,32,308,15,308,15,1Hp,1.,1,2HIN,4,.01,1Hd,1D-5,9.;");
        assert_eq!((h.unit, h.scale, h.resolution), (Unit::Inch, 1.0, 1e-5));
        assert!(report.lines.is_empty());
        let (h, report) = header(",,1Ha,1Hb,1Hc,1Hd,32,308,15,308,15,1Hp,0.5,6,2HMM,4,.01,1Hd,1D-5,9.;");
        assert_eq!((h.unit, h.scale), (Unit::Metre, 0.5));
        assert_eq!(report.lines.len(), 2, "scale and contradiction: {:?}", report.lines);
        let (h, _) = header(",,,,,,,,,,,,1.,3,2HUM;");
        assert_eq!(h.unit, Unit::Micrometre);
    }

    #[test]
    fn other_delimiters_are_taken_up() {
        let (h, _) = header("1H//1H#/1Ha/1Hb/1Hc/1Hd/32/308/15/308/15/1Hp/1./4/2HFT/4/.01/1Hd/1D-5/9.#");
        assert_eq!(h.delimiters, Delimiters { value: b'/', record: b'#' });
        assert_eq!(h.unit, Unit::Foot);
    }

    #[test]
    fn flags_and_names_agree_with_each_other() {
        for flag in [1, 2, 4, 5, 6, 7, 8, 9, 10, 11] {
            let unit = unit_of_flag(f64::from(flag));
            assert_eq!(flag_and_name(unit).0, flag);
            assert_eq!(unit_of_name(flag_and_name(unit).1), unit);
        }
        assert_eq!(unit_of_flag(3.0), Unit::Unknown);
    }
}
