//! Colours: the patch palette, mixing, and the way back to sRGB bytes. Scales that turn numbers into colours are
//! [`crate::view::colormap`]'s.

pub use crate::view::colormap::{Color, ColorScale, MAX_STEPS, srgb};

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn srgb_bytes_survive_the_way_through_linear_light() {
        for c in 0..=255u32 {
            assert_eq!(to_srgb8(srgb(c << 16 | c << 8 | c)), [c as u8, c as u8, c as u8, 255]);
        }
    }
}
