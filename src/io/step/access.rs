//! Typed access to instances: every failure says which instance, what was expected and what is there.

use std::cell::Cell;

use glam::DVec3;

use super::part21::{Exchange, Instance, Record, Value};

/// How often the bytes of a file may be read over again for assemblies, curves of curves and surfaces of many faces:
/// without a limit a small file could unfold without end.
const UNFOLDING: usize = 64;
/// What a file may unfold to however small it is, in bytes.
const LEAST: usize = 1_000_000;
/// What a value of a statement counts for, in bytes.
const VALUE: usize = 64;

/// How much may still be unfolded.
#[derive(Debug)]
pub struct Budget(Cell<usize>);

impl Budget {
    /// That of a file of so many bytes.
    pub fn of(bytes: usize) -> Self {
        Self(Cell::new(UNFOLDING.saturating_mul(bytes).max(LEAST)))
    }
}

/// Looks into the instances of a file.
#[derive(Clone, Copy)]
pub struct Access<'f, 'a> {
    exchange: &'f Exchange<'a>,
    budget: &'f Budget,
    /// Radians in the unit of angles.
    angle: f64,
}

/// A message for the import report.
pub type Problem = String;

impl<'f, 'a> Access<'f, 'a> {
    /// Access to a file.
    pub fn new(exchange: &'f Exchange<'a>, budget: &'f Budget) -> Self {
        Self { exchange, budget, angle: 1.0 }
    }

    /// Takes the values of an instance from what may still be unfolded.
    pub fn unfold(&self, instance: &Instance<'_>) -> Result<(), Problem> {
        let values: usize = instance.records.iter().flat_map(|r| &r.values).map(size).sum();
        self.spend(1 + values)
    }

    /// Takes so many values from what may still be unfolded.
    pub fn spend(&self, values: usize) -> Result<(), Problem> {
        let left = self.budget.0.get().checked_sub(VALUE * values);
        self.budget.0.set(left.unwrap_or(0));
        left.map(|_| ()).ok_or_else(|| TOO_OFTEN.to_owned())
    }

    /// Whether nothing more may be unfolded.
    pub fn is_spent(&self) -> bool {
        self.budget.0.get() < VALUE
    }

    /// The same with another unit of angles.
    #[must_use]
    pub fn with_angle(self, radians: f64) -> Self {
        Self { angle: radians, ..self }
    }

    /// Radians in the unit of angles of the representation that is read.
    pub fn angle(&self) -> f64 {
        self.angle
    }

    /// An instance by number.
    pub fn instance(&self, number: u64) -> Result<&'f Instance<'a>, Problem> {
        self.exchange.instances.get(&number).ok_or_else(|| format!("#{number} is not in the file"))
    }

    /// The record that makes an instance what it is: its only one, or that of a complex instance whose name is
    /// among `names`.
    pub fn record(&self, number: u64, names: &[&str]) -> Result<&'f Record<'a>, Problem> {
        let instance = self.instance(number)?;
        names
            .iter()
            .find_map(|n| instance.record(n))
            .ok_or_else(|| format!("#{number} is {}, expected {}", instance.type_name(), names.join(" or ")))
    }

    /// Three coordinates of a point or direction; missing ones are 0.
    pub fn triple(&self, number: u64, name: &str) -> Result<DVec3, Problem> {
        let record = self.record(number, &[name])?;
        let values = list(record, 1)?;
        let mut out = DVec3::ZERO;
        for (k, value) in values.iter().take(3).enumerate() {
            out[k] = real_of(value).ok_or_else(|| format!("#{number}: coordinate {k} is {}", shown(value)))?;
        }
        if out.is_finite() { Ok(out) } else { Err(format!("#{number}: {out} is not finite")) }
    }

    /// A CARTESIAN_POINT.
    pub fn point(&self, number: u64) -> Result<DVec3, Problem> {
        self.triple(number, "CARTESIAN_POINT")
    }

