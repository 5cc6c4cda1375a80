//! The exchange structure of STEP files (ISO 10303-21): from text to instances, one bad statement at a time.
//!
//! Instances borrow their text from the file, so memory stays within a small multiple of its size. A statement
//! that cannot be read is reported with its line and skipped up to its semicolon; everything else is kept.
//! Comments may stand anywhere between tokens; strings may run over lines and double their quotes. Lists deeper
//! than [`MAX_DEPTH`] are an error of their statement, so that no file can exhaust the stack. Linear in the
//! length of the file.

use std::borrow::Cow;
use std::collections::HashMap;

/// How deep lists may be nested.
pub const MAX_DEPTH: usize = 64;

/// What a file ends with.
const END: &str = "END-ISO-10303-21";

/// A value of an instance.
#[derive(Clone, Debug, PartialEq)]
pub enum Value<'a> {
    /// `$`: left out.
    Unset,
    /// `*`: derived.
    Derived,
    /// A whole number.
    Integer(i64),
    /// A real number.
    Real(f64),
    /// A string, quotes off and still escaped (see [`text`]).
    String(&'a str),
    /// `.NAME.`
    Enum(&'a str),
    /// `#number`
    Reference(u64),
    /// `(a, b, ...)`
    List(Vec<Value<'a>>),
    /// `NAME(a, b, ...)`
    Typed(&'a str, Vec<Value<'a>>),
    /// `"hex"`
    Binary(&'a str),
}

/// One part of an instance: its type and values.
#[derive(Clone, Debug, PartialEq)]
pub struct Record<'a> {
    /// The type, in capitals as the file has it.
    pub name: &'a str,
    /// Its values.
    pub values: Vec<Value<'a>>,
}

/// An instance: one record, or several for a complex instance.
#[derive(Clone, Debug, PartialEq)]
pub struct Instance<'a> {
    /// Its records.
    pub records: Vec<Record<'a>>,
    /// The line where it begins, from 1.
    pub line: usize,
}

impl<'a> Instance<'a> {
    /// The record of a type.
    pub fn record(&self, name: &str) -> Option<&Record<'a>> {
        self.records.iter().find(|r| r.name == name)
    }

    /// What the instance is called in a report: its type, or the types of a complex instance.
    pub fn type_name(&self) -> String {
        self.records.iter().map(|r| r.name).collect::<Vec<_>>().join("+")
    }
}

/// A statement that could not be read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fault {
    /// The instance, where its number could be read.
    pub number: Option<u64>,
    /// The line where the statement begins, from 1.
    pub line: usize,
    /// What is wrong.
    pub reason: String,
}

/// A whole file.
#[derive(Clone, Debug, Default)]
pub struct Exchange<'a> {
    /// Records of the header.
    pub header: Vec<Record<'a>>,
    /// Instances by number.
    pub instances: HashMap<u64, Instance<'a>>,
    /// The numbers in file order.
    pub order: Vec<u64>,
    /// Statements that could not be read.
    pub faults: Vec<Fault>,
    /// Whether the file ends as it should, with `END-ISO-10303-21;`.
    pub ended: bool,
}

/// Whether this text is a STEP file.
pub fn looks_like(text: &[u8]) -> bool {
    let head = &text[..text.len().min(2048)];
    head.windows(13).any(|w| w == b"ISO-10303-21;")
}

/// Reads a file.
pub fn parse(text: &str) -> Exchange<'_> {
    let mut out = Exchange::default();
    let mut scanner = Scanner { text, bytes: text.as_bytes(), at: 0, line: 1 };
    let mut in_data = false;
    loop {
        scanner.skip_space();
        if scanner.at >= scanner.bytes.len() {
            break;
        }
        let (line, start) = (scanner.line, scanner.at);
        if scanner.peek() == Some(b'#') {
            in_data = true;
            let number = scanner.reference();
            match number.and_then(|n| scanner.instance().map(|records| (n, records))) {
                Ok((number, records)) => {
                    if out.instances.insert(number, Instance { records, line }).is_some() {
                        let reason = "this number was used before; the later statement counts".to_owned();
                        out.faults.push(Fault { number: Some(number), line, reason });
                    } else {
                        out.order.push(number);
                    }
                }
                Err(reason) => {
                    let mut again = Scanner { at: start, line, ..scanner };
                    let number = again.reference().ok();
                    out.faults.push(Fault { number, line, reason });
                    // From its beginning: the error may stand in the statement that follows one without an end.
                    (scanner.at, scanner.line) = (start, line);
                    scanner.skip_statement();
                }
            }
        } else {
            match scanner.record() {
                Ok(record) if !in_data => out.header.push(record),
                Ok(_) => {}
                Err(_) if is_keyword(&text[start..]) => out.ended |= text[start..].starts_with(END),
                Err(reason) => out.faults.push(Fault { number: None, line, reason }),
            }
            scanner.skip_statement();
        }
    }
    out
}

