//! Plot3D grid files: ASCII, Fortran records or raw bytes, either endianness, single or several blocks, 2-D or
//! 3-D, with or without IBLANK; which of these is found out by arithmetic and reported.
//!
//! Nothing in such a file says what it is. A layout is accepted when its block counts are positive and the sizes
//! they imply account for all of the file (binary: to the byte, ASCII: to the number, trailing text apart), and
//! of several the first in a fixed order wins: records before raw, little before big endian, several blocks
//! before one, 3-D before 2-D, f64 before f32, without IBLANK before with.

use glam::DVec3;

use super::report::{ImportReport, Severity};
use crate::kernel::mesh::grid::Grid;

mod write;

pub use write::write;

/// What was found out about a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Layout {
    /// How numbers are stored.
    pub encoding: Encoding,
    /// Whether a block count comes first.
    pub multi_block: bool,
    /// 2 or 3.
    pub dimension: usize,
    /// Whether IBLANK values follow the coordinates of each block.
    pub blank: bool,
}

/// How numbers are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    /// Text.
    Ascii,
    /// Bytes.
    Binary {
        /// In Fortran records (a byte count before and after each), not raw.
        records: bool,
        /// The most significant byte first.
        big_endian: bool,
        /// `f64`, not `f32`.
        double: bool,
    },
}

impl std::fmt::Display for Layout {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.encoding {
            Encoding::Ascii => write!(f, "ASCII")?,
            Encoding::Binary { records, big_endian, double } => {
                let how = if records { "Fortran records" } else { "raw" };
                let order = if big_endian { "big" } else { "little" };
                write!(f, "{how}, {order} endian, {}", if double { "double" } else { "single" })?;
            }
        }
        let blocks = if self.multi_block { "several blocks" } else { "one block" };
        write!(f, ", {blocks}, {}-D, {} IBLANK", self.dimension, if self.blank { "with" } else { "without" })
    }
}

/// Why a file is no Plot3D grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Plot3dError {
    /// No layout explains the file.
    #[error("no layout (ASCII, Fortran records or raw; one or several blocks; 2-D or 3-D) explains its {bytes} bytes")]
    NoLayout {
        /// The length of the file.
        bytes: usize,
    },
}

/// The most blocks that a file may declare.
const MAX_BLOCKS: usize = 100_000;

/// Reads all blocks. A file that ends early in ASCII is read up to its last whole block, with a warning.
pub fn read(bytes: &[u8], report: &mut ImportReport) -> Result<(Layout, Vec<Grid>), Plot3dError> {
    let found = if is_text(bytes) {
        read_ascii(bytes, report)
    } else {
        read_binary(bytes).or_else(|| read_without_marks(bytes, report))
    };
    let (layout, grids) = found.ok_or(Plot3dError::NoLayout { bytes: bytes.len() })?;
    report.add(Severity::Info, "Plot3D", None, None, format!("read as {layout}"));
    let mut whole = Vec::with_capacity(grids.len());
    for (block, grid) in grids.into_iter().enumerate() {
        if grid.points().iter().all(|p| p.is_finite()) {
            whole.push(grid);
        } else {
            report.add(Severity::Skipped, "Plot3D block", Some(block), None, "it has a coordinate that is not finite");
        }
    }
    Ok((layout, whole))
}

fn is_text(bytes: &[u8]) -> bool {
    bytes.iter().take(4096).all(|&b| b.is_ascii_graphic() || b.is_ascii_whitespace())
}

/// The bytes of the values of a file, record marks taken out.
struct Values<'a> {
    /// The payloads: one per record, or one for the whole raw file.
    parts: Vec<&'a [u8]>,
    big_endian: bool,
}

impl<'a> Values<'a> {
    fn raw(bytes: &'a [u8], big_endian: bool) -> Self {
        Self { parts: vec![bytes], big_endian }
    }

    /// Splits Fortran records; `None` when a mark does not fit.
    fn records(bytes: &'a [u8], big_endian: bool) -> Option<Self> {
        let mut parts = Vec::new();
        let mut rest = bytes;
        while !rest.is_empty() {
            let length = int(rest, 0, big_endian).and_then(|n| usize::try_from(n).ok())?;
            let end = length.checked_add(4)?;
            if int(rest, end, big_endian).and_then(|n| usize::try_from(n).ok()) != Some(length) {
                return None;
            }
            parts.push(&rest[4..end]);
            rest = &rest[end + 4..];
        }
        Some(Self { parts, big_endian })
    }

