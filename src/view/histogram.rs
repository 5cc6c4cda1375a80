//! The distribution of deviations under the legend, and the numbers that go with it.

/// Counts of values in bins of equal width, with what fell outside and what had no value.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Histogram {
    /// The range that the bins divide.
    pub range: [f64; 2],
    /// How many values each bin has. Lower borders belong to their bin, the upper end to the last.
    pub counts: Vec<usize>,
    /// Values below the range.
    pub below: usize,
    /// Values above the range.
    pub above: usize,
    /// Samples without a value.
    pub missing: usize,
    /// The sum of the squares of all values.
    squares: f64,
    sorted: Vec<f64>,
}

impl Histogram {
    /// Counts values; `None` and NaN are samples without a value. At least one bin; an empty range has no bins.
    pub fn new(values: impl IntoIterator<Item = Option<f64>>, range: [f64; 2], bins: usize) -> Self {
        let width = range[1] - range[0];
        let bins = if width > 0.0 && width.is_finite() { bins.max(1) } else { 0 };
        let mut out = Self { range, counts: vec![0; bins], ..Self::default() };
        for value in values {
            let Some(value) = value.filter(|v| !v.is_nan()) else {
                out.missing += 1;
                continue;
            };
            out.sorted.push(value);
            out.squares += value * value;
            if value < range[0] {
                out.below += 1;
            } else if value > range[1] {
                out.above += 1;
            } else if bins > 0 {
                let at = ((value - range[0]) / width * bins as f64) as usize;
                out.counts[at.min(bins - 1)] += 1;
            }
        }
        out.sorted.sort_by(f64::total_cmp);
        out
    }

    /// How many samples have a value.
    pub fn total(&self) -> usize {
        self.sorted.len()
    }

    /// The count of the fullest bin: the height of the picture.
    pub fn highest(&self) -> usize {
        self.counts.iter().copied().max().unwrap_or(0)
    }

    /// The root mean square; 0 without values.
    pub fn rms(&self) -> f64 {
        if self.sorted.is_empty() { 0.0 } else { (self.squares / self.sorted.len() as f64).sqrt() }
    }

    /// The share of values whose size is within a tolerance; 0 without values.
    pub fn share_within(&self, tol: f64) -> f64 {
        if self.sorted.is_empty() {
            return 0.0;
        }
        let upper = self.sorted.partition_point(|v| *v <= tol);
        let lower = self.sorted.partition_point(|v| *v < -tol);
        (upper.saturating_sub(lower)) as f64 / self.sorted.len() as f64
    }

    /// The value below which a share (0..=1) of the values lies; `None` without values.
    pub fn quantile(&self, share: f64) -> Option<f64> {
        let last = self.sorted.len().checked_sub(1)?;
        let at = (share.clamp(0.0, 1.0) * last as f64).round() as usize;
        self.sorted.get(at).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_sample_is_counted_once() {
        let values = (0..1000).map(|k| (k % 7 != 0).then(|| f64::from(k - 500) / 100.0));
        let h = Histogram::new(values, [-3.0, 3.0], 12);
        assert_eq!(h.counts.iter().sum::<usize>() + h.below + h.above + h.missing, 1000);
        assert_eq!(h.missing, 143);
        assert_eq!(h.total(), 857);
    }

    #[test]
    fn even_values_fill_even_bins_and_ends_belong_inside() {
        let h = Histogram::new((0..=100).map(|k| Some(f64::from(k) / 100.0)), [0.0, 1.0], 10);
        assert_eq!((h.below, h.above), (0, 0));
        assert!(h.counts.iter().all(|&c| (9..=11).contains(&c)) && h.highest() <= 11);
        assert_eq!(h.quantile(0.5), Some(0.5));
        // The mean of k^2 / 100^2 for k = 0..=100 is 201 / 600.
        assert!((h.rms() - (201.0_f64 / 600.0).sqrt()).abs() < 1e-12);
        assert!((h.share_within(0.25) - 26.0 / 101.0).abs() < 1e-12);
    }

    #[test]
    fn nothing_gives_nothing() {
        let h = Histogram::new([None, Some(f64::NAN)], [1.0, 1.0], 5);
        assert_eq!((h.missing, h.total(), h.counts.len(), h.highest()), (2, 0, 0, 0));
        assert_eq!((h.rms(), h.share_within(1.0), h.quantile(0.5)), (0.0, 0.0, None));
    }
}
