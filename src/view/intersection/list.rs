//! The list of a result: what is open first, then curves, points and regions, each with one line of facts.

use std::collections::HashMap;

use super::certificate::{plain, reasons};
use super::style::junction;
use super::{Class, Found, Item, place};
use crate::kernel::ssi::result::CurveEnd;

/// One line.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// What it is.
    pub item: Item,
    /// Its name.
    pub title: String,
    /// One line of facts.
    pub detail: String,
}

/// Lines of one kind.
#[derive(Clone, Debug, PartialEq)]
pub struct Group {
    /// What they are.
    pub title: &'static str,
    /// The class that says how they are drawn; points have none.
    pub class: Option<Class>,
    /// The lines.
    pub rows: Vec<Row>,
}

/// The groups that are not empty, unresolved first. `length` writes a length with its unit.
pub fn groups(found: &Found, length: &dyn Fn(f64) -> String) -> Vec<Group> {
    let r = &found.result;
    let between = |a: usize, b: usize| {
        if a == b { found.name(a).to_owned() } else { listing(found, &[a, b]) }
    };
    // What is open for a rare reason is not lost among hundreds that are alike.
    let rank: HashMap<&str, usize> = reasons(r).iter().enumerate().map(|(k, (reason, _))| (*reason, k)).collect();
    let mut order: Vec<usize> = (0..r.unresolved.len()).collect();
    order.sort_by_key(|&k| rank.get(plain(&r.unresolved[k].reason)));
    let unresolved = order.into_iter().map(|k| {
        let u = &r.unresolved[k];
        Row { item: Item::Unresolved(k), title: between(u.a, u.b), detail: u.reason.clone() }
    });
    let mut out = vec![Group { title: "Unresolved", class: Some(Class::Unresolved), rows: unresolved.collect() }];
    for class in Class::ALL.into_iter().filter(|c| *c != Class::Unresolved) {
        let curves = r.curves.iter().enumerate().filter(|(_, c)| Class::of(c.kind) == class);
        let rows = curves.map(|(k, curve)| {
            let ends = match curve.ends {
                _ if curve.closed => "closed".to_owned(),
                [a, b] if a == b => format!("{} at both ends", end_name(a)),
                [a, b] => format!("{} to {}", end_name(a), end_name(b)),
            };
            let long: f64 = curve.points.windows(2).map(|p| p[0].xyz.distance(p[1].xyz)).sum();
            let names = curve.points.first().map(|p| between(p.a, p.b)).unwrap_or_default();
            Row {
                item: Item::Curve(k),
                title: format!("Curve {} · {}", k + 1, names),
                detail: format!(
                    "{}, {ends}, {} points, within {} of both",
                    length(long),
                    curve.points.len(),
                    length(curve.error_bound)
                ),
            }
        });
        out.push(Group { title: class.name(), class: Some(class), rows: rows.collect() });
    }
    let rounding = found.rounding();
    let meeting = place::surfaces(&r.junctions);
    let junctions = place::distinct(&r.junctions).map(|(k, j)| Row {
        item: Item::Junction(k),
        title: format!("{} {}", junction(j.kind).1, k + 1),
        detail: format!("{}, {}", listing(found, &meeting[k]), gap(j.gap, rounding, length)),
    });
    out.push(Group { title: "Points of contact", class: None, rows: junctions.collect() });
    let miters = r.miters.iter().enumerate().map(|(k, m)| Row {
        item: Item::Miter(k),
        title: format!("Miter point {}", k + 1),
        detail: format!(
            "{}, {}, quadrangle within {}",
            found.name(m.a),
            if m.isolated { "no branch starts here" } else { "a branch starts here" },
            length(m.radius)
        ),
    });
    out.push(Group { title: "Miter points", class: None, rows: miters.collect() });
    let regions = r.regions.iter().enumerate().map(|(k, region)| {
        let first = region.boundary.first().and_then(|l| l.first());
        let names = first.map(|p| between(p.a, p.b)).unwrap_or_default();
        let loops = region.boundary.len();
        let holes = if loops > 1 { format!(", {} holes", loops - 1) } else { String::new() };
        Row {
            item: Item::Region(k),
            title: format!("Overlap {} · {names}", k + 1),
            detail: match region.max_distance {
                d if d <= rounding => format!("the surfaces are one there{holes}"),
                d => format!("{} apart at most{holes}", length(d)),
            },
        }
    });
    out.push(Group { title: "Coincident regions", class: None, rows: regions.collect() });
    out.retain(|g| !g.rows.is_empty());
    out
}

/// The names of surfaces, as a sentence lists them.
fn listing(found: &Found, numbers: &[usize]) -> String {
    match numbers {
        [] => String::new(),
        [one] => found.name(*one).to_owned(),
        [most @ .., last] => {
            let most: Vec<&str> = most.iter().map(|&n| found.name(n)).collect();
            format!("{} and {}", most.join(", "), found.name(*last))
        }
    }
}

/// A gap in words: what rounding leaves is none.
pub fn gap(gap: f64, rounding: f64, length: &dyn Fn(f64) -> String) -> String {
    if gap.abs() <= rounding { "no gap".to_owned() } else { format!("gap {}", length(gap)) }
}

/// What an end is called.
fn end_name(end: CurveEnd) -> &'static str {
    match end {
        CurveEnd::Boundary => "border",
        CurveEnd::Junction => "junction",
        CurveEnd::Miter => "miter point",
        CurveEnd::Loop => "itself",
        CurveEnd::Unresolved => "unresolved",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::ssi::result::Unresolved;
    use crate::view::intersection::testing::{met, two_planes};

    #[test]
    fn unresolved_comes_first_and_every_line_says_which_surfaces() {
        let mut found = met(&two_planes());
        let area = [[0.0, 0.1]; 2];
        let reason = "a cap was hit".to_owned();
        found.result.unresolved.push(Unresolved { a: 0, uv_box: area, b: 1, st_box: area, reason });
        let groups = groups(&found, &|v| format!("{v:.3}"));
        assert_eq!(groups.iter().map(|g| g.title).collect::<Vec<_>>(), ["Unresolved", "Crossing"]);
        assert!(groups.iter().flat_map(|g| &g.rows).all(|r| r.title.contains("surface 0 and surface 1")));
        assert!(groups[0].rows[0].detail.contains("cap"));
        assert!(groups[1].rows[0].detail.starts_with("2.000, border at both ends"), "{}", groups[1].rows[0].detail);
    }
}