    /// A DIRECTION, made a unit vector.
    pub fn direction(&self, number: u64) -> Result<DVec3, Problem> {
        self.triple(number, "DIRECTION")?.try_normalize().ok_or_else(|| format!("#{number}: a direction of length 0"))
    }
}

/// What is said where a file has unfolded too far.
pub const TOO_OFTEN: &str = "the statements of this file refer to each other too often; what is left is not opened";

/// How many values a value consists of.
fn size(value: &Value<'_>) -> usize {
    match value {
        Value::List(values) | Value::Typed(_, values) => 1 + values.iter().map(size).sum::<usize>(),
        _ => 1,
    }
}

/// A value for a message. Lists may be as long as the file, so only their length is shown.
fn shown(value: &Value<'_>) -> String {
    match value {
        Value::List(values) => format!("a list of {}", values.len()),
        Value::Typed(name, values) => format!("{name} of {} values", values.len()),
        Value::String(text) | Value::Enum(text) | Value::Binary(text) => text.chars().take(60).collect(),
        other => format!("{other:?}"),
    }
}

fn missing(record: &Record<'_>, at: usize, expected: &str) -> Problem {
    match record.values.get(at) {
        Some(value) => {
            let shown = shown(value);
            format!("{}: value {} is {shown}, expected {expected}", record.name, at + 1)
        }
        None => format!("{}: {} values, expected {expected} as number {}", record.name, record.values.len(), at + 1),
    }
}

/// A value as a number, whole or real, bare or typed.
pub fn real_of(value: &Value<'_>) -> Option<f64> {
    match value {
        Value::Real(r) => Some(*r),
        Value::Integer(i) => Some(*i as f64),
        Value::Typed(_, inner) if inner.len() == 1 => real_of(&inner[0]),
        _ => None,
    }
}

/// A value as a reference.
pub fn reference_of(value: &Value<'_>) -> Option<u64> {
    if let Value::Reference(number) = value { Some(*number) } else { None }
}

/// The reference at a place of a record.
pub fn reference(record: &Record<'_>, at: usize) -> Result<u64, Problem> {
    record.values.get(at).and_then(reference_of).ok_or_else(|| missing(record, at, "a reference"))
}

/// The reference at a place of a record, `None` where it is left out.
pub fn optional_reference(record: &Record<'_>, at: usize) -> Option<u64> {
    record.values.get(at).and_then(reference_of)
}

/// The number at a place of a record.
pub fn real(record: &Record<'_>, at: usize) -> Result<f64, Problem> {
    record.values.get(at).and_then(real_of).filter(|r| r.is_finite()).ok_or_else(|| missing(record, at, "a number"))
}

/// The list at a place of a record.
pub fn list<'f, 'a>(record: &'f Record<'a>, at: usize) -> Result<&'f [Value<'a>], Problem> {
    match record.values.get(at) {
        Some(Value::List(values)) => Ok(values),
        _ => Err(missing(record, at, "a list")),
    }
}

/// The references of the list at a place of a record.
pub fn references(record: &Record<'_>, at: usize) -> Result<Vec<u64>, Problem> {
    let all: Option<Vec<u64>> = list(record, at)?.iter().map(reference_of).collect();
    all.ok_or_else(|| missing(record, at, "a list of references"))
}

/// The numbers of the list at a place of a record.
pub fn reals(record: &Record<'_>, at: usize) -> Result<Vec<f64>, Problem> {
    let all: Option<Vec<f64>> = list(record, at)?.iter().map(real_of).collect();
    all.ok_or_else(|| missing(record, at, "a list of numbers"))
}

/// The whole number at a place of a record.
pub fn count(record: &Record<'_>, at: usize) -> Result<usize, Problem> {
    match record.values.get(at) {
        Some(Value::Integer(i)) => usize::try_from(*i).map_err(|_| missing(record, at, "a count")),
        _ => Err(missing(record, at, "a count")),
    }
}

/// Whether the logical value at a place of a record is true.
pub fn is_true(record: &Record<'_>, at: usize) -> bool {
    matches!(record.values.get(at), Some(Value::Enum("T" | "TRUE")))
}
