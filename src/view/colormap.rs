//! Numbers as colours: the deviation map and the sequential maps. The same [`ColorScale`] feeds the surface shader, the
//! legend and the histogram, so that they always agree.
//!
//! Deviation: diverging blue, white, red (after ColorBrewer's RdBu, Harrower and Brewer, *ColorBrewer.org*, 2003), in steps. Within
//! the tolerance on either side the colour is neutral. Beyond the range and without data there are colours that occur
//! nowhere else; no data is hatched as well, so that it is told by more than colour. Sequential fields take viridis
//! (van der Walt and Smith, 2015) or cividis (Nunez, Anderton and Renslow, *Optimizing colormaps with consideration for color vision
//! deficiency*, 2018): even lightness, never a rainbow.

/// A colour in sRGB, 0..=1 each.
pub type Rgb = [f32; 3];

/// Linear RGBA, not premultiplied: what the graphics card mixes.
pub type Color = [f32; 4];

const fn hex(rgb: u32) -> Rgb {
    [(rgb >> 16 & 255) as f32 / 255.0, (rgb >> 8 & 255) as f32 / 255.0, (rgb & 255) as f32 / 255.0]
}

/// Blue to white to red, CIELAB-symmetric after Brewer's RdBu in 11 classes.
const BLUE_RED: [u32; 11] =
    [0x1b4f8f, 0x2f79b5, 0x5a9fcc, 0x93c4df, 0xc9e0ee, 0xf5f5f2, 0xfbd9c4, 0xf3ac88, 0xdc7258, 0xbd3337, 0x8c0f26];

const VIRIDIS: [u32; 11] =
    [0x440154, 0x482576, 0x414487, 0x35608d, 0x2a788e, 0x21918c, 0x22a884, 0x43bf71, 0x7ad151, 0xbcdf27, 0xfde725];

const CIVIDIS: [u32; 5] = [0x00204d, 0x414d6b, 0x7c7b78, 0xbcaf6f, 0xffea46];

/// A colour as linear light.
pub fn linear(color: Rgb) -> Rgb {
    color.map(|c| if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) })
}

/// The colour written `0xRRGGBB` in sRGB, opaque.
pub fn srgb(rgb: u32) -> Color {
    let [r, g, b] = linear(hex(rgb));
    [r, g, b, 1.0]
}

fn along(table: &[u32], t: f64) -> Rgb {
    let x = t.clamp(0.0, 1.0) * (table.len() - 1) as f64;
    let k = (x as usize).min(table.len() - 2);
    let f = (x - k as f64) as f32;
    let (a, b) = (hex(table[k]), hex(table[k + 1]));
    [0, 1, 2].map(|c| a[c] + (b[c] - a[c]) * f)
}

/// A map for a field without a middle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Sequential {
    /// Dark violet to yellow.
    #[default]
    Viridis,
    /// Dark blue to yellow, the same for eyes that see no red or no green.
    Cividis,
}

impl Sequential {
    /// The colour at 0..=1.
    pub fn color(self, t: f64) -> Rgb {
        match self {
            Self::Viridis => along(&VIRIDIS, t),
            Self::Cividis => along(&CIVIDIS, t),
        }
    }
}

/// The most steps a scale has; more are cut off.
pub const MAX_STEPS: usize = 32;

/// Turns numbers into colours in equal steps between `low` and `high`.
#[derive(Clone, Debug, PartialEq)]
pub struct ColorScale {
    /// Value at the lower end of the first step.
    pub low: f32,
    /// Value at the upper end of the last step.
    pub high: f32,
    /// Values within this of zero take the neutral colour (the tolerance band); 0: no band.
    pub band: f32,
    /// The colours, at most [`MAX_STEPS`].
    pub steps: Vec<Color>,
    /// The colour inside the band.
    pub neutral: Color,
    /// The colour below `low`.
    pub below: Color,
    /// The colour above `high`.
    pub above: Color,
    /// The lighter colour of the hatching where there is no data.
    pub no_data: Color,
}

