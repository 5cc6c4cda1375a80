//! Numbers as colours: the deviation map and the sequential maps.
//!
//! Deviation: diverging blue, white, red (ColorBrewer's RdBu, Harrower and Brewer, *ColorBrewer.org*, 2003), in steps.
//! The middle step is the neutral band: within the tolerance on either side. The other steps divide what is left up
//! to the range evenly. Beyond the range and without data there are colours that occur nowhere else; no data is
//! hatched as well, so that it is told by more than colour. Sequential fields take viridis or cividis (Nunez,
//! Anderton and Renslow, *Optimizing colormaps with consideration for color vision deficiency*, 2018): even
//! lightness, never a rainbow.

/// A colour in sRGB, 0..=1 each.
pub type Rgb = [f32; 3];

const fn hex(rgb: u32) -> Rgb {
    [(rgb >> 16 & 255) as f32 / 255.0, (rgb >> 8 & 255) as f32 / 255.0, (rgb & 255) as f32 / 255.0]
}

const BLUE_WHITE_RED: [Rgb; 11] = [
    hex(0x053061),
    hex(0x2166ac),
    hex(0x4393c3),
    hex(0x92c5de),
    hex(0xd1e5f0),
    hex(0xf7f7f7),
    hex(0xfddbc7),
    hex(0xf4a582),
    hex(0xd6604d),
    hex(0xb2182b),
    hex(0x67001f),
];
const VIRIDIS: [Rgb; 9] = [
    hex(0x440154),
    hex(0x472d7b),
    hex(0x3b528b),
    hex(0x2c728e),
    hex(0x21918c),
    hex(0x28ae80),
    hex(0x5ec962),
    hex(0xaddc30),
    hex(0xfde725),
];
const CIVIDIS: [Rgb; 5] = [hex(0x00204d), hex(0x414d6b), hex(0x7c7b78), hex(0xbcaf6f), hex(0xffea46)];

/// Above the range.
pub const ABOVE: Rgb = hex(0xd400d4);
/// Below the range.
pub const BELOW: Rgb = hex(0x00a8a8);
/// No data, hatched.
pub const NO_DATA: Rgb = hex(0x8a8a8a);

/// A colour as linear light, which is what the graphics card mixes.
pub fn linear(color: Rgb) -> Rgb {
    color.map(|c| if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) })
}

fn along(table: &[Rgb], t: f64) -> Rgb {
    let x = t.clamp(0.0, 1.0) * (table.len() - 1) as f64;
    let k = (x as usize).min(table.len() - 2);
    let f = (x - k as f64) as f32;
    [0, 1, 2].map(|c| table[k][c] + (table[k + 1][c] - table[k][c]) * f)
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

/// What a value looks like.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shade {
    /// A colour of the map: the number of the step and its colour.
    Step(usize, Rgb),
    /// Above the range.
    Above,
    /// Below the range.
    Below,
    /// There is no value.
    NoData,
}

impl Shade {
    /// The colour.
    pub fn color(self) -> Rgb {
        match self {
            Self::Step(_, color) => color,
            Self::Above => ABOVE,
            Self::Below => BELOW,
            Self::NoData => NO_DATA,
        }
    }

    /// Whether it is hatched.
    pub fn is_hatched(self) -> bool {
        self == Self::NoData
    }
}

/// The deviation map: signed lengths to colours.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeviationMap {
    tol: f64,
    range: f64,
    steps: usize,
}

impl DeviationMap {
    /// The map with the neutral band of plus and minus `tol` that reaches to plus and minus `range`, in `steps`
    /// steps (made odd, at least 3). A range within the tolerance is widened to twice the tolerance, and a
    /// tolerance that is no positive number is taken as a hundredth of the range.
    pub fn new(tol: f64, range: f64, steps: usize) -> Self {
        let range = if range > 0.0 && range.is_finite() { range } else { 0.0 };
        let tol = if tol > 0.0 && tol.is_finite() { tol } else { (0.01 * range).max(f64::MIN_POSITIVE) };
        let range = if range > tol { range } else { 2.0 * tol };
        Self { tol, range, steps: steps.max(3) | 1 }
    }

    /// Half the neutral band.
    pub fn tol(&self) -> f64 {
        self.tol
    }

    /// How far it reaches.
    pub fn range(&self) -> f64 {
        self.range
    }

