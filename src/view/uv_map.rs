//! Where a parameter pair is in the uv view: u to the right, v upwards, moved and magnified by hand.
//!
//! The domain is stretched to the pane within a limit of its aspect, because parameters of u and v need not be
//! commensurable. [`UvNavigation`] is kept between frames and is relative to the pane, so that resizing keeps what is
//! seen; [`UvMap`] is the mapping of one frame, affine in each direction.

use glam::DVec2;

/// Pixels left free beside and above a domain that fits: there is room for numbers.
const MARGIN: DVec2 = DVec2::new(46.0, 26.0);
/// How much longer one side of the drawn domain may be than the other.
const ASPECT: f64 = 2.4;
/// The largest magnification: a millionth of the domain fills the pane.
const CLOSEST: f64 = 1e6;

/// What part of the domain is seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UvNavigation {
    /// How much larger than fitted, at least 0.5.
    pub zoom: f64,
    /// The middle of the pane in fractions of the domain.
    pub center: DVec2,
}

impl Default for UvNavigation {
    fn default() -> Self {
        Self { zoom: 1.0, center: DVec2::splat(0.5) }
    }
}

impl UvNavigation {
    /// Shows a box of parameters, low and high corner, as large as leaves some room around it.
    pub fn around(domain: [[f64; 2]; 2], [low, high]: [DVec2; 2]) -> Self {
        /// The part of the fitted domain that the box takes.
        const PART: f64 = 0.7;
        let from = DVec2::new(domain[0][0], domain[1][0]);
        let extent = DVec2::new(domain[0][1], domain[1][1]) - from;
        let share = ((high - low) / extent).abs().max_element();
        let zoom = if share > 0.0 { (PART / share).clamp(0.5, CLOSEST) } else { CLOSEST };
        let center = ((0.5 * (low + high) - from) / extent).clamp(DVec2::ZERO, DVec2::ONE);
        if zoom.is_finite() && center.is_finite() { Self { zoom, center } } else { Self::default() }
    }
}

/// From parameters to pixels of the pane (from its upper left corner, y downwards) and back.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UvMap {
    low: DVec2,
    extent: DVec2,
    /// Pixels for the whole domain.
    span: DVec2,
    size: DVec2,
    navigation: UvNavigation,
}

impl UvMap {
    /// The map of a domain `[[u0, u1], [v0, v1]]` into a pane of `size` pixels.
    pub fn new(domain: [[f64; 2]; 2], size: DVec2, navigation: UvNavigation) -> Self {
        let low = DVec2::new(domain[0][0], domain[1][0]);
        let extent = DVec2::new(domain[0][1], domain[1][1]) - low;
        let extent = DVec2::select(extent.cmpgt(DVec2::ZERO), extent, DVec2::ONE);
        let room = (size - 2.0 * MARGIN).max(DVec2::splat(16.0));
        let fitted = room.min(DVec2::new(room.y, room.x) * ASPECT);
        Self { low, extent, span: fitted * navigation.zoom, size, navigation }
    }

    /// The pixel of a parameter pair.
    pub fn to_pixel(&self, uv: DVec2) -> DVec2 {
        let off = ((uv - self.low) / self.extent - self.navigation.center) * self.span;
        0.5 * self.size + DVec2::new(off.x, -off.y)
    }

    /// The parameter pair at a pixel; it may lie outside the domain.
    pub fn to_uv(&self, pixel: DVec2) -> DVec2 {
        let off = pixel - 0.5 * self.size;
        self.low + (self.navigation.center + DVec2::new(off.x, -off.y) / self.span) * self.extent
    }

    /// The part of the parameter plane that the pane shows: low and high corner.
    pub fn seen(&self) -> [DVec2; 2] {
        let [a, b] = [self.to_uv(DVec2::ZERO), self.to_uv(self.size)];
        [a.min(b), a.max(b)]
    }

    /// Pixels per unit of u and of v.
    pub fn scale(&self) -> DVec2 {
        self.span / self.extent
    }

    /// The navigation after magnifying by `factor` about a pixel, whose parameters stay where they are.
    pub fn zoomed(&self, pixel: DVec2, factor: f64) -> UvNavigation {
        let zoom = (self.navigation.zoom * factor).clamp(0.5, CLOSEST);
        let factor = zoom / self.navigation.zoom;
        let off = pixel - 0.5 * self.size;
        let held = self.navigation.center + DVec2::new(off.x, -off.y) / self.span;
        UvNavigation { zoom, center: self.kept(held + (self.navigation.center - held) / factor) }
    }

