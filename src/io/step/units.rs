//! Units: the length unit of the document, and what each representation context counts in.
//!
//! What contradicts itself has one answer and a line in the report: of several length units of a context the first counts; of
//! a unit whose name says one thing and its conversion another the conversion counts; lengths without a unit are those
//! of the document, whose unit is that of the first context with one.

use std::collections::HashMap;

use super::access::{self, Access, reference, references};
use super::part21::{Exchange, Value};
use crate::io::report::{ImportReport, Severity};
use crate::model::document::Unit;

/// What a representation context counts in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContextUnits {
    /// Lengths of the document in one of the context.
    pub length: f64,
    /// Radians in one angle of the context.
    pub angle: f64,
}

impl Default for ContextUnits {
    fn default() -> Self {
        Self { length: 1.0, angle: 1.0 }
    }
}

/// Radians in an angle unit; `None` for units of other things.
fn radians(file: Access<'_, '_>, number: u64) -> Option<f64> {
    let instance = file.instance(number).ok()?;
    instance.record("PLANE_ANGLE_UNIT")?;
    let Some(conversion) = instance.record("CONVERSION_BASED_UNIT") else { return Some(1.0) };
    let measure = file.instance(reference(conversion, 1).ok()?).ok()?;
    let record = measure.records.iter().find(|r| r.values.len() >= 2)?;
    access::real(record, 0).ok().filter(|v| *v > 0.0)
}

/// The unit of the document (that of the first context with one) and the factor of every context to it.
pub fn units(
    exchange: &Exchange<'_>,
    file: Access<'_, '_>,
    report: &mut ImportReport,
) -> (Unit, HashMap<u64, ContextUnits>) {
    let mut metres: Vec<(u64, f64)> = Vec::new();
    let mut angles: HashMap<u64, f64> = HashMap::new();
    for &number in &exchange.order {
        let Some(record) = exchange.instances.get(&number).and_then(|i| i.record("GLOBAL_UNIT_ASSIGNED_CONTEXT"))
        else {
            continue;
        };
        let all = references(record, 0).unwrap_or_default();
        if let Some(angle) = all.iter().find_map(|&n| radians(file, n)) {
            angles.insert(number, angle);
        }
        let mut warn = |reason: String| {
            report.add(Severity::Warning, "STEP unit", Some(number as usize), None, reason);
        };
        let lengths: Vec<Length> = all.into_iter().filter_map(|n| length(file, n, 0)).collect();
        let Some(first) = lengths.first() else {
            warn("no length unit that can be read; lengths are kept as they are".to_owned());
            continue;
        };
        if let Some(other) = lengths.iter().find(|l| (l.metres / first.metres - 1.0).abs() > SAME) {
            warn(format!(
                "it has length units of {} m and of {} m; the first counts: expected one",
                first.metres, other.metres
            ));
        }
        if let Some((name, metres)) = &first.named {
            warn(format!(
                "its length unit is named {name}, which is {metres} m, and converted as {} m; the conversion counts",
                first.metres
            ));
        }
        metres.push((number, first.metres));
    }
    if metres.is_empty() && !report.lines.iter().any(|l| l.entity == "STEP unit") {
        report.add(Severity::Warning, "STEP unit", None, None, "the file names no length unit; lengths have none");
    }
    let Some(&(_, first)) = metres.first() else {
        let of = |(context, angle)| (context, ContextUnits { angle, ..ContextUnits::default() });
        return (Unit::Unknown, angles.into_iter().map(of).collect());
    };
    let known = [
        (Unit::Millimetre, 1e-3),
        (Unit::Metre, 1.0),
        (Unit::Inch, 0.0254),
        (Unit::Foot, 0.3048),
        (Unit::Centimetre, 1e-2),
        (Unit::Kilometre, 1e3),
        (Unit::Micrometre, 1e-6),
        (Unit::Mile, 1609.344),
        (Unit::Mil, 2.54e-5),
        (Unit::Microinch, 2.54e-8),
    ];
    let (unit, size) =
        known.into_iter().find(|(_, m)| (m / first - 1.0).abs() < 1e-9).unwrap_or((Unit::Millimetre, 1e-3));
    let factor = |m: f64| if (m / size - 1.0).abs() < 1e-9 { 1.0 } else { m / size };
    if metres.iter().any(|&(_, m)| factor(m) != 1.0) {
        let reason =
            format!("the file uses several units or an uncommon one; all lengths were converted to {}", unit.symbol());
        report.add(Severity::Info, "STEP unit", None, None, reason);
    }
    let of = |(context, m)| {
        let angle = angles.get(&context).copied().unwrap_or(1.0);
        (context, ContextUnits { length: factor(m), angle })
    };
    (unit, metres.into_iter().map(of).collect())
}

