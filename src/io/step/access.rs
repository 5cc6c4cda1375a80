//! Typed access to instances: every failure says which instance, what was expected and what is there.

use glam::DVec3;

use super::part21::{Exchange, Instance, Record, Value};

/// Looks into the instances of a file.
#[derive(Clone, Copy)]
pub struct Access<'f, 'a> {
    exchange: &'f Exchange<'a>,
    /// Radians in the unit of angles.
    angle: f64,
}

/// A message for the import report.
pub type Problem = String;

impl<'f, 'a> Access<'f, 'a> {
    /// Access to a file.
    pub fn new(exchange: &'f Exchange<'a>) -> Self {
        Self { exchange, angle: 1.0 }
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
            out[k] = real_of(value).ok_or_else(|| format!("#{number}: coordinate {k} is {value:?}"))?;
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

fn missing(record: &Record<'_>, at: usize, expected: &str) -> Problem {
    match record.values.get(at) {
        Some(value) => {
            let shown: String = format!("{value:?}").chars().take(60).collect();
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
