//! Bounds of the first, second and third derivatives over a rectangle of the domain.

use glam::{DVec2, DVec3};

use super::hull::{Hull, Rect, range};
use super::net::{derivative, differences, elevated};
use super::rational::Quotient;
use super::sheet::Sheet;

/// Bounds of Su, Sv, Suu, Suv, Svv together.
#[derive(Clone, Debug)]
pub(crate) enum Jets {
    /// The five derivatives at each point lie in the convex hull of these five-tuples.
    Joint(Vec<[DVec3; 5]>),
    /// Each derivative lies in the convex hull of its own points.
    Apart([Vec<DVec3>; 5]),
}

impl Jets {
    /// The range of `y . (c0 Su + c1 Sv + c2 Suu + c3 Suv + c4 Svv)`.
    pub fn range(&self, y: DVec3, c: [f64; 5]) -> [f64; 2] {
        match self {
            Self::Joint(points) => points.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], d| {
                let value = (0..5).map(|k| c[k] * y.dot(d[k])).sum::<f64>();
                [low.min(value), high.max(value)]
            }),
            Self::Apart(points) => (0..5).filter(|&k| c[k] != 0.0).fold([0.0; 2], |[low, high], k| {
                let [a, b] = range(y, &points[k]);
                let (a, b) = if c[k] >= 0.0 { (a * c[k], b * c[k]) } else { (b * c[k], a * c[k]) };
                [low + a, high + b]
            }),
        }
    }
}

/// Points around the second derivatives: uu, uv, vv.
#[derive(Clone, Debug, Default)]
pub(crate) struct SecondHull(pub [Vec<DVec3>; 3]);

impl Sheet {
    /// Bounds of the first and second derivatives over a rectangle of the surface.
    pub fn jets(&self, rect: &Rect) -> Jets {
        self.jets_of(&self.parts(rect))
    }

    /// The same on one piece, continued where the rectangle leaves it.
    pub fn jets_on(&self, piece: usize, rect: &Rect) -> Jets {
        self.jets_of(&[(piece, *rect)])
    }

    fn jets_of(&self, parts: &[(usize, Rect)]) -> Jets {
        if self.rational {
            let mut all: [Vec<DVec3>; 5] = Default::default();
            for (piece, part) in parts {
                let hull = self.hull_on(*piece, part);
                all[0].extend(hull.du);
                all[1].extend(hull.dv);
                for (k, points) in self.second_hull_on(*piece, part).0.into_iter().enumerate() {
                    all[2 + k].extend(points);
                }
            }
            return Jets::Apart(all);
        }
        let [p, q] = self.degree;
        let mut all = Vec::new();
        for (piece, part) in parts {
            let part = self.enlarged(*piece, part);
            let size = part.size();
            let pos: Vec<DVec3> = self.net(*piece, &part).iter().map(|h| h.truncate()).collect();
            let (du, dv) = (self.differences(&pos, 0, size.x), self.differences(&pos, 1, size.y));
            let uu = differences(&du, p, q + 1, 0, p - 1, size.x);
            let uv = differences(&du, p, q + 1, 1, q, size.y);
            let vv = differences(&dv, p + 1, q, 1, q - 1, size.y);
            let nets = [
                elevated(&du, [p - 1, q], [p, q]),
                elevated(&dv, [p, q - 1], [p, q]),
                if p > 1 { elevated(&uu, [p - 2, q], [p, q]) } else { vec![DVec3::ZERO; (p + 1) * (q + 1)] },
                elevated(&uv, [p - 1, q - 1], [p, q]),
                if q > 1 { elevated(&vv, [p, q - 2], [p, q]) } else { vec![DVec3::ZERO; (p + 1) * (q + 1)] },
            ];
            all.extend((0..(p + 1) * (q + 1)).map(|k| [0, 1, 2, 3, 4].map(|n: usize| nets[n][k])));
        }
        Jets::Joint(all)
    }