    /// The whole payload in one piece.
    fn joined(&self) -> std::borrow::Cow<'a, [u8]> {
        match self.parts.as_slice() {
            [one] => std::borrow::Cow::Borrowed(one),
            many => std::borrow::Cow::Owned(many.concat()),
        }
    }
}

fn int(bytes: &[u8], at: usize, big_endian: bool) -> Option<i32> {
    let four: [u8; 4] = bytes.get(at..at.checked_add(4)?)?.try_into().ok()?;
    Some(if big_endian { i32::from_be_bytes(four) } else { i32::from_le_bytes(four) })
}

fn read_binary(bytes: &[u8]) -> Option<(Layout, Vec<Grid>)> {
    for records in [true, false] {
        for big_endian in [false, true] {
            let values =
                if records { Values::records(bytes, big_endian) } else { Some(Values::raw(bytes, big_endian)) };
            let Some(values) = values else { continue };
            let payload = values.joined();
            for (multi_block, dimension) in [(true, 3), (true, 2), (false, 3), (false, 2)] {
                let Some((counts, start)) = binary_counts(&payload, values.big_endian, multi_block, dimension) else {
                    continue;
                };
                for (double, blank) in [(true, false), (true, true), (false, false), (false, true)] {
                    let layout = Layout {
                        encoding: Encoding::Binary { records, big_endian, double },
                        multi_block,
                        dimension,
                        blank,
                    };
                    if expected_bytes(&counts, &layout) == payload.len().checked_sub(start)
                        && let Some(grids) = binary_blocks(&payload[start..], &counts, &layout)
                    {
                        return Some((layout, grids));
                    }
                }
            }
        }
    }
    None
}

/// Reads a file of Fortran records some of whose marks are wrong: the counts say where records begin and end, and the
/// length of the file must be what they imply.
fn read_without_marks(bytes: &[u8], report: &mut ImportReport) -> Option<(Layout, Vec<Grid>)> {
    for big_endian in [false, true] {
        for (multi_block, dimension) in [(true, 3), (true, 2), (false, 3), (false, 2)] {
            // The number of blocks stands in a record of its own.
            let header: Vec<u8> = if multi_block {
                [bytes.get(4..8)?, bytes.get(16..).unwrap_or_default()].concat()
            } else {
                bytes.get(4..).unwrap_or_default().to_vec()
            };
            let Some((counts, length)) = binary_counts(&header, big_endian, multi_block, dimension) else { continue };
            let before = if multi_block { 4 + 4 + 4 + 4 + (length - 4) + 4 } else { 4 + length + 4 };
            for (double, blank) in [(true, false), (true, true), (false, false), (false, true)] {
                let encoding = Encoding::Binary { records: true, big_endian, double };
                let layout = Layout { encoding, multi_block, dimension, blank };
                let expected = expected_bytes(&counts, &layout).and_then(|n| n.checked_add(before + 8 * counts.len()));
                if expected != Some(bytes.len()) {
                    continue;
                }
                let mut payload = Vec::with_capacity(bytes.len());
                let mut at = before;
                for count in &counts {
                    let length = expected_bytes(std::slice::from_ref(count), &layout)?;
                    payload.extend_from_slice(bytes.get(at + 4..at + 4 + length)?);
                    at += length + 8;
                }
                let grids = binary_blocks(&payload, &counts, &layout)?;
                let reason = "record marks do not fit the records; the counts were followed instead";
                report.add(Severity::Warning, "Plot3D", None, None, reason);
                return Some((layout, grids));
            }
        }
    }
    None
}

/// The counts of every block and where the coordinates begin.
fn binary_counts(
    bytes: &[u8],
    big_endian: bool,
    multi_block: bool,
    dimension: usize,
) -> Option<(Vec<[usize; 3]>, usize)> {
    let mut at = 0;
    let next = || {
        let value = int(bytes, at, big_endian)?;
        at += 4;
        usize::try_from(value).ok().filter(|&n| n > 0)
    };
    let counts = block_counts(next, multi_block, dimension, bytes.len() / 4)?;
    Some((counts, at))
}

/// The block counts of a header whose whole numbers come from `next`; there cannot be more than `limit` blocks.
fn block_counts(
    mut next: impl FnMut() -> Option<usize>,
    multi_block: bool,
    dimension: usize,
    limit: usize,
) -> Option<Vec<[usize; 3]>> {
    let blocks = if multi_block { next()? } else { 1 };
    if blocks > MAX_BLOCKS || blocks > limit {
        return None;
    }
    let mut counts = Vec::with_capacity(blocks);
    for _ in 0..blocks {
        let mut count = [1; 3];
        for c in &mut count[..dimension] {
            *c = next()?;
        }
        counts.push(count);
    }
    Some(counts)
}

