//! Rounding `f64` to `f32` towards a side.

/// The largest `f32` that is not above `x`.
pub fn down(x: f64) -> f32 {
    let near = x as f32;
    if f64::from(near) > x { near.next_down() } else { near }
}

/// The smallest `f32` that is not below `x`.
pub fn up(x: f64) -> f32 {
    -down(-x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounding_never_crosses_and_is_tight() {
        for x in [0.1, -0.1, 1.0, 1e-45, -1e-50, 3.5e38, f64::from(f32::MAX), 1.0 + 1e-12] {
            let (low, high) = (down(x), up(x));
            assert!(f64::from(low) <= x && x <= f64::from(high), "{x}");
            assert!(low == high || low.next_up() == high, "{x}");
        }
    }
}