/// Statements without parentheses that frame the sections.
fn is_keyword(rest: &str) -> bool {
    ["ISO-10303-21", END, "HEADER", "DATA", "ENDSEC", "ANCHOR", "REFERENCE", "SIGNATURE"]
        .iter()
        .any(|k| rest.starts_with(k))
}

#[derive(Clone, Copy)]
struct Scanner<'a> {
    text: &'a str,
    bytes: &'a [u8],
    at: usize,
    line: usize,
}

impl<'a> Scanner<'a> {
    fn peek(&self) -> Option<u8> {
        self.bytes.get(self.at).copied()
    }

    fn step(&mut self) {
        self.line += usize::from(self.peek() == Some(b'\n'));
        self.at += 1;
    }

    fn skip_space(&mut self) {
        while let Some(byte) = self.peek() {
            if byte.is_ascii_whitespace() {
                self.step();
            } else if self.bytes[self.at..].starts_with(b"/*") {
                self.at += 2;
                while self.at < self.bytes.len() && !self.bytes[self.at..].starts_with(b"*/") {
                    self.step();
                }
                self.at = (self.at + 2).min(self.bytes.len());
            } else {
                return;
            }
        }
    }

    /// Goes behind the next semicolon that is not in a string or comment. A broken string could swallow the
    /// rest of the file, so a line that begins like an instance ends the search too.
    fn skip_statement(&mut self) {
        let mut quoted = false;
        while let Some(byte) = self.peek() {
            if !quoted && self.bytes[self.at..].starts_with(b"/*") {
                self.skip_space();
                continue;
            }
            let new_line = byte == b'\n';
            quoted ^= byte == b'\'';
            self.step();
            if byte == b';' && !quoted {
                return;
            }
            if new_line && looks_like_instance(&self.bytes[self.at..]) {
                return;
            }
        }
    }

    fn expect(&mut self, byte: u8) -> Result<(), String> {
        self.skip_space();
        if self.peek() == Some(byte) {
            self.at += 1;
            return Ok(());
        }
        Err(format!("expected '{}', got {}", char::from(byte), self.shown()))
    }

    fn shown(&self) -> String {
        match self.text.get(self.at..).and_then(|t| t.chars().next()) {
            Some(c) => format!("'{}'", c.escape_debug()),
            None => "the end of the file".to_owned(),
        }
    }

    fn reference(&mut self) -> Result<u64, String> {
        self.expect(b'#')?;
        let digits = self.take(|b| b.is_ascii_digit());
        digits.parse().map_err(|_| format!("expected an instance number after '#', got \"{digits}\""))
    }

