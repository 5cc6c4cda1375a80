//! The legend of a map: its range, its ticks, and dragging its ends.

/// The range of values that a legend shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LegendRange {
    /// The smallest value with a colour.
    pub low: f64,
    /// The largest value with a colour.
    pub high: f64,
    /// Whether new data leaves it alone: locked across patches.
    pub locked: bool,
}

impl LegendRange {
    /// A symmetric range for signed deviations that holds all finite values, rounded up to 1, 2 or 5 times a power of
    /// ten, and at least twice the tolerance.
    pub fn symmetric(values: impl IntoIterator<Item = f64>, tol: f64) -> Self {
        let largest = values.into_iter().filter(|v| v.is_finite()).fold(0.0, |m: f64, v| m.max(v.abs()));
        let high = round_up(largest.max(2.0 * tol));
        Self { low: -high, high, locked: false }
    }

    /// A range for values without a middle, from the smallest to the largest finite one.
    pub fn spanning(values: impl IntoIterator<Item = f64>) -> Self {
        let (low, high) = values
            .into_iter()
            .filter(|v| v.is_finite())
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
        if low > high {
            return Self { low: 0.0, high: 1.0, locked: false };
        }
        // One value alone still needs a width.
        let pad = if low == high { 0.5 * low.abs().max(1e-12) } else { 0.0 };
        Self { low: low - pad, high: high + pad, locked: false }
    }

    /// The range for new data: that of the data unless it is locked.
    #[must_use]
    pub fn updated(&self, of_data: Self) -> Self {
        if self.locked { *self } else { of_data }
    }

    /// The range after its upper end (or lower, when `lower`) was dragged to a value. A symmetric one stays symmetric; ends
    /// never pass each other or the tolerance.
    #[must_use]
    pub fn dragged(&self, lower: bool, to: f64, tol: f64) -> Self {
        if !to.is_finite() {
            return *self;
        }
        if self.low == -self.high {
            let high = to.abs().max(1.01 * tol).max(f64::MIN_POSITIVE);
            return Self { low: -high, high, ..*self };
        }
        let width = 1e-6 * (self.high - self.low);
        if lower {
            Self { low: to.min(self.high - width), ..*self }
        } else {
            Self { high: to.max(self.low + width), ..*self }
        }
    }

    /// The place of a value on the legend, 0..=1 inside.
    pub fn place(&self, value: f64) -> f64 {
        (value - self.low) / (self.high - self.low)
    }

    /// Round values inside the range, about `count` of them, with how many decimals they need.
    pub fn ticks(&self, count: usize) -> (Vec<f64>, usize) {
        ticks(self.low, self.high, count)
    }
}

/// The next 1, 2 or 5 times a power of ten that is not smaller.
pub fn round_up(value: f64) -> f64 {
    if !(value > 0.0 && value.is_finite()) {
        return 1.0;
    }
    let power = 10.0_f64.powf(value.log10().floor());
    let steps = [1.0, 2.0, 5.0, 10.0].map(|m| m * power);
    steps.into_iter().find(|s| *s >= value * (1.0 - 1e-12)).unwrap_or(10.0 * power)
}

/// Round values from `low` to `high`, about `count` of them, with how many decimals they need.
pub fn ticks(low: f64, high: f64, count: usize) -> (Vec<f64>, usize) {
    let width = high - low;
    if !(width > 0.0 && width.is_finite()) {
        return (Vec::new(), 0);
    }
    let step = round_up(width / count.max(1) as f64);
    let first = (low / step - 1e-9).ceil();
    let last = (high / step + 1e-9).floor();
    // Whole multiples, so that zero is zero.
    let n = (last - first).clamp(0.0, 1000.0) as usize;
    let decimals = (-step.log10().floor()).clamp(0.0, 15.0) as usize;
    ((0..=n).map(|k| (first + k as f64) * step).collect(), decimals)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_hold_their_data_and_are_round() {
        for (values, high) in [(vec![0.3, -0.7], 1.0), (vec![-0.0013], 0.002), (vec![41.0, f64::NAN], 50.0)] {
            let range = LegendRange::symmetric(values, 1e-6);
            assert!((range.high - high).abs() < 1e-12 * high && range.low == -range.high);
        }
        let range = LegendRange::symmetric([], 0.1);
        assert!((range.high - 0.2).abs() < 1e-15);
        assert_eq!(LegendRange::spanning([3.0, 1.0, f64::INFINITY]).high, 3.0);
        let one = LegendRange::spanning([2.0]);
        assert!(one.low < 2.0 && one.high > 2.0);
    }

    #[test]
    fn a_locked_range_stays() {
        let mine = LegendRange { locked: true, ..LegendRange::symmetric([1.0], 0.1) };
        let data = LegendRange::symmetric([77.0], 0.1);
        assert_eq!(mine.updated(data), mine);
        assert_eq!(LegendRange { locked: false, ..mine }.updated(data), data);
    }

    #[test]
    fn dragging_keeps_symmetry_and_order() {
        let range = LegendRange::symmetric([1.0], 0.1);
        let dragged = range.dragged(true, -0.4, 0.1);
        assert_eq!((dragged.low, dragged.high), (-0.4, 0.4));
        assert!(range.dragged(false, 0.0, 0.1).high > 0.1, "never into the neutral band");
        let other = LegendRange { low: 0.0, high: 4.0, locked: false };
        assert!(other.dragged(true, 9.0, 0.0).low < 4.0);
        assert_eq!(other.dragged(true, f64::NAN, 0.0), other);
        assert_eq!(other.place(1.0), 0.25);
    }

    #[test]
    fn ticks_are_round_inside_and_as_many_as_asked() {
        for (low, high) in [(-1.0, 1.0), (0.0, 0.037), (-5e-6, 5e-6), (1234.0, 5678.0)] {
            let (at, decimals) = ticks(low, high, 6);
            assert!((3..=8).contains(&at.len()), "{at:?}");
            let pad = 1e-9 * (high - low);
            assert!(at.iter().all(|t| (low - pad..=high + pad).contains(t)));
            for t in &at {
                let scale = 10.0_f64.powi(decimals as i32);
                assert!((t * scale - (t * scale).round()).abs() < 1e-6, "{t} needs more than {decimals} decimals");
            }
        }
        assert!(ticks(-1.0, 1.0, 4).0.contains(&0.0));
        assert!(ticks(1.0, 1.0, 4).0.is_empty());
    }
}
