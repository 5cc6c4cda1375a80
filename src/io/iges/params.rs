//! Free-format parameters: a cursor over the values of one record.
//!
//! Values are read where they are used, so that a count that a file claims never sizes anything by itself: it is
//! checked against the bytes that are left ([`Params::count`]).

use std::fmt;

/// What is wrong with a record.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum ParamError {
    /// A value is not what it must be.
    Bad { index: usize, what: &'static str, got: String },
    /// The record ends too early.
    Missing { index: usize, what: &'static str },
    /// A count is larger than the record.
    Count { index: usize, what: &'static str, got: usize, left: usize },
}

impl fmt::Display for ParamError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Bad { index, what, got } => write!(f, "parameter {index} is `{got}`, expected {what}"),
            Self::Missing { index, what } => write!(f, "the record ends at parameter {index}, where {what} is due"),
            Self::Count { index, what, got, left } => {
                write!(f, "parameter {index} claims {got} {what}, but at most {left} values are left")
            }
        }
    }
}

/// The delimiters of a file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Delimiters {
    pub value: u8,
    pub record: u8,
}

impl Default for Delimiters {
    fn default() -> Self {
        Self { value: b',', record: b';' }
    }
}

/// One value as it stands in the file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Value<'a> {
    /// Left out: the default holds.
    Empty,
    /// A number or a keyword.
    Plain(&'a [u8]),
    /// The characters of a Hollerith string.
    Text(&'a [u8]),
}

/// A cursor over the values of one record.
#[derive(Clone, Debug)]
pub(super) struct Params<'a> {
    bytes: &'a [u8],
    at: usize,
    delimiters: Delimiters,
    ended: bool,
    /// Whether a value was asked for behind the last byte of a record that nothing closes.
    pub ran_out: bool,
    /// The number of the value that comes next, from 0 (the entity type in parameter records).
    pub index: usize,
}

impl<'a> Params<'a> {
    pub fn new(bytes: &'a [u8], delimiters: Delimiters) -> Self {
        Self { bytes, at: 0, delimiters, ended: false, ran_out: false, index: 0 }
    }

    /// Whether the record is over: nothing but defaults follows.
    pub fn ended(&self) -> bool {
        self.ended || self.bytes[self.at..].iter().all(u8::is_ascii_whitespace)
    }

    /// The next value; `Empty` for ever after the end.
    pub fn next(&mut self) -> Value<'a> {
        self.index += 1;
        if self.ended {
            return Value::Empty;
        }
        while self.bytes.get(self.at).is_some_and(u8::is_ascii_whitespace) {
            self.at += 1;
        }
        let start = self.at;
        self.ran_out |= start == self.bytes.len();
        if let Some(text) = self.hollerith() {
            self.skip_to_delimiter();
            return Value::Text(text);
        }
        let end = self.skip_to_delimiter();
        match self.bytes[start..end].trim_ascii() {
            [] => Value::Empty,
            plain => Value::Plain(plain),
        }
    }

    /// Moves behind the next delimiter and says where it was.
    fn skip_to_delimiter(&mut self) -> usize {
        let rest = &self.bytes[self.at..];
        let length =
            rest.iter().position(|&b| b == self.delimiters.value || b == self.delimiters.record).unwrap_or(rest.len());
        let end = self.at + length;
        self.at = (end + 1).min(self.bytes.len());
        self.ended = self.bytes.get(end) == Some(&self.delimiters.record);
        end
    }

    /// The string `nH....` at the cursor, if there is one that fits.
    fn hollerith(&mut self) -> Option<&'a [u8]> {
        let rest = &self.bytes[self.at..];
        let digits = rest.iter().take(9).take_while(|b| b.is_ascii_digit()).count();
        if digits == 0 || !matches!(rest.get(digits), Some(b'H' | b'h')) {
            return None;
        }
        let length: usize = std::str::from_utf8(&rest[..digits]).ok()?.parse().ok()?;
        let text = rest.get(digits + 1..(digits + 1).checked_add(length)?)?;
        self.at += digits + 1 + length;
        Some(text)
    }

    /// A number; an error when it is left out.
    pub fn real(&mut self, what: &'static str) -> Result<f64, ParamError> {
        match self.next() {
            Value::Plain(text) => number(text).ok_or_else(|| self.bad(what, text)),
            Value::Text(text) => Err(self.bad(what, text)),
            Value::Empty => Err(ParamError::Missing { index: self.index - 1, what }),
        }
    }

    /// A number, or `default` when it is left out.
    pub fn real_or(&mut self, default: f64, what: &'static str) -> Result<f64, ParamError> {
        match self.next() {
            Value::Plain(text) => number(text).ok_or_else(|| self.bad(what, text)),
            Value::Text(text) => Err(self.bad(what, text)),
            Value::Empty => Ok(default),
        }
    }

    /// An integer, 0 when it is left out. Files also write integers as `3.` or `3.0`.
    pub fn integer(&mut self, what: &'static str) -> Result<i64, ParamError> {
        match self.next() {
            Value::Plain(text) => integer(text).ok_or_else(|| self.bad(what, text)),
            Value::Text(text) => Err(self.bad(what, text)),
            Value::Empty => Ok(0),
        }
    }

    /// How many `what` follow, each of at least `values_each` values: never more than the record can hold.
    pub fn count(&mut self, what: &'static str, values_each: usize) -> Result<usize, ParamError> {
        let index = self.index;
        let got = self.integer(what)?;
        let got = usize::try_from(got).map_err(|_| ParamError::Bad { index, what, got: got.to_string() })?;
        self.room(index, what, got, values_each)?;
        Ok(got)
    }

    /// Fails when `got` things of `values_each` values cannot fit in the bytes that are left.
    pub fn room(&self, index: usize, what: &'static str, got: usize, values_each: usize) -> Result<(), ParamError> {
        let left = if self.ended { 0 } else { self.bytes.len() - self.at + 1 };
        match got.checked_mul(values_each) {
            Some(needed) if needed <= left => Ok(()),
            _ => Err(ParamError::Count { index, what, got, left }),
        }
    }

    /// How many numbers the record still has. Only right where no strings follow.
    pub fn values_left(&self) -> usize {
        if self.ended {
            return 0;
        }
        let rest = self.bytes[self.at..].split(|&b| b == self.delimiters.record).next().unwrap_or_default();
        1 + rest.iter().filter(|&&b| b == self.delimiters.value).count()
    }

    /// Whether the record is closed by its delimiter somewhere behind the cursor. Only right without strings.
    pub fn is_closed(&self) -> bool {
        self.ended || self.bytes[self.at..].contains(&self.delimiters.record)
    }

    /// The directory entry that a pointer names; 0 and left out mean none. Negative pointers are as positive ones.
    pub fn pointer(&mut self) -> Result<usize, ParamError> {
        Ok(usize::try_from(self.integer("a pointer")?.unsigned_abs()).unwrap_or(0))
    }

    /// A string; plain text counts as one.
    pub fn text(&mut self) -> String {
        match self.next() {
            Value::Text(text) | Value::Plain(text) => String::from_utf8_lossy(text).trim().to_owned(),
            Value::Empty => String::new(),
        }
    }

    /// The pointers of the two lists that may follow every record, associativities left out: its properties.
    pub fn properties(&mut self) -> Vec<usize> {
        let mut list = || -> Result<Vec<usize>, ParamError> {
            let count = self.count("pointers", 1)?;
            (0..count).map(|_| self.pointer()).collect()
        };
        let _associativities = list();
        list().unwrap_or_default()
    }

    fn bad(&self, what: &'static str, got: &[u8]) -> ParamError {
        let got = String::from_utf8_lossy(&got[..got.len().min(24)]).into_owned();
        ParamError::Bad { index: self.index - 1, what, got }
    }
}