    fn take(&mut self, keep: impl Fn(u8) -> bool) -> &'a str {
        let start = self.at;
        while self.peek().is_some_and(&keep) {
            self.at += 1;
        }
        self.text.get(start..self.at).unwrap_or_default()
    }

    /// `= RECORD;` or `= (RECORD RECORD ...);`
    fn instance(&mut self) -> Result<Vec<Record<'a>>, String> {
        self.expect(b'=')?;
        self.skip_space();
        let mut records = Vec::new();
        if self.peek() == Some(b'(') {
            self.at += 1;
            loop {
                self.skip_space();
                if self.peek() == Some(b')') {
                    self.at += 1;
                    break;
                }
                records.push(self.record()?);
            }
        } else {
            records.push(self.record()?);
        }
        self.expect(b';')?;
        Ok(records)
    }

    fn record(&mut self) -> Result<Record<'a>, String> {
        self.skip_space();
        let name = self.take(|b| b.is_ascii_alphanumeric() || b == b'_' || b == b'!' || b == b'-');
        if name.is_empty() {
            return Err(format!("expected the name of a type, got {}", self.shown()));
        }
        self.expect(b'(')?;
        Ok(Record { name, values: self.list(0)? })
    }

    /// The values up to the closing parenthesis.
    fn list(&mut self, depth: usize) -> Result<Vec<Value<'a>>, String> {
        if depth > MAX_DEPTH {
            return Err(format!("lists are nested deeper than {MAX_DEPTH}"));
        }
        let mut values = Vec::new();
        self.skip_space();
        if self.peek() == Some(b')') {
            self.at += 1;
            return Ok(values);
        }
        loop {
            values.push(self.value(depth)?);
            self.skip_space();
            match self.peek() {
                Some(b',') => self.at += 1,
                Some(b')') => {
                    self.at += 1;
                    values.shrink_to_fit();
                    return Ok(values);
                }
                _ => return Err(format!("expected ',' or ')', got {}", self.shown())),
            }
        }
    }

    fn value(&mut self, depth: usize) -> Result<Value<'a>, String> {
        self.skip_space();
        match self.peek() {
            Some(b'$') => {
                self.at += 1;
                Ok(Value::Unset)
            }
            Some(b'*') => {
                self.at += 1;
                Ok(Value::Derived)
            }
            Some(b'#') => self.reference().map(Value::Reference),
            Some(b'(') => {
                self.at += 1;
                self.list(depth + 1).map(Value::List)
            }
            Some(b'\'') => self.string().map(Value::String),
            Some(b'"') => {
                self.at += 1;
                let hex = self.take(|b| b.is_ascii_hexdigit());
                self.expect(b'"')?;
                Ok(Value::Binary(hex))
            }
            Some(b'.') => {
                self.at += 1;
                let name = self.take(|b| b.is_ascii_alphanumeric() || b == b'_');
                self.expect(b'.')?;
                Ok(Value::Enum(name))
            }
            Some(b'+' | b'-' | b'0'..=b'9') => self.number(),
            Some(b) if b.is_ascii_alphabetic() || b == b'!' => {
                let name = self.take(|b| b.is_ascii_alphanumeric() || b == b'_' || b == b'!');
                self.expect(b'(')?;
                Ok(Value::Typed(name, self.list(depth + 1)?))
            }
            _ => Err(format!("expected a value, got {}", self.shown())),
        }
    }

    fn number(&mut self) -> Result<Value<'a>, String> {
        let text = self.take(|b| b.is_ascii_digit() || matches!(b, b'+' | b'-' | b'.' | b'e' | b'E' | b'd' | b'D'));
        if !text.contains(['.', 'e', 'E', 'd', 'D'])
            && let Ok(integer) = text.parse()
        {
            return Ok(Value::Integer(integer));
        }
        let real = text.parse().or_else(|_| text.replace(['d', 'D'], "e").parse());
        real.map(Value::Real).map_err(|_| format!("\"{text}\" is no number"))
    }

    fn string(&mut self) -> Result<&'a str, String> {
        self.at += 1;
        let start = self.at;
        loop {
            match self.peek() {
                None => return Err("a string without an end".to_owned()),
                Some(b'\'') if self.bytes.get(self.at + 1) == Some(&b'\'') => self.at += 2,
                Some(b'\'') => {
                    self.at += 1;
                    return Ok(self.text.get(start..self.at - 1).unwrap_or_default());
                }
                Some(b'\n') if looks_like_instance(&self.bytes[self.at + 1..]) => {
                    return Err("a string without an end on its statement".to_owned());
                }
                Some(_) => self.step(),
            }
        }
    }
}

/// Whether a line begins with `#number=`.
fn looks_like_instance(line: &[u8]) -> bool {
    let Some(rest) = line.strip_prefix(b"#") else { return false };
    let digits = rest.iter().take_while(|b| b.is_ascii_digit()).count();
    let rest = rest[digits..].trim_ascii_start();
    digits > 0 && rest.first() == Some(&b'=')
}

/// The text of a string value: doubled quotes, `\S\`, `\X\hh`, `\X2\...\X0\` and `\X4\...\X0\` undone, line
/// breaks taken out. What cannot be undone stays as it is.
pub fn text(raw: &str) -> Cow<'_, str> {
    if !raw.contains(['\'', '\\', '\n', '\r']) {
        return Cow::Borrowed(raw);
    }
    let mut out = String::with_capacity(raw.len());
    let mut rest = raw;
    while let Some(c) = rest.chars().next() {
        if let Some(tail) = rest.strip_prefix("''") {
            out.push('\'');
            rest = tail;
        } else if let Some((decoded, tail)) = escape(rest) {
            out.push_str(&decoded);
            rest = tail;
        } else {
            if c != '\n' && c != '\r' {
                out.push(c);
            }
            rest = &rest[c.len_utf8()..];
        }
    }
    Cow::Owned(out)
}

