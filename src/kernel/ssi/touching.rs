//! Points in which the surfaces touch: polished on the exact surfaces, or told from an open gap all around.

use glam::DVec3;

use super::binormal;
use super::boxes;
use super::contact::{Cell, Findings};
use super::correct::PointPair;
use super::engine::Engine;
use super::junction::{Contacted, arms_of, is_point};
use super::tangency::from_tori;
use crate::kernel::job::Job;

impl Engine {
    /// Polishes critical points on the exact surfaces and finds the arms of those that are contacts.
    pub(super) fn find_contacts(&mut self, findings: &Findings, job: &Job) {
        let mut found: Vec<(binormal::Binormal, [usize; 2], bool)> = Vec::new();
        for critical in &findings.criticals {
            if job.is_cancelled() {
                return;
            }
            let (a, b) = (&self.sides[0].pieces[critical.pa], &self.sides[1].pieces[critical.pb]);
            if self.in_contact(a.point(critical.at.uv)) {
                continue; // that of a pole
            }
            // From the gap's own critical point, else from the binormals of the osculating tori (thesis 5.3).
            let polished = binormal::polish(a, b, critical.at, 0.02, false);
            let Some(point) = polished.or_else(|| from_tori(a, b, critical.at)) else {
                self.give_up([critical.pa, critical.pb], critical.at, "a point of contact could not be polished");
                continue;
            };
            let slack = 1e-6;
            let x = point.at.to_array();
            if point.gap.abs() > self.gap || x.iter().any(|&v| !(-slack..=1.0 + slack).contains(&v)) {
                continue;
            }
            if self.in_contact(point.p) {
                continue;
            }
            let same = |other: &binormal::Binormal| other.p.distance(point.p) < 1e-6;
            if !found.iter().any(|(other, ..)| same(other)) {
                found.push((point, [critical.pa, critical.pb], critical.extremum));
            }
        }
        let centers: Vec<DVec3> = found.iter().map(|(f, ..)| f.p).collect();
        for (k, (point, pair, extremum)) in found.into_iter().enumerate() {
            let others = centers.iter().enumerate().filter(|&(j, _)| j != k).map(|(_, c)| c.distance(point.p));
            let radius = others.fold(0.02, |r: f64, d| r.min(0.3 * d));
            let at = point.at;
            if extremum {
                self.contacts.push(Contacted { binormal: point, pair, radius: 1e-7, arms: Vec::new() });
                continue;
            }
            match arms_of([&self.sides[0], &self.sides[1]], point, pair, radius, self.trace.joining) {
                Some(contact) => self.contacts.push(contact),
                None => self.give_up(pair, at, "the arms of a junction could not be told apart"),
            }
        }
    }

    /// Whether a point lies in the disc of a contact.
    pub(super) fn in_contact(&self, p: DVec3) -> bool {
        self.contacts.iter().any(|c| c.binormal.p.distance(p) < c.radius)
    }

    /// The same of a contact that no curve runs into.
    pub(super) fn is_isolated(&self, p: DVec3) -> bool {
        self.contacts.iter().any(|c| c.arms.is_empty() && c.binormal.p.distance(p) < c.radius)
    }

    /// Contacts of higher order: clusters of cells in which the gap vanishes or nothing was decided, with an open gap
    /// all around. Returns the cells that are left.
    pub(super) fn flat_contacts(&mut self, findings: &Findings) -> (Vec<Cell>, Vec<Cell>) {
        let cells: Vec<&Cell> = findings.coincident.iter().chain(&findings.undecided).collect();
        let place = |c: &Cell| {
            let piece = &self.sides[0].pieces[c.pa];
            let p = piece.point(c.middle.uv);
            (p, p.distance(piece.point(c.low)).max(p.distance(piece.point(c.high))))
        };
        let places: Vec<(DVec3, f64)> = cells.iter().map(|c| place(c)).collect();
        // Cells that touch belong together. Large cells are regions, never points.
        let mut done = vec![false; cells.len()];
        for members in boxes::clusters(&places) {
            let center = members.iter().map(|&m| places[m].0).sum::<DVec3>() / members.len() as f64;
            let extent = members.iter().map(|&m| places[m].0.distance(center) + places[m].1).fold(0.0, f64::max);
            if extent > 0.02 {
                continue;
            }
            if self.is_isolated(center) {
                members.iter().for_each(|&m| done[m] = true);
                continue;
            }
            let nearest =
                members.iter().min_by(|&&x, &&y| places[x].0.distance(center).total_cmp(&places[y].0.distance(center)));
            if nearest.is_some_and(|&m| self.flat_contact([cells[m].pa, cells[m].pb], cells[m].middle, extent)) {
                members.iter().for_each(|&m| done[m] = true);
            }
        }
        let split = findings.coincident.len();
        let left = |range: std::ops::Range<usize>| range.filter(|&k| !done[k]).map(|k| *cells[k]).collect();
        (left(0..split), left(split..cells.len()))
    }

    /// Takes a small closed spot for a point contact when the gap is open around it.
    pub(super) fn flat_contact(&mut self, pair: [usize; 2], at: PointPair, extent: f64) -> bool {
        let (a, b) = (&self.sides[0].pieces[pair[0]], &self.sides[1].pieces[pair[1]]);
        let Some((point, _)) = binormal::look(a, b, at) else { return false };
        let sides = [&self.sides[0], &self.sides[1]];
        let mut radius = (2.0 * extent).max(1e-3);
        let joining = self.trace.joining;
        while !is_point(sides, &point, pair, 0.25 * radius, joining, self.gap) {
            radius *= 1.5;
            if radius > 0.2 {
                return false;
            }
        }
        match arms_of(sides, point, pair, radius, joining) {
            Some(contact) if contact.radius > 0.9 * radius => {
                self.contacts.push(contact);
                true
            }
            _ => false,
        }
    }
}