/// A number as files write it: `1`, `1.`, `.5`, `+1.5E3`, `1D-3`, `1.5-3`.
pub(super) fn number(text: &[u8]) -> Option<f64> {
    let text = std::str::from_utf8(text).ok()?;
    // `parse` also knows words ("nan", "inf"); those are no numbers of a file, and the geometry would refuse them.
    if let Ok(value) = text.parse::<f64>() {
        return Some(value);
    }
    let text = text.replace(['D', 'd'], "E");
    if let Ok(value) = text.parse::<f64>() {
        return Some(value);
    }
    let sign = text.char_indices().skip(1).find(|&(_, c)| c == '+' || c == '-')?.0;
    let before = text[..sign].chars().next_back()?;
    if !before.is_ascii_digit() && before != '.' {
        return None;
    }
    format!("{}E{}", &text[..sign], &text[sign..]).parse().ok()
}

fn integer(text: &[u8]) -> Option<i64> {
    if let Some(value) = std::str::from_utf8(text).ok().and_then(|t| t.parse().ok()) {
        return Some(value);
    }
    let value = number(text)?;
    (value.fract() == 0.0 && value.abs() < 9e15).then_some(value as i64)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn params(text: &str) -> Params<'_> {
        Params::new(text.as_bytes(), Delimiters::default())
    }

    #[test]
    fn numbers_in_all_their_spellings() {
        for (text, value) in [
            ("1", 1.0),
            ("1.", 1.0),
            (".5", 0.5),
            ("-.5E1", -5.0),
            ("+2.5D-3", 2.5e-3),
            ("2.5d+03", 2.5e3),
            ("1.5-3", 1.5e-3),
            ("-1.5+3", -1.5e3),
        ] {
            assert_eq!(number(text.as_bytes()), Some(value), "{text}");
        }
        for text in ["", "-", "1.2.3", "abc", "1E", "--1", "5H"] {
            assert_eq!(number(text.as_bytes()), None, "{text}");
        }
    }

    #[test]
    fn strings_may_contain_delimiters() {
        let mut p = params(" 128 , 5Ha,;b ,, 3HX;Y,7;");
        assert_eq!(p.integer("type"), Ok(128));
        assert_eq!(p.next(), Value::Text(b"a,;b "));
        assert_eq!(p.next(), Value::Empty);
        assert_eq!(p.text(), "X;Y");
        assert_eq!(p.integer("n"), Ok(7));
        assert!(p.ended());
        assert_eq!(p.next(), Value::Empty);
    }

    #[test]
    fn counts_never_exceed_what_the_record_can_hold() {
        let mut p = params("1000000000,1.,2.;");
        assert!(matches!(p.count("points", 3), Err(ParamError::Count { got: 1_000_000_000, .. })));
        let mut p = params("-3,1.;");
        assert!(matches!(p.count("points", 3), Err(ParamError::Bad { .. })));
        let mut p = params("99H abc;");
        assert_eq!(p.next(), Value::Plain(b"99H abc"));
    }

    #[test]
    fn properties_follow_the_associativities() {
        assert_eq!(params("2,11,13,1,7;").properties(), [7]);
        assert_eq!(params(";").properties(), [0; 0]);
        assert_eq!(params("0,1,-9;").properties(), [9]);
    }
}
