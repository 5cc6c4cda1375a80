//! Units: the length unit of the document, and what each representation context counts in.

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
        let unit = all.into_iter().find_map(|n| length_in_metres(file, n, 0));
        match unit {
            Some(metre) => metres.push((number, metre)),
            None => report.add(
                Severity::Warning,
                "STEP unit",
                Some(number as usize),
                None,
                "no length unit that can be read; lengths are kept as they are",
            ),
        }
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

/// How many metres a length unit has; `None` for units of other things.
fn length_in_metres(file: Access<'_, '_>, number: u64, depth: usize) -> Option<f64> {
    let instance = file.instance(number).ok()?;
    instance.record("LENGTH_UNIT")?;
    if let Some(si) = instance.record("SI_UNIT") {
        let prefix = match si.values.iter().rev().nth(1) {
            Some(Value::Enum(name)) => match *name {
                "MILLI" => 1e-3,
                "CENTI" => 1e-2,
                "DECI" => 1e-1,
                "KILO" => 1e3,
                "MICRO" => 1e-6,
                "NANO" => 1e-9,
                _ => return None,
            },
            _ => 1.0,
        };
        return Some(prefix);
    }
    let conversion = instance.record("CONVERSION_BASED_UNIT")?;
    let measure = file.instance(reference(conversion, 1).ok()?).ok()?;
    let record = measure.records.iter().find(|r| r.values.len() >= 2)?;
    let value = access::real(record, 0).ok()?;
    let base = if depth < 4 { length_in_metres(file, reference(record, 1).ok()?, depth + 1)? } else { return None };
    Some(value * base).filter(|m| *m > 0.0 && m.is_finite())
}