    /// The navigation after dragging what is seen by some pixels.
    pub fn panned(&self, by: DVec2) -> UvNavigation {
        let center = self.navigation.center - DVec2::new(by.x, -by.y) / self.span;
        UvNavigation { center: self.kept(center), ..self.navigation }
    }

    /// The middle stays on the domain, so that it cannot be lost.
    fn kept(&self, center: DVec2) -> DVec2 {
        center.clamp(DVec2::ZERO, DVec2::ONE)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DOMAIN: [[f64; 2]; 2] = [[-2.0, 6.0], [10.0, 11.0]];
    const SIZE: DVec2 = DVec2::new(400.0, 240.0);

    #[test]
    fn a_box_that_is_gone_to_is_in_the_middle_of_the_pane_and_fills_most_of_it() {
        let (low, high) = (DVec2::new(1.0, 10.25), DVec2::new(1.002, 10.2501));
        let map = UvMap::new(DOMAIN, SIZE, UvNavigation::around(DOMAIN, [low, high]));
        let [a, b] = [low, high].map(|uv| map.to_pixel(uv));
        assert!((0.5 * (a + b)).distance(0.5 * SIZE) < 1e-6);
        assert!((b - a).abs().max_element() > 80.0 && (b - a).abs().cmplt(SIZE).all());
        assert_eq!(UvNavigation::around(DOMAIN, [low, low]).zoom, CLOSEST);
    }

    #[test]
    fn a_fitted_domain_is_inside_the_pane_with_u_to_the_right_and_v_up() {
        let map = UvMap::new(DOMAIN, SIZE, UvNavigation::default());
        let (low, high) = (map.to_pixel(DVec2::new(-2.0, 10.0)), map.to_pixel(DVec2::new(6.0, 11.0)));
        assert!(low.x >= 20.0 && high.x <= 380.0 && high.y >= 20.0 && low.y <= 220.0);
        assert!(high.x > low.x && high.y < low.y);
        assert_eq!(map.to_pixel(DVec2::new(2.0, 10.5)), 0.5 * SIZE);
        let [a, b] = map.seen();
        assert!(a.x < -2.0 && b.x > 6.0 && a.y < 10.0 && b.y > 11.0);
    }

    #[test]
    fn the_aspect_of_what_is_drawn_is_limited() {
        let map = UvMap::new(DOMAIN, DVec2::new(1600.0, 200.0), UvNavigation::default());
        let size = map.to_pixel(DVec2::new(6.0, 10.0)) - map.to_pixel(DVec2::new(-2.0, 11.0));
        assert!((size.x / size.y - ASPECT).abs() < 1e-12, "{size}");
    }

    #[test]
    fn pixels_and_parameters_go_there_and_back() {
        let map = UvMap::new(DOMAIN, SIZE, UvNavigation { zoom: 37.0, center: DVec2::new(0.2, 0.9) });
        for uv in [DVec2::new(-2.0, 10.0), DVec2::new(0.1, 10.7), DVec2::new(7.0, 9.0)] {
            assert!(map.to_uv(map.to_pixel(uv)).distance(uv) < 1e-12);
        }
    }

    #[test]
    fn magnifying_holds_what_is_under_the_cursor_and_panning_what_was_grabbed() {
        let map = UvMap::new(DOMAIN, SIZE, UvNavigation { zoom: 3.0, center: DVec2::splat(0.4) });
        let at = DVec2::new(120.0, 200.0);
        let uv = map.to_uv(at);
        let closer = UvMap::new(DOMAIN, SIZE, map.zoomed(at, 1.7));
        assert!(closer.to_pixel(uv).distance(at) < 1e-9);
        assert!((closer.scale() / map.scale() - 1.7).length() < 1e-12);
        let by = DVec2::new(13.0, -21.0);
        let moved = UvMap::new(DOMAIN, SIZE, map.panned(by));
        assert!(moved.to_pixel(uv).distance(at + by) < 1e-9);
        // However far it is dragged, some of the domain stays in the middle.
        let lost = map.panned(DVec2::new(1e9, 1e9));
        assert_eq!(lost.center, DVec2::new(0.0, 1.0));
    }

    #[test]
    fn a_domain_without_extent_still_has_a_map() {
        let map = UvMap::new([[1.0, 1.0], [0.0, 0.0]], DVec2::ZERO, UvNavigation::default());
        assert!(map.to_pixel(DVec2::new(1.0, 0.0)).is_finite() && map.to_uv(DVec2::ONE).is_finite());
    }
}