fn points_of(count: &[usize; 3]) -> Option<usize> {
    count.iter().try_fold(1_usize, |n, &c| n.checked_mul(c))
}

fn expected_bytes(counts: &[[usize; 3]], layout: &Layout) -> Option<usize> {
    let Encoding::Binary { double, .. } = layout.encoding else { return None };
    let a_point = layout.dimension * if double { 8 } else { 4 } + if layout.blank { 4 } else { 0 };
    counts.iter().try_fold(0_usize, |sum, c| sum.checked_add(points_of(c)?.checked_mul(a_point)?))
}

fn binary_blocks(bytes: &[u8], counts: &[[usize; 3]], layout: &Layout) -> Option<Vec<Grid>> {
    let Encoding::Binary { big_endian, double, .. } = layout.encoding else { return None };
    let width = if double { 8 } else { 4 };
    let mut at = 0;
    let mut grids = Vec::with_capacity(counts.len());
    for count in counts {
        let n = points_of(count)?;
        let real = |k: usize| -> Option<f64> {
            let b = bytes.get(k..k + width)?;
            Some(match (double, big_endian) {
                (true, false) => f64::from_le_bytes(b.try_into().ok()?),
                (true, true) => f64::from_be_bytes(b.try_into().ok()?),
                (false, false) => f64::from(f32::from_le_bytes(b.try_into().ok()?)),
                (false, true) => f64::from(f32::from_be_bytes(b.try_into().ok()?)),
            })
        };
        let mut points = vec![DVec3::ZERO; n];
        for axis in 0..layout.dimension {
            for p in &mut points {
                p[axis] = real(at)?;
                at += width;
            }
        }
        let mut blank = None;
        if layout.blank {
            let values: Option<Vec<i32>> = (0..n).map(|k| int(bytes, at + 4 * k, big_endian)).collect();
            blank = Some(values?);
            at += 4 * n;
        }
        grids.push(Grid::new(*count, points, blank).ok()?);
    }
    Some(grids)
}

fn read_ascii(bytes: &[u8], report: &mut ImportReport) -> Option<(Layout, Vec<Grid>)> {
    let text = std::str::from_utf8(bytes).ok()?;
    let mut numbers = Vec::new();
    let mut trailing = false;
    for word in text.split(|c: char| c.is_whitespace() || c == ',').filter(|w| !w.is_empty()) {
        if !push_numbers(word, REPEATED * text.len() + 1024, &mut numbers) {
            trailing = true;
            break;
        }
    }
    let layouts = [(true, 3), (true, 2), (false, 3), (false, 2)];
    let fits = |exact: bool| {
        layouts.iter().find_map(|&(multi_block, dimension)| {
            let (counts, start) = ascii_counts(&numbers, multi_block, dimension)?;
            let points = counts.iter().try_fold(0_usize, |n, c| n.checked_add(points_of(c)?))?;
            [false, true].iter().find_map(|&blank| {
                let needed = points.checked_mul(dimension + usize::from(blank))?;
                let there = numbers.len() - start;
                let fits = if exact { needed == there } else { !blank && needed > there };
                let layout = Layout { encoding: Encoding::Ascii, multi_block, dimension, blank };
                fits.then(|| (layout, counts.clone(), start))
            })
        })
    };
    let (layout, counts, start) = fits(true).or_else(|| fits(false))?;
    let grids = ascii_blocks(&numbers[start..], &counts, &layout);
    if grids.len() < counts.len() {
        let reason = format!("the file ends early: {} of {} blocks are whole and were read", grids.len(), counts.len());
        report.add(Severity::Warning, "Plot3D", None, None, reason);
    }
    if trailing {
        report.add(Severity::Info, "Plot3D", None, None, "text behind the numbers was passed over");
    }
    (!grids.is_empty()).then_some((layout, grids))
}

/// How many numbers repeat counts may make of a byte. A grid that spells two of its coordinates has four bytes a point, for
/// at most two values that repeat.
const REPEATED: usize = 4;

/// Reads one word: a number, with D exponents and Fortran's repeat counts (`3*1.0`), up to `limit` numbers in all.
fn push_numbers(word: &str, limit: usize, numbers: &mut Vec<f64>) -> bool {
    let real = |w: &str| w.parse::<f64>().or_else(|_| w.replace(['d', 'D'], "e").parse::<f64>()).ok();
    if let Some((count, value)) = word.split_once('*') {
        let (Ok(count), Some(value)) = (count.parse::<usize>(), real(value)) else { return false };
        if numbers.len().checked_add(count).is_none_or(|all| all > limit) {
            return false;
        }
        numbers.extend(std::iter::repeat_n(value, count));
        return true;
    }
    real(word).map(|v| numbers.push(v)).is_some()
}

