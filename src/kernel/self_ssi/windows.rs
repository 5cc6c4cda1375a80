//! What is proved about windows against themselves, remembered: injective, one miter point and its branch only, or one
//! cusp edge only. The proofs are in [`super::window`], [`super::degenerate`] and [`super::cusp`].

use std::collections::HashMap;

use super::cusp::{CuspEdge, CuspWindow, cusp_window};
use super::degenerate;
use super::hull::Rect;
use super::miter::{MiterKind, MiterPoint};
use super::record::NodeState;
use super::sheet::Sheet;
use super::window::{cross_cap, injective};

/// A rectangle as the key of a table.
pub(crate) type Key = [u64; 4];

/// The key of a rectangle.
pub(crate) fn key(rect: &Rect) -> Key {
    [rect.low.x, rect.low.y, rect.high.x, rect.high.y].map(f64::to_bits)
}

/// The windows that were looked at.
pub(crate) struct Windows<'a> {
    sheet: &'a Sheet,
    miters: &'a [MiterPoint],
    cusps: &'a [CuspEdge],
    injective: HashMap<Key, bool>,
    capped_window: HashMap<Key, bool>,
    cusp_window: HashMap<Key, Option<CuspWindow>>,
    /// Windows that were tested for injectivity.
    pub tested: usize,
    /// Those that were not proved injective.
    pub failed: usize,
    /// Windows folded onto themselves along the cusp edge with this number.
    pub folds: Vec<(usize, Rect)>,
}

impl<'a> Windows<'a> {
    pub fn new(sheet: &'a Sheet, miters: &'a [MiterPoint], cusps: &'a [CuspEdge]) -> Self {
        Self {
            sheet,
            miters,
            cusps,
            injective: HashMap::new(),
            capped_window: HashMap::new(),
            cusp_window: HashMap::new(),
            tested: 0,
            failed: 0,
            folds: Vec::new(),
        }
    }

    /// What is special about a tiny window that could not be proved, in words for people.
    pub fn why_open(&self, rect: &Rect) -> Option<&'static str> {
        /// How far from a cusp edge, in the parameters of the unit domain.
        const BESIDE: f64 = 1e-2;
        if self.sheet.pole_at(rect).is_some() {
            return Some("a side runs together in a pole here at which sheets are not steep enough to be told apart");
        }
        let mut nodes = self.cusps.iter().flat_map(CuspEdge::nodes);
        nodes.any(|n| n.at.distance(rect.center()) < BESIDE).then_some(
            "a cusp edge begins, ends or turns back here (a swallowtail); what lies around it could not be decided",
        )
    }

    /// What was proved about a window for which [`Self::proved`] is true.
    pub fn state(&self, rect: &Rect) -> NodeState {
        let k = key(rect);
        if self.injective.get(&k) == Some(&true) {
            NodeState::Injective
        } else if self.cusp_window.get(&k).is_some_and(Option::is_some) {
            NodeState::CuspEdge
        } else {
            NodeState::MiterPoint
        }
    }

    /// Whether a window is proved injective, or to hold one miter point's branch only.
    pub fn proved(&mut self, rect: &Rect) -> bool {
        let k = key(rect);
        let proved = match self.injective.get(&k) {
            Some(&known) => known,
            None => {
                self.tested += 1;
                let proved = injective(&self.sheet.window_frames(rect));
                self.injective.insert(k, proved);
                if !proved {
                    self.failed += 1;
                }
                proved
            }
        };
        proved || self.miter_window(rect) || self.window_at_cusp(rect)
    }

    /// Whether the window, grown to three times its size, holds exactly one miter point and only its branch.
    fn miter_window(&mut self, rect: &Rect) -> bool {
        if let Some(&known) = self.capped_window.get(&key(rect)) {
            return known;
        }
        let around = rect.grown(1.0);
        let mut inside = self
            .miters
            .iter()
            .flat_map(|m| self.sheet.images(m.at).map(move |at| (at, m)))
            .filter(|(at, _)| around.contains(*at));
        let only = inside.next();
        let proved = match (only, inside.next()) {
            (Some((_, m)), None) if m.kind == MiterKind::CrossCap => {
                cross_cap(&around, &self.sheet.jets(&around), m.null(), m.first, m.second)
            }
            (Some((at, m)), None) => {
                // A copy across a seam: the window moves to the point itself.
                degenerate::settled(self.sheet, &rect.shifted(m.at - at), m)
            }
            _ => false,
        };
        self.capped_window.insert(key(rect), proved);
        proved
    }

    /// Whether the window holds a cusp edge and nothing else; folds are noted.
    fn window_at_cusp(&mut self, rect: &Rect) -> bool {
        if self.cusps.is_empty() {
            return false;
        }
        let known = self.cusp_window.get(&key(rect)).copied();
        let found = known.unwrap_or_else(|| {
            let found = cusp_window(self.sheet, self.cusps, rect);
            self.cusp_window.insert(key(rect), found);
            if let Some(CuspWindow::Folded(edge)) = found {
                self.folds.push((edge, *rect));
            }
            found
        });
        found.is_some()
    }
}
