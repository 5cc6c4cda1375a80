//! Display percentages (sRGB) and linear values of colours.

/// The linear value of a display percentage (sRGB).
pub fn linear_of_percent(percent: f64) -> f32 {
    let s = (percent / 100.0).clamp(0.0, 1.0);
    (if s <= 0.04045 { s / 12.92 } else { ((s + 0.055) / 1.055).powf(2.4) }) as f32
}

/// The display percentage (sRGB) of a linear value; [`linear_of_percent`] gives the same `f32` back.
pub fn percent_of_linear(linear: f32) -> f64 {
    let l = f64::from(linear).clamp(0.0, 1.0);
    100.0 * (if l <= 0.003_130_8 { 12.92 * l } else { 1.055 * l.powf(1.0 / 2.4) - 0.055 })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_survive_the_way_out_and_back() {
        for i in 0..=1000u16 {
            let value = f32::from(i) / 1000.0;
            assert_eq!(linear_of_percent(percent_of_linear(value)), value);
        }
    }
}