impl ColorScale {
    /// A signed deviation: blue, white, red in 11 steps over `-range..range`, neutral within `tolerance`, distinct
    /// colours out of range.
    pub fn deviation(range: f32, tolerance: f32) -> Self {
        let range = if range > 0.0 && range.is_finite() { range } else { 1.0 };
        Self {
            low: -range,
            high: range,
            band: tolerance.max(0.0),
            steps: BLUE_RED.map(srgb).to_vec(),
            neutral: srgb(0xdfe8d8),
            below: srgb(0x00a8a8),
            above: srgb(0xd01c8b),
            no_data: srgb(0xb4b4b4),
        }
    }

    /// A magnitude from `low` to `high` in viridis.
    pub fn sequential(low: f32, high: f32) -> Self {
        Self {
            low,
            high: if high > low { high } else { low + 1.0 },
            band: 0.0,
            steps: VIRIDIS.map(srgb).to_vec(),
            neutral: srgb(0xdfe8d8),
            below: srgb(0x2a1030),
            above: srgb(0xfff7c2),
            no_data: srgb(0xb4b4b4),
        }
    }

    /// The colour of a value; NaN has the colour of no data.
    pub fn color(&self, value: f32) -> Color {
        let steps = &self.steps[..self.steps.len().min(MAX_STEPS)];
        if value.is_nan() || steps.is_empty() {
            return self.no_data;
        }
        if value.abs() <= self.band {
            return self.neutral;
        }
        if value < self.low {
            return self.below;
        }
        if value > self.high {
            return self.above;
        }
        let at = (value - self.low) / (self.high - self.low) * steps.len() as f32;
        steps[(at as usize).min(steps.len() - 1)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lightness(c: Rgb) -> f64 {
        let l = linear(c).map(f64::from);
        0.2126 * l[0] + 0.7152 * l[1] + 0.0722 * l[2]
    }

    #[test]
    fn sequential_maps_grow_evenly_lighter() {
        for map in [Sequential::Viridis, Sequential::Cividis] {
            let steps: Vec<f64> = (0..=100).map(|k| lightness(map.color(f64::from(k) / 100.0))).collect();
            assert!(steps.windows(2).all(|w| w[1] > w[0]), "{map:?}");
        }
    }

    #[test]
    fn a_deviation_scale_is_neutral_in_its_band_and_distinct_outside_its_range() {
        let scale = ColorScale::deviation(1.0, 0.1);
        assert_eq!(scale.color(0.1), scale.neutral);
        assert_eq!(scale.color(-0.1), scale.neutral);
        assert_eq!(scale.color(1.01), scale.above);
        assert_eq!(scale.color(-1.01), scale.below);
        assert_eq!(scale.color(f32::NAN), scale.no_data);
        assert_eq!(scale.color(1.0), scale.steps[10]);
        assert_eq!(scale.color(-1.0), scale.steps[0]);
        // Eleven steps: the middle one is the sixth, and signs mirror each other.
        assert_eq!(scale.color(0.15), scale.steps[6]);
        assert_eq!(scale.color(-0.15), scale.steps[4]);
    }

    #[test]
    fn special_colours_look_like_no_step() {
        let scale = ColorScale::deviation(1.0, 0.1);
        let special = [scale.below, scale.above];
        for a in special {
            let far = |b: &Color| (0..3).map(|c| (a[c] - b[c]).abs()).fold(0.0, f32::max);
            assert!(scale.steps.iter().all(|s| far(s) > 0.1), "{a:?}");
        }
        // Red is over, blue is under.
        let [over, under] = [0.9, -0.9].map(|v| scale.color(v));
        assert!(over[0] > over[2] && under[2] > under[0]);
    }

    #[test]
    fn a_scale_without_extent_still_has_one() {
        assert!(ColorScale::deviation(0.0, 0.0).high > 0.0);
        let flat = ColorScale::sequential(2.0, 2.0);
        assert!(flat.high > flat.low);
    }
}
