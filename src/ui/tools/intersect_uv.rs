//! The intersection tools in the uv view: both preimages, and a cursor that moves its partners.

use std::sync::Arc;

use glam::DVec2;

use super::super::editor::Editor;
use super::super::panels::uv::UvPointer;
use super::Tool;
use super::intersect::IntersectSession;
use crate::view::intersection::cursor::nearest_uv;
use crate::view::intersection::domains::{item_of, pictures, runs};
use crate::view::intersection::{Found, Item, OnCurve};
use crate::view::uv::{UvDash, UvGlyph, UvInk, UvMark, UvPicture};

/// The pictures and what they were made for: revisions of drawing and cursor, and the theme.
pub type UvShown = ((u64, u64, bool), Vec<Arc<UvPicture>>);

impl IntersectSession {
    /// Makes the pictures again when something in them has changed.
    pub fn refresh_uv(&mut self, dark: bool) {
        let of = (self.revision, self.cursor_revision, dark);
        self.uv_waits = self.uv.as_ref().is_none_or(|(old, _)| *old != of);
        if !self.uv_waits {
            return;
        }
        let mut all = match &self.found {
            Some(found) => pictures(found, self.focus, self.cursor, dark),
            None => Vec::new(),
        };
        self.demo.mark(self, &mut all);
        self.biarc_marks(&mut all);
        self.other_marks(&mut all);
        self.uv = Some((of, all.into_iter().map(Arc::new).collect()));
    }

    /// The biarcs of the chosen curve, their arcs in two inks by turns.
    fn biarc_marks(&self, all: &mut [UvPicture]) {
        let (Some(Ok(fit)), Some(found)) = (self.biarcs.value(), &self.found) else { return };
        if self.chosen_curve() != Some(fit.curve) {
            return;
        }
        for biarc in &fit.drawn {
            let entity = found.id(biarc.number);
            let Some(picture) = all.iter_mut().find(|p| Some(p.entity) == entity) else { continue };
            for (arc, ink) in biarc.arcs.iter().zip([UvInk::Text, UvInk::Accent]) {
                picture.marks.push(UvMark::polyline(arc.clone()).ink(ink).width(1.5));
                if let Some(start) = arc.first() {
                    picture.marks.push(UvMark::point(*start, UvGlyph::Round).ink(ink).width(4.0));
                }
            }
        }
    }

    /// The other engine's curves.
    fn other_marks(&self, all: &mut [UvPicture]) {
        let Some(Ok(both)) = self.other.value() else { return };
        for picture in all {
            let Some(number) = both.other.number(picture.entity) else { continue };
            for curve in &both.other.result.curves {
                for side in 0..2 {
                    for run in runs(&both.other, &curve.points, number, side) {
                        let line = UvMark::polyline(run).ink(UvInk::Warn).width(2.0).dash(UvDash::Short);
                        picture.marks.push(line);
                    }
                }
            }
        }
    }

    /// What is shown in the uv view.
    pub fn uv_pictures(&self) -> Vec<Arc<UvPicture>> {
        self.uv.as_ref().map(|(_, pictures)| pictures.clone()).unwrap_or_default()
    }
}

impl Editor {
    /// What the mouse did in the uv view. Over the chosen curve the cursor follows, in space and in the other domain.
    pub fn intersect_uv_pointer(&mut self, pointer: Option<&UvPointer>) {
        let Tool::Intersect(session) = &mut self.tool else { return };
        let Some(found) = session.found.clone() else { return };
        let Some(pointer) = pointer else { return };
        let item = pointer.hit.and_then(|hit| item_of(hit.id));
        if session.focus.hovered != item {
            session.focus.hovered = item;
            session.changed();
        }
        let Some(item) = item else { return };
        let on = match item {
            Item::Curve(k) => on_curve(&found, k, pointer),
            _ => None,
        };
        if pointer.click.is_some() {
            session.choose(Some(item), on);
        } else if let Some(on) = on
            && session.chosen_curve() == Some(on.curve)
            && session.cursor != Some(on)
        {
            session.put_cursor(Some(on));
        }
    }
}

/// The place of a curve under the mouse.
fn on_curve(found: &Found, curve: usize, pointer: &UvPointer) -> Option<OnCurve> {
    let number = found.number(pointer.entity)?;
    let [u, v] = found.surface(number)?.domain();
    // Only the proportion of the two counts.
    let scale = DVec2::new(1.0 / (u[1] - u[0]), 1.0 / (v[1] - v[0]));
    let (_, on, _) = nearest_uv(found, number, pointer.uv, scale)?;
    (on.curve == curve).then_some(on)
}
