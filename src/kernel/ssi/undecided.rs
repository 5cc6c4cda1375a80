//! What could not be decided, as few places: boxes that touch are one place with a count and a bound of its extent.
//!
//! A curve along which nodes never separate leaves thousands of boxes; a reader wants to know where it is, how much
//! of it there is and why. Cost: n log n, and the pairs of boxes that overlap along one parameter.

use super::result::Unresolved;

/// A box pair that could not be decided, with the space that it fills.
#[derive(Clone, Debug)]
pub struct Undecided {
    /// The box, with the reason.
    pub entry: Unresolved,
    /// The diameter of the space that it fills, in model units.
    pub extent: f64,
}

/// Merges boxes of the same surfaces and reason that touch. The reason then says how many there are.
pub fn merged(entries: Vec<Undecided>) -> Vec<Unresolved> {
    let mut groups: Vec<Vec<Undecided>> = Vec::new();
    let key = |e: &Unresolved| (e.a, e.b, e.reason.clone());
    let mut places: std::collections::HashMap<(usize, usize, String), usize> = std::collections::HashMap::new();
    for entry in entries {
        let group = *places.entry(key(&entry.entry)).or_insert_with(|| {
            groups.push(Vec::new());
            groups.len() - 1
        });
        groups[group].push(entry);
    }
    groups.into_iter().flat_map(regions).collect()
}

fn ranges(e: &Unresolved) -> [[f64; 2]; 4] {
    [e.uv_box[0], e.uv_box[1], e.st_box[0], e.st_box[1]]
}

/// The connected regions of a group of boxes, in the order of their first boxes.
fn regions(group: Vec<Undecided>) -> Vec<Unresolved> {
    let all: Vec<[[f64; 2]; 4]> = group.iter().map(|e| ranges(&e.entry)).collect();
    let span =
        |k: usize| all.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |s, r| [s[0].min(r[k][0]), s[1].max(r[k][1])]);
    let spans: [[f64; 2]; 4] = std::array::from_fn(span);
    let size = |k: usize| spans[k][1] - spans[k][0];
    let slack: [f64; 4] = std::array::from_fn(|k| 1e-9 * (size(k) + spans[k][0].abs().max(spans[k][1].abs())));
    // Sweep along the parameter in which the boxes are smallest against all of them together.
    let share = |k: usize| all.iter().map(|r| r[k][1] - r[k][0]).sum::<f64>() / size(k).max(f64::MIN_POSITIVE);
    let along = (0..4).min_by(|&i, &j| share(i).total_cmp(&share(j))).unwrap_or(0);
    let mut order: Vec<usize> = (0..all.len()).collect();
    order.sort_by(|&i, &j| all[i][along][0].total_cmp(&all[j][along][0]).then(i.cmp(&j)));
    let mut parent: Vec<usize> = (0..all.len()).collect();
    fn root(parent: &mut [usize], mut i: usize) -> usize {
        while parent[i] != i {
            parent[i] = parent[parent[i]];
            i = parent[i];
        }
        i
    }
    for (n, &i) in order.iter().enumerate() {
        for &j in &order[n + 1..] {
            if all[j][along][0] > all[i][along][1] + slack[along] {
                break;
            }
            let touch = |k: usize| all[i][k][0] <= all[j][k][1] + slack[k] && all[j][k][0] <= all[i][k][1] + slack[k];
            if (0..4).all(touch) {
                let (x, y) = (root(&mut parent, i), root(&mut parent, j));
                parent[x.max(y)] = x.min(y);
            }
        }
    }
    let mut out: Vec<(usize, Undecided, usize)> = Vec::new();
    for (i, one) in group.into_iter().enumerate() {
        let home = root(&mut parent, i);
        match out.iter_mut().find(|(root, ..)| *root == home) {
            Some((_, whole, count)) => {
                let grow = |b: &mut [[f64; 2]; 2], c: &[[f64; 2]; 2]| {
                    for (x, y) in b.iter_mut().zip(c) {
                        *x = [x[0].min(y[0]), x[1].max(y[1])];
                    }
                };
                grow(&mut whole.entry.uv_box, &one.entry.uv_box);
                grow(&mut whole.entry.st_box, &one.entry.st_box);
                whole.extent += one.extent;
                *count += 1;
            }
            None => out.push((home, one, 1)),
        }
    }
    let said = |(_, whole, count): (usize, Undecided, usize)| {
        let mut entry = whole.entry;
        if count > 1 {
            entry.reason = format!("{} ({count} boxes, together less than {:.1e} long)", entry.reason, whole.extent);
        }
        entry
    };
    out.into_iter().map(said).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boxes_that_touch_are_one_place() {
        let at = |x: f64, reason: &str| Undecided {
            entry: Unresolved {
                a: 0,
                uv_box: [[x, x + 0.01], [0.0, 0.01]],
                b: 1,
                st_box: [[1.0 - x, 1.01 - x], [0.0, 0.5]],
                reason: reason.to_owned(),
            },
            extent: 0.02,
        };
        let mut list: Vec<Undecided> = (0..40).map(|k| at(0.01 * f64::from(k), "why")).collect();
        list.push(at(0.7, "why"));
        list.push(at(0.05, "else"));
        let found = merged(list);
        assert_eq!(found.len(), 3);
        assert_eq!(found[0].reason, "why (40 boxes, together less than 8.0e-1 long)");
        assert!((found[0].uv_box[0][1] - 0.4).abs() < 1e-12 && (found[0].st_box[0][0] - 0.61).abs() < 1e-12);
        assert_eq!((found[1].reason.as_str(), found[1].uv_box[0][0]), ("why", 0.7));
        assert_eq!(found[2].reason, "else");
    }
}
