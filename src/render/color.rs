//! Colours: linear RGBA, the patch palette, and scales that turn numbers into colours.
//!
//! The same [`ColorScale`] feeds the surface shader and the legend, so that both always agree.

/// Linear RGBA, not premultiplied.
pub type Color = [f32; 4];

/// The colour written `0xRRGGBB` in sRGB, opaque.
pub fn srgb(hex: u32) -> Color {
    let channel = |shift: u32| {
        let c = ((hex >> shift) & 0xff) as f32 / 255.0;
        if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
    };
    [channel(16), channel(8), channel(0), 1.0]
}

/// The colour as sRGB bytes with alpha, for everything that draws outside this room (legends, chips).
pub fn to_srgb8(color: Color) -> [u8; 4] {
    let channel = |c: f32| {
        let c = c.clamp(0.0, 1.0);
        let s = if c <= 0.003_130_8 { c * 12.92 } else { 1.055 * c.powf(1.0 / 2.4) - 0.055 };
        (s * 255.0).round() as u8
    };
    let [r, g, b, a] = color;
    [channel(r), channel(g), channel(b), (a.clamp(0.0, 1.0) * 255.0).round() as u8]
}

/// The same colour with another alpha.
pub fn with_alpha([r, g, b, _]: Color, alpha: f32) -> Color {
    [r, g, b, alpha]
}

/// From `a` at 0 to `b` at 1, per channel in linear light.
pub fn mix(a: Color, b: Color, t: f32) -> Color {
    std::array::from_fn(|k| a[k] + (b[k] - a[k]) * t)
}

/// Surface colours in sRGB, told apart at a glance and calm under light; entity n takes colour n modulo 10.
pub const PALETTE: [u32; 10] =
    [0x8fb3d9, 0xe3b587, 0x9ccb9f, 0xd7a0b4, 0xb5a8d8, 0x8ecbc9, 0xd9c87a, 0xc2b2a3, 0xa3b1c2, 0xb8cf85];

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

/// Blue to white to red, CIELAB-symmetric after Brewer's RdBu in 11 classes.
const BLUE_RED: [u32; 11] =
    [0x1b4f8f, 0x2f79b5, 0x5a9fcc, 0x93c4df, 0xc9e0ee, 0xf5f5f2, 0xfbd9c4, 0xf3ac88, 0xdc7258, 0xbd3337, 0x8c0f26];

/// Viridis (van der Walt and Smith 2015) at eleven places.
const VIRIDIS: [u32; 11] =
    [0x440154, 0x482576, 0x414487, 0x35608d, 0x2a788e, 0x21918c, 0x22a884, 0x43bf71, 0x7ad151, 0xbcdf27, 0xfde725];

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
            below: srgb(0x3b1f7a),
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

    #[test]
    fn srgb_bytes_survive_the_way_through_linear_light() {
        for c in 0..=255u32 {
            assert_eq!(to_srgb8(srgb(c << 16 | c << 8 | c)), [c as u8, c as u8, c as u8, 255]);
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
    fn a_scale_without_extent_still_has_one() {
        assert!(ColorScale::deviation(0.0, 0.0).high > 0.0);
        let flat = ColorScale::sequential(2.0, 2.0);
        assert!(flat.high > flat.low);
    }
}
