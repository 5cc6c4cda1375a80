//! Assemblies: every representation of shape with the places where it occurs.
//!
//! Relationships with a transformation place one representation in another; plain ones make several representations
//! one. Cycles end at the limit of depth.

use std::collections::{HashMap, HashSet};

use glam::DAffine3;

use super::access::{Access, Problem, optional_reference, reference};
use super::curves::placement;
use super::part21::{Exchange, Value};
use super::structure::{MAX_DEPTH, MAX_ITEMS};

/// Every representation of shape with the places where it occurs; and the first that is left out, where they are nested
/// deeper than [`MAX_DEPTH`], lead back to themselves, or are too many.
pub fn placed_representations(exchange: &Exchange<'_>, file: Access<'_, '_>) -> (Vec<(u64, DAffine3)>, Option<u64>) {
    let is_shape = |n: &u64| {
        exchange.instances.get(n).is_some_and(|i| {
            i.records
                .iter()
                .any(|r| r.name.ends_with("SHAPE_REPRESENTATION") && matches!(r.values.get(1), Some(Value::List(_))))
        })
    };
    // Plain relationships make one node of several representations; those with a transformation are placements.
    let mut same: HashMap<u64, Vec<u64>> = HashMap::new();
    let mut children: HashMap<u64, Vec<(u64, DAffine3)>> = HashMap::new();
    let mut placed: HashSet<u64> = HashSet::new();
    for number in &exchange.order {
        let Some(instance) = exchange.instances.get(number) else { continue };
        let named = |n: &str| instance.record(n);
        let Some(base) = named("REPRESENTATION_RELATIONSHIP")
            .or_else(|| named("SHAPE_REPRESENTATION_RELATIONSHIP").filter(|r| r.values.len() >= 4))
        else {
            continue;
        };
        let (Ok(child), Ok(parent)) = (reference(base, 2), reference(base, 3)) else { continue };
        let operator = named("REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION").and_then(|r| optional_reference(r, 0));
        match operator.and_then(|n| transformation(file, n).ok()) {
            Some(place) => {
                children.entry(parent).or_default().push((child, place));
                placed.insert(child);
            }
            None => {
                same.entry(child).or_default().push(parent);
                same.entry(parent).or_default().push(child);
            }
        }
    }
    let mapped: HashSet<u64> = exchange
        .instances
        .values()
        .filter_map(|i| i.record("REPRESENTATION_MAP").and_then(|r| reference(r, 1).ok()))
        .collect();
    let group = |start: u64| {
        let mut all = vec![start];
        let mut known = HashSet::from([start]);
        let mut at = 0;
        while at < all.len() {
            for &next in same.get(&all[at]).map_or(&[][..], Vec::as_slice) {
                if known.insert(next) {
                    all.push(next);
                }
            }
            at += 1;
        }
        all
    };
    let (mut out, mut left_out) = (Vec::new(), None);
    let mut done: HashSet<u64> = HashSet::new();
    for &start in exchange.order.iter().filter(|n| is_shape(n) && !mapped.contains(n)) {
        if done.contains(&start) {
            continue;
        }
        let members = group(start);
        done.extend(&members);
        if members.iter().any(|m| placed.contains(m)) {
            continue;
        }
        let mut stack = vec![(members, DAffine3::IDENTITY, 0)];
        while let Some((members, place, depth)) = stack.pop() {
            for &member in &members {
                if is_shape(&member) {
                    out.push((member, place));
                }
                for (child, inner) in children.get(&member).map_or(&[][..], Vec::as_slice) {
                    let fits = depth < MAX_DEPTH && out.len() + stack.len() < MAX_ITEMS;
                    if fits && file.spend(4).is_ok() {
                        let members = group(*child);
                        // Reading on beyond the limit would only take time.
                        let _spent = file.spend(members.len());
                        stack.push((members, place * *inner, depth + 1));
                    } else {
                        left_out.get_or_insert(*child);
                    }
                }
            }
        }
    }
    (out, left_out)
}

/// ITEM_DEFINED_TRANSFORMATION: from the frame of its first item to that of its second.
fn transformation(file: Access<'_, '_>, number: u64) -> Result<DAffine3, Problem> {
    let record = file.record(number, &["ITEM_DEFINED_TRANSFORMATION"])?;
    let from = placement(file, reference(record, 2)?)?;
    let to = placement(file, reference(record, 3)?)?;
    Ok(to * from.inverse())
}
