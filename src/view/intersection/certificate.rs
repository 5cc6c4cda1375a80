//! The coverage certificate in plain words: what was proved, and what was not.

use std::collections::BTreeMap;

use super::Found;
use crate::kernel::intersect::Engine;
use crate::kernel::ssi::result::{CurveEnd, Intersection};

/// How good the news is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// Every place was decided.
    Proved,
    /// Something is open.
    Open,
    /// The computation was stopped.
    Stopped,
}

/// The certificate.
#[derive(Clone, Debug, PartialEq)]
pub struct Certificate {
    /// How good the news is.
    pub verdict: Verdict,
    /// One line.
    pub headline: String,
    /// What it means, sentence by sentence.
    pub sentences: Vec<String>,
}

/// Words for a result. `length` writes a length with its unit.
pub fn certificate(found: &Found, length: &dyn Fn(f64) -> String) -> Certificate {
    let r = &found.result;
    let many = |n: usize, one: &str, more: &str| if n == 1 { format!("1 {one}") } else { format!("{n} {more}") };
    let verdict = match (found.cancelled, r.complete) {
        (true, _) => Verdict::Stopped,
        (_, true) => Verdict::Proved,
        _ => Verdict::Open,
    };
    let place = if found.with_itself { "pair of places of the surface" } else { "pair of places of the surfaces" };
    let mut sentences = Vec::new();
    let headline = match verdict {
        Verdict::Proved if found.engine == Engine::Mesh && found.is_empty() => "No triangles meet".to_owned(),
        Verdict::Proved if found.engine == Engine::Mesh => "Complete on the triangles".to_owned(),
        Verdict::Proved if found.is_empty() && found.with_itself => "No self-intersection".to_owned(),
        Verdict::Proved if found.is_empty() => "The surfaces do not meet".to_owned(),
        Verdict::Proved => "Complete: no branch is missing".to_owned(),
        Verdict::Open if r.unresolved.is_empty() => "Incomplete: a limit was reached".to_owned(),
        Verdict::Open => format!("Incomplete: {} undecided", many(r.unresolved.len(), "place", "places")),
        Verdict::Stopped => "Stopped: this is what was ready".to_owned(),
    };
    match verdict {
        Verdict::Proved if found.engine == Engine::Mesh => sentences.push(
            "Every pair of triangles was tested. Surfaces were cut into triangles first, so a branch smaller than these \
             may be missing; only on exact surfaces can it be proved that none is."
                .to_owned(),
        ),
        Verdict::Proved => sentences.push(format!(
            "Every {place} was proved empty, or lies on one of the curves, at a point of contact or in a coincident \
             region listed here."
        )),
        Verdict::Open => {
            sentences.push(
                "Everything else was proved; the places listed as unresolved may hold a branch that is not drawn."
                    .to_owned(),
            );
            let reasons = reasons(r);
            if reasons.len() > 1 {
                let said: Vec<String> = reasons.iter().map(|(reason, n)| format!("{n}: {reason}")).collect();
                sentences.push(format!("{}.", said.join("; ")));
            }
        }
        Verdict::Stopped => sentences.push("What is drawn is true, but more may be there.".to_owned()),
    }
    let lost = r.curves.iter().flat_map(|c| c.ends).filter(|e| *e == CurveEnd::Unresolved).count();
    if lost > 0 {
        sentences.push(format!(
            "{} where it could not be followed further.",
            many(lost, "curve end lies", "curve ends lie")
        ));
    }
    if !r.curves.is_empty() {
        let bound = r.curves.iter().fold(0.0_f64, |m, c| m.max(c.error_bound));
        sentences.push(format!(
            "No curve is farther than {} from the surfaces; {} was asked for.",
            length(bound),
            length(r.tol)
        ));
    }
    if r.counts.leaf_pairs > 0 || r.counts.nodes_built > 0 {
        let total = r.time_ms.build + r.time_ms.traverse + r.time_ms.curves;
        sentences.push(format!(
            "{} were looked at in detail, {} built, in {total:.1} ms.",
            many(r.counts.leaf_pairs, "pair", "pairs"),
            many(r.counts.nodes_built, "node was", "nodes were"),
        ));
    }
    Certificate { verdict, headline, sentences }
}

/// The reasons for which places are open, without what is said of single places, and how often each occurs; the rarest
/// first.
pub fn reasons(result: &Intersection) -> Vec<(&str, usize)> {
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    for open in &result.unresolved {
        *counts.entry(plain(&open.reason)).or_default() += 1;
    }
    let mut reasons: Vec<(&str, usize)> = counts.into_iter().collect();
    reasons.sort_by_key(|(_, n)| *n);
    reasons
}

/// A reason without what is said of the single place in brackets.
pub fn plain(reason: &str) -> &str {
    reason.split(" (").next().unwrap_or(reason)
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::kernel::ssi::result::Unresolved;
    use crate::view::intersection::testing::{document, met, square, two_planes};

    #[test]
    fn proof_gap_and_stop_are_three_different_headlines() {
        let length = |v: f64| format!("{v:.1e}");
        let mut found = met(&two_planes());
        let whole = certificate(&found, &length);
        assert_eq!((whole.verdict, whole.headline.as_str()), (Verdict::Proved, "Complete: no branch is missing"));
        let area = [[0.0, 0.1]; 2];
        found.result.unresolved.push(Unresolved { a: 0, uv_box: area, b: 1, st_box: area, reason: String::new() });
        found.result.complete = false;
        assert_eq!(certificate(&found, &length).headline, "Incomplete: 1 place undecided");
        for reason in ["no area", "no area (3 boxes)", "too shallow"] {
            let reason = reason.to_owned();
            found.result.unresolved.push(Unresolved { a: 0, uv_box: area, b: 1, st_box: area, reason });
        }
        found.result.unresolved.remove(0);
        assert!(certificate(&found, &length).sentences.contains(&"1: too shallow; 2: no area.".to_owned()));
        found.cancelled = true;
        assert_eq!(certificate(&found, &length).verdict, Verdict::Stopped);
    }

    #[test]
    fn surfaces_apart_are_proved_to_be_apart() {
        let apart = document([square(DVec3::ZERO, DVec3::X, DVec3::Y), square(DVec3::Z * 2.0, DVec3::X, DVec3::Y)]);
        let none = certificate(&met(&apart), &|v| v.to_string());
        assert_eq!((none.verdict, none.headline.as_str()), (Verdict::Proved, "The surfaces do not meet"));
    }
}
