//! The ternary split of a grid of cells (thesis 4.2.3): S = S1 u Sc u S2, with a middle child Sm around Sc that overlaps
//! S1 and S2, so that what happens across a dividing line happens inside a window.
//!
//! Widths: 128 = 48|32|48 with Sm 48 wide, 48 = 18|12|18 with 18, 18 = 8|2|8 with 4, 8 = 3|2|3 and 3 = 1|1|1 with
//! Sm = Sc, 4 = 2|0|2 and 2 = 1|0|1. Other widths: 3/8 rounded to whole cells, with Sc at least 2 above width 8.
//! Sc is never a node: it is Sm with its domain clipped.

/// Cells `low..high` along one direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct Span {
    pub low: u32,
    pub high: u32,
}

impl Span {
    pub fn new(low: u32, high: u32) -> Self {
        Self { low, high }
    }

    pub fn len(self) -> u32 {
        self.high.saturating_sub(self.low)
    }

    pub fn intersect(self, other: Self) -> Self {
        let low = self.low.max(other.low);
        Self { low, high: self.high.min(other.high).max(low) }
    }
}

/// The three children of a span: S1, Sm, S2, and Sc within Sm. Empty spans have length 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Split {
    pub first: Span,
    pub middle: Span,
    pub last: Span,
    pub core: Span,
}

/// Splits a span of at least 2 cells.
pub(crate) fn split(span: Span) -> Split {
    let n = span.len();
    let (side, middle) = match n {
        128 => (48, 48),
        48 => (18, 18),
        18 => (8, 4),
        8 => (3, 2),
        4 => (2, 0),
        3 => (1, 1),
        2 => (1, 0),
        _ if n > 8 => {
            let side = ((3 * n + 4) / 8).min((n - 2) / 2);
            (side, side)
        }
        _ => {
            let side = (3 * n + 4) / 8;
            (side, n - 2 * side)
        }
    };
    let core = Span::new(span.low + side, span.high - side);
    // Sm reaches equally far into both sides, and always covers Sc.
    let overlap = if middle > core.len() { (middle - core.len()) / 2 } else { 0 };
    Split {
        first: Span::new(span.low, span.low + side),
        middle: Span::new(core.low - overlap.min(core.low), core.high + overlap),
        last: Span::new(span.high - side, span.high),
        core,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn widths(n: u32) -> [u32; 4] {
        let s = split(Span::new(0, n));
        [s.first.len(), s.core.len(), s.last.len(), s.middle.len()]
    }

    #[test]
    fn the_widths_of_the_thesis() {
        assert_eq!(widths(128), [48, 32, 48, 48]);
        assert_eq!(widths(48), [18, 12, 18, 18]);
        assert_eq!(widths(18), [8, 2, 8, 4]);
        assert_eq!(widths(8), [3, 2, 3, 2]);
        assert_eq!(widths(4), [2, 0, 2, 0]);
        assert_eq!(widths(3), [1, 1, 1, 1]);
        assert_eq!(widths(2), [1, 0, 1, 0]);
        assert_eq!(widths(144), [54, 36, 54, 54]);
    }

    #[test]
    fn every_width_is_covered_once_and_the_middle_lies_inside() {
        for n in 2..=600 {
            let s = split(Span::new(10, 10 + n));
            assert_eq!(s.first.low, 10);
            assert_eq!(s.first.high, s.core.low, "{n}");
            assert_eq!(s.core.high, s.last.low, "{n}");
            assert_eq!(s.last.high, 10 + n);
            assert!(s.first.len() > 0 && s.last.len() > 0);
            assert!(s.middle.low <= s.core.low && s.middle.high >= s.core.high);
            assert!(s.middle.low > 10 && s.middle.high < 10 + n || s.middle.len() == 0, "{n}");
            assert!(n <= 8 || s.core.len() >= 2, "{n}");
        }
    }
}