fn ascii_counts(numbers: &[f64], multi_block: bool, dimension: usize) -> Option<(Vec<[usize; 3]>, usize)> {
    let mut at = 0;
    let next = || {
        let value = *numbers.get(at)?;
        at += 1;
        (value.fract() == 0.0 && (1.0..1e9).contains(&value)).then_some(value as usize)
    };
    let counts = block_counts(next, multi_block, dimension, numbers.len())?;
    Some((counts, at))
}

/// The whole blocks at the start of the numbers.
fn ascii_blocks(mut numbers: &[f64], counts: &[[usize; 3]], layout: &Layout) -> Vec<Grid> {
    let mut grids = Vec::new();
    for count in counts {
        let Some(n) = points_of(count) else { break };
        let needed = n.saturating_mul(layout.dimension + usize::from(layout.blank));
        if numbers.len() < needed {
            break;
        }
        let (block, rest) = numbers.split_at(needed);
        numbers = rest;
        let coordinate = |axis: usize, k: usize| if axis < layout.dimension { block[axis * n + k] } else { 0.0 };
        let points = (0..n).map(|k| DVec3::new(coordinate(0, k), coordinate(1, k), coordinate(2, k))).collect();
        let blank = layout.blank.then(|| block[layout.dimension * n..].iter().map(|&b| b as i32).collect());
        let Ok(grid) = Grid::new(*count, points, blank) else { break };
        grids.push(grid);
    }
    grids
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grids(blank: bool) -> Vec<Grid> {
        let block = |[ni, nj, nk]: [usize; 3]| {
            let n = ni * nj * nk;
            let point = |k: usize| DVec3::new(k as f64 * 0.1, (k * k) as f64 / 7.0, -(k as f64));
            let values = blank.then(|| (0..n).map(|k| i32::from(k % 5 != 0)).collect());
            Grid::new([ni, nj, nk], (0..n).map(point).collect(), values).unwrap()
        };
        vec![block([4, 3, 2]), block([5, 1, 3])]
    }

    #[test]
    fn every_encoding_is_found_out_and_kept() {
        for blank in [false, true] {
            let mut encodings = vec![Encoding::Ascii];
            for k in 0..8 {
                encodings.push(Encoding::Binary { records: k & 1 > 0, big_endian: k & 2 > 0, double: k & 4 > 0 });
            }
            for encoding in encodings {
                let mut report = ImportReport::default();
                let (layout, back) = read(&write(&grids(blank), encoding), &mut report).unwrap();
                assert_eq!(layout, Layout { encoding, multi_block: true, dimension: 3, blank });
                let single = matches!(encoding, Encoding::Binary { double: false, .. });
                for (a, b) in grids(blank).iter().zip(&back) {
                    assert_eq!((a.counts(), a.blank()), (b.counts(), b.blank()));
                    for (p, q) in a.points().iter().zip(b.points()) {
                        assert!(if single { p.distance(*q) < 1e-5 } else { p == q });
                    }
                }
            }
        }
    }

    #[test]
    fn fortran_text_with_repeats_d_exponents_and_a_tail_is_read() {
        let text = "1\n 2, 2 1\n 0.0 1.0D0 2*0.5d+00\n 2*0 2*1\n 4*7.\n written by somebody\n";
        let mut report = ImportReport::default();
        let (layout, blocks) = read(text.as_bytes(), &mut report).unwrap();
        assert_eq!((layout.multi_block, layout.dimension), (true, 3));
        assert_eq!(blocks[0].points()[2], DVec3::new(0.5, 1.0, 7.0));
        assert_eq!(report.lines.len(), 2);
    }

    #[test]
    fn cut_and_flipped_files_are_survived() {
        let all = [Encoding::Ascii, Encoding::Binary { records: true, big_endian: false, double: true }];
        for encoding in all {
            let bytes = write(&grids(true), encoding);
            for length in 0..bytes.len() {
                let _either = read(&bytes[..length], &mut ImportReport::default());
            }
            for at in 0..bytes.len().min(300) {
                let mut flipped = bytes.clone();
                flipped[at] ^= 0x81;
                let _either = read(&flipped, &mut ImportReport::default());
            }
        }
    }
}