    /// Tiny rectangles enlarged, because second differences of nearly equal control points are rounding.
    fn enlarged(&self, piece: usize, rect: &Rect) -> Rect {
        let half = (rect.size() * 0.5).max(self.pieces[piece].size() * 1e-4);
        Rect::new(rect.center() - half, rect.center() + half)
    }

    /// Bounds of the second derivatives over a rectangle of the surface.
    pub fn second_hull(&self, rect: &Rect) -> SecondHull {
        let mut all = SecondHull::default();
        for (piece, part) in self.parts(rect) {
            for (sum, one) in all.0.iter_mut().zip(self.second_hull_on(piece, &part).0) {
                sum.extend(one);
            }
        }
        all
    }

    /// Bounds of the second derivatives over a rectangle on one piece.
    fn second_hull_on(&self, piece: usize, rect: &Rect) -> SecondHull {
        let rect = &self.enlarged(piece, rect);
        let net = self.net(piece, rect);
        let size = rect.size();
        if !self.rational {
            let pos: Vec<DVec3> = net.iter().map(|h| h.truncate()).collect();
            let (p, q) = (self.degree[0], self.degree[1]);
            let du = self.differences(&pos, 0, size.x);
            let dv = self.differences(&pos, 1, size.y);
            let uu = differences(&du, p, q + 1, 0, p - 1, size.x);
            let uv = differences(&du, p, q + 1, 1, q, size.y);
            let vv = differences(&dv, p + 1, q, 1, q - 1, size.y);
            return SecondHull([uu, uv, vv]);
        }
        match Quotient::new(self, &net, size) {
            Some(q) => {
                SecondHull([q.second(0, 0, 0).corners(), q.second(1, 0, 1).corners(), q.second(2, 1, 1).corners()])
            }
            None => SecondHull([0; 3].map(|_| Hull::everything().du)),
        }
    }

    /// Points around the third derivatives uuu, uuv, uvv, vvv over a rectangle. `None` across borders of pieces without
    /// two continuous derivatives.
    pub fn third_hull(&self, rect: &Rect) -> Option<[Vec<DVec3>; 4]> {
        let parts = self.parts(rect);
        if parts.len() > 1 && !self.twice_smooth(rect) {
            return None;
        }
        let mut all: [Vec<DVec3>; 4] = Default::default();
        for (piece, part) in parts {
            let part = self.enlarged(piece, &part);
            let net = self.net(piece, &part);
            if self.rational {
                let third = Quotient::new(self, &net, part.size())?.third(self, &net, part.size());
                for (points, bounds) in all.iter_mut().zip(third) {
                    points.extend(bounds.corners());
                }
                continue;
            }
            let pos: Vec<DVec3> = net.iter().map(|h| h.truncate()).collect();
            for (k, points) in all.iter_mut().enumerate() {
                points.extend(derivative(&pos, self.degree, [3 - k, k], part.size()));
            }
        }
        Some(all)
    }

    /// Whether second derivatives are continuous across the borders of pieces inside a rectangle: compared at points.
    fn twice_smooth(&self, rect: &Rect) -> bool {
        let step = 1.0 / 8.0;
        (0..2).all(|d| {
            let turns = rect.low[d].floor() as i64..=rect.high[d].floor() as i64;
            turns.flat_map(|turn| self.breaks[d].iter().map(move |b| b + turn as f64)).all(|line| {
                let open = line <= 0.0 || line >= 1.0;
                if line <= rect.low[d] || line >= rect.high[d] || (open && !self.periodic[d]) {
                    return true;
                }
                (0..=8).all(|k| {
                    let other = rect.low[1 - d] + rect.size()[1 - d] * f64::from(k) * step;
                    let at = |by: f64| {
                        let mut p = DVec2::splat(other);
                        p[d] = line + by;
                        self.wrapped(p)
                    };
                    let [a, b] = [-1e-9, 1e-9].map(|by| self.jet(at(by), 2));
                    let size = a.dd.iter().map(|x| x.length()).fold(0.0, f64::max);
                    a.dd.iter().zip(&b.dd).all(|(x, y)| x.distance(*y) <= 1e-5 * (1.0 + size))
                })
            })
        })
    }
}