/// How near two sizes of a unit are the same.
const SAME: f64 = 1e-6;

/// A length unit.
struct Length {
    metres: f64,
    /// The name and the metres that it stands for, where they are not those of the unit.
    named: Option<(String, f64)>,
}

/// A length unit; `None` for units of other things.
fn length(file: Access<'_, '_>, number: u64, depth: usize) -> Option<Length> {
    let instance = file.instance(number).ok()?;
    instance.record("LENGTH_UNIT")?;
    if let Some(si) = instance.record("SI_UNIT") {
        let values = &si.values;
        if !matches!(values.last(), Some(Value::Enum("METRE"))) {
            return None;
        }
        let exponent = match values.iter().rev().nth(1) {
            Some(Value::Enum(name)) => prefix(name)?,
            _ => 0,
        };
        return Some(Length { metres: 10f64.powi(exponent), named: None });
    }
    let conversion = instance.record("CONVERSION_BASED_UNIT")?;
    let measure = file.instance(reference(conversion, 1).ok()?).ok()?;
    let record = measure.records.iter().find(|r| r.values.len() >= 2)?;
    let value = access::real(record, 0).ok()?;
    let base = if depth < 4 { length(file, reference(record, 1).ok()?, depth + 1)?.metres } else { return None };
    let metres = Some(value * base).filter(|m| *m > 0.0 && m.is_finite())?;
    let name = match conversion.values.first() {
        Some(Value::String(name)) => name.trim().to_ascii_uppercase(),
        _ => String::new(),
    };
    let expected = match name.as_str() {
        "INCH" | "INCHES" | "IN" => Some(0.0254),
        "FOOT" | "FEET" | "FT" => Some(0.3048),
        "YARD" => Some(0.9144),
        "MILE" => Some(1609.344),
        "MIL" | "THOU" => Some(2.54e-5),
        "MICROINCH" => Some(2.54e-8),
        "MILLIMETRE" | "MILLIMETER" | "MM" => Some(1e-3),
        "CENTIMETRE" | "CENTIMETER" | "CM" => Some(1e-2),
        "METRE" | "METER" | "M" => Some(1.0),
        _ => None,
    };
    // A survey foot is 2e-6 longer than a foot and no contradiction.
    let named = expected.filter(|e| (metres / e - 1.0).abs() > 1e-5).map(|e| (name, e));
    Some(Length { metres, named })
}

/// The power of ten of an SI prefix.
fn prefix(name: &str) -> Option<i32> {
    Some(match name {
        "EXA" => 18,
        "PETA" => 15,
        "TERA" => 12,
        "GIGA" => 9,
        "MEGA" => 6,
        "KILO" => 3,
        "HECTO" => 2,
        "DECA" => 1,
        "DECI" => -1,
        "CENTI" => -2,
        "MILLI" => -3,
        "MICRO" => -6,
        "NANO" => -9,
        "PICO" => -12,
        "FEMTO" => -15,
        "ATTO" => -18,
        _ => return None,
    })
}