    /// How many steps it has.
    pub fn steps(&self) -> usize {
        self.steps
    }

    /// The borders between the steps: `steps + 1` rising values from -range to range.
    pub fn borders(&self) -> Vec<f64> {
        let half = self.steps / 2;
        let side = |k: usize| self.tol + (self.range - self.tol) * k as f64 / half as f64;
        (0..=half).rev().map(|k| -side(k)).chain((0..=half).map(side)).collect()
    }

    /// The colour of a step.
    pub fn step_color(&self, step: usize) -> Rgb {
        along(&BLUE_WHITE_RED, step as f64 / (self.steps - 1) as f64)
    }

    /// What a signed deviation looks like. Borders belong to the step nearer to the middle.
    pub fn shade(&self, value: Option<f64>) -> Shade {
        let Some(value) = value.filter(|v| !v.is_nan()) else { return Shade::NoData };
        let size = value.abs();
        if size > self.range {
            return if value > 0.0 { Shade::Above } else { Shade::Below };
        }
        let half = self.steps / 2;
        let out = if size <= self.tol {
            0
        } else {
            let x = (size - self.tol) / (self.range - self.tol) * half as f64;
            (x.ceil() as usize).clamp(1, half)
        };
        let step = if value < 0.0 { half - out } else { half + out };
        Shade::Step(step, self.step_color(step))
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
    fn the_neutral_band_is_the_tolerance_and_nothing_else() {
        let map = DeviationMap::new(0.1, 1.0, 11);
        let middle = map.shade(Some(0.0));
        for v in [-0.1, -0.05, 0.1] {
            assert_eq!(map.shade(Some(v)), middle);
        }
        for v in [-0.1001, 0.1001] {
            assert_ne!(map.shade(Some(v)), middle);
        }
        assert!(lightness(middle.color()) > 0.9);
    }

    #[test]
    fn steps_are_as_many_as_asked_and_mirror_each_other() {
        let map = DeviationMap::new(0.1, 1.0, 11);
        let mut steps = Vec::new();
        for k in -1000..=1000 {
            let v = f64::from(k) / 1000.0;
            let (Shade::Step(a, _), Shade::Step(b, _)) = (map.shade(Some(v)), map.shade(Some(-v))) else {
                panic!("{v} is in range")
            };
            assert_eq!(a + b, 10);
            steps.push(a);
        }
        steps.dedup();
        assert_eq!(steps, (0..11).collect::<Vec<_>>());
        let borders = map.borders();
        assert_eq!(borders.len(), 12);
        for (k, pair) in borders.windows(2).enumerate() {
            let inside = 0.5 * (pair[0] + pair[1]);
            assert!(pair[0] < pair[1] && matches!(map.shade(Some(inside)), Shade::Step(s, _) if s == k));
        }
        // Red is over, blue is under.
        let [over, under] = [0.9, -0.9].map(|v| map.shade(Some(v)).color());
        assert!(over[0] > over[2] && under[2] > under[0]);
    }

    #[test]
    fn out_of_range_and_no_data_look_like_nothing_else() {
        let map = DeviationMap::new(0.1, 1.0, 11);
        assert_eq!(map.shade(Some(1.01)), Shade::Above);
        assert_eq!(map.shade(Some(f64::NEG_INFINITY)), Shade::Below);
        assert!(map.shade(None).is_hatched() && map.shade(Some(f64::NAN)).is_hatched());
        let special = [ABOVE, BELOW, NO_DATA];
        for a in special {
            let far = |b: Rgb| (0..3).map(|c| (a[c] - b[c]).abs()).fold(0.0, f32::max);
            assert!((0..11).all(|s| far(map.step_color(s)) > 0.2));
            assert!(special.iter().filter(|b| far(**b) > 0.2).count() == 2);
        }
    }

    #[test]
    fn no_numbers_break_a_map() {
        for (tol, range) in [(0.0, 1.0), (1.0, 0.5), (f64::NAN, f64::NAN), (-1.0, f64::INFINITY), (0.0, 0.0)] {
            let map = DeviationMap::new(tol, range, 0);
            assert!(map.tol() > 0.0 && map.range() > map.tol() && map.steps() == 3);
            assert!(matches!(map.shade(Some(0.0)), Shade::Step(1, _)));
        }
    }
}