fn escape(rest: &str) -> Option<(String, &str)> {
    if let Some(tail) = rest.strip_prefix("\\\\") {
        return Some(("\\".to_owned(), tail));
    }
    if let Some(tail) = rest.strip_prefix("\\S\\") {
        let c = tail.chars().next().filter(char::is_ascii)?;
        return Some((char::from(c as u8 | 0x80).to_string(), &tail[1..]));
    }
    if let Some(tail) = rest.strip_prefix("\\X\\") {
        let code = u8::from_str_radix(tail.get(..2)?, 16).ok()?;
        return Some((char::from(code).to_string(), &tail[2..]));
    }
    for (start, width) in [("\\X2\\", 4), ("\\X4\\", 8)] {
        if let Some(tail) = rest.strip_prefix(start) {
            let end = tail.find("\\X0\\")?;
            let hex = &tail.as_bytes()[..end];
            let units: Option<Vec<u32>> =
                hex.chunks(width).map(|unit| u32::from_str_radix(std::str::from_utf8(unit).ok()?, 16).ok()).collect();
            let units = units?;
            let decoded = if width == 4 {
                String::from_utf16_lossy(&units.iter().map(|&u| u as u16).collect::<Vec<_>>())
            } else {
                units.into_iter().map(|u| char::from_u32(u).unwrap_or(char::REPLACEMENT_CHARACTER)).collect()
            };
            return Some((decoded, &tail[end + 4..]));
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEAD: &str = "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION((''),'2;1');\nENDSEC;\nDATA;\n";

    fn one(statement: &str) -> Exchange<'_> {
        parse(statement)
    }

    #[test]
    fn every_kind_of_value_is_read() {
        let text = "#1 = T($,*,-3,+2.5E-1,1.,'it''s',.TRUE.,#22,(),(1,(2)),LENGTH_MEASURE(304.8),\"0FF\");";
        let record = &one(text).instances[&1].records[0];
        let expected = vec![
            Value::Unset,
            Value::Derived,
            Value::Integer(-3),
            Value::Real(0.25),
            Value::Real(1.0),
            Value::String("it''s"),
            Value::Enum("TRUE"),
            Value::Reference(22),
            Value::List(vec![]),
            Value::List(vec![Value::Integer(1), Value::List(vec![Value::Integer(2)])]),
            Value::Typed("LENGTH_MEASURE", vec![Value::Real(304.8)]),
            Value::Binary("0FF"),
        ];
        assert_eq!(record.values, expected);
    }

    #[test]
    fn complex_instances_comments_and_strings_over_lines() {
        let text = "#6=(\nLENGTH_UNIT()/* a; comment */\nNAMED_UNIT(*)\nSI_UNIT(.MILLI.,.METRE.)\n);\n#7=P('a;\nb');";
        let exchange = one(text);
        assert!(exchange.faults.is_empty());
        assert_eq!(exchange.instances[&6].records.len(), 3);
        assert_eq!(exchange.instances[&6].type_name(), "LENGTH_UNIT+NAMED_UNIT+SI_UNIT");
        let Value::String(raw) = exchange.instances[&7].records[0].values[0] else { panic!() };
        assert_eq!(super::text(raw), "a;b");
        assert_eq!(exchange.instances[&7].line, 6);
    }

    #[test]
    fn escapes_are_undone() {
        assert_eq!(
            text("Stra\\X2\\00DF\\X0\\e \\X\\E9 \\S\\d it''s \\\\ \\Q"),
            "Stra\u{df}e \u{e9} \u{e4} it's \\ \\Q"
        );
        assert_eq!(text("\\X4\\0001F600\\X0\\"), "\u{1F600}");
    }

    #[test]
    fn a_bad_statement_costs_only_itself() {
        for bad in ["#2=POINT('a',(1.,,2.));", "#2=POINT('a,(1.,2.));", "#2=;", "#2 POINT();", "#=P();", "#2=(A(1)"] {
            let file = format!("{HEAD}#1=A(1);\n{bad}\n#3=B('x');\n#4=C(#3);\nENDSEC;\nEND-ISO-10303-21;\n");
            let exchange = parse(&file);
            assert!(exchange.instances.contains_key(&1) && exchange.instances.contains_key(&4), "{bad}");
            assert!(exchange.instances.contains_key(&3), "{bad}");
            assert_eq!(exchange.faults.len(), 1, "{bad}: {:?}", exchange.faults);
            assert_eq!(exchange.faults[0].line, 7);
        }
    }

    #[test]
    fn deep_nesting_and_cut_files_are_survived() {
        let deep = format!("#1=A({}1{});\n#2=B();", "(".repeat(100_000), ")".repeat(100_000));
        let exchange = parse(&deep);
        assert_eq!((exchange.faults.len(), exchange.order.as_slice()), (1, &[2][..]));
        let file = format!("{HEAD}#1=A('b',(1,2.5),#3,.T.);/* c */\n#2=(A()B($));\nENDSEC;\n");
        for length in 0..file.len() {
            let _any = parse(&file[..length]);
        }
    }
}
