//! Colours, visibility and names: what STYLED_ITEM, INVISIBILITY and products say about geometry.
//!
//! A style leads to its colour through several layers that differ between applications; the first colour that is
//! reached counts. Linear in the number of styles.

use std::collections::{HashMap, HashSet};

use super::access::{self, Access, reference, references};
use super::part21::{self, Exchange, Value};
use crate::io::color::linear_of_percent;

/// How many steps a style may be from its colour.
const MAX_DEPTH: usize = 12;
/// How many statements are looked at for one style.
const MAX_STEPS: usize = 64;

/// What is known of statements besides their geometry.
#[derive(Debug, Default)]
pub struct Styles {
    /// Colours by statement, linear RGB.
    pub colors: HashMap<u64, [f32; 3]>,
    /// Statements that are not shown.
    pub hidden: HashSet<u64>,
    /// The names of products by representation.
    pub names: HashMap<u64, String>,
}

impl Styles {
    /// Gathers them.
    pub fn of(exchange: &Exchange<'_>, file: Access<'_, '_>) -> Self {
        let mut out = Self::default();
        let mut items: HashMap<u64, u64> = HashMap::new();
        for number in &exchange.order {
            let Some(instance) = exchange.instances.get(number) else { continue };
            let styled = instance.record("STYLED_ITEM").or_else(|| instance.record("OVER_RIDING_STYLED_ITEM"));
            if let Some(styled) = styled {
                let Ok(item) = reference(styled, 2) else { continue };
                items.insert(*number, item);
                let styles = references(styled, 1).unwrap_or_default();
                let mut steps = 0;
                if let Some(color) = styles.into_iter().find_map(|s| color(exchange, s, 0, &mut steps)) {
                    out.colors.insert(item, color);
                }
            }
        }
        for instance in exchange.instances.values() {
            if let Some(record) = instance.record("INVISIBILITY") {
                for number in references(record, 0).unwrap_or_default() {
                    out.hidden.insert(items.get(&number).copied().unwrap_or(number));
                }
            }
            if let Some(record) = instance.record("SHAPE_DEFINITION_REPRESENTATION")
                && let (Ok(definition), Ok(representation)) = (reference(record, 0), reference(record, 1))
                && let Some(name) = product(file, definition)
            {
                out.names.insert(representation, name);
            }
        }
        out
    }
}

/// The first colour that a style leads to.
fn color(exchange: &Exchange<'_>, number: u64, depth: usize, steps: &mut usize) -> Option<[f32; 3]> {
    *steps += 1;
    if depth > MAX_DEPTH || *steps > MAX_STEPS {
        return None;
    }
    let instance = exchange.instances.get(&number)?;
    if let Some(rgb) = instance.record("COLOUR_RGB") {
        let part = |at: usize| access::real(rgb, at).ok().map(|v| linear_of_percent(100.0 * v));
        return Some([part(1)?, part(2)?, part(3)?]);
    }
    let named = instance.record("DRAUGHTING_PRE_DEFINED_COLOUR").or_else(|| instance.record("PRE_DEFINED_COLOUR"));
    if let Some(named) = named
        && let Some(Value::String(name)) = named.values.first()
    {
        return Some(match *name {
            "red" => [1.0, 0.0, 0.0],
            "green" => [0.0, 1.0, 0.0],
            "blue" => [0.0, 0.0, 1.0],
            "yellow" => [1.0, 1.0, 0.0],
            "magenta" => [1.0, 0.0, 1.0],
            "cyan" => [0.0, 1.0, 1.0],
            "black" => [0.0, 0.0, 0.0],
            "white" => [1.0, 1.0, 1.0],
            _ => return None,
        });
    }
    let values = instance.records.iter().flat_map(|r| &r.values);
    values.flat_map(super::structure::all_references).find_map(|next| color(exchange, next, depth + 1, steps))
}

/// The name of the product that a definition belongs to.
fn product(file: Access<'_, '_>, definition: u64) -> Option<String> {
    let shape = file.record(definition, &["PRODUCT_DEFINITION_SHAPE"]).ok()?;
    let names = ["PRODUCT_DEFINITION", "PRODUCT_DEFINITION_WITH_ASSOCIATED_DOCUMENTS"];
    let definition = file.record(reference(shape, 2).ok()?, &names).ok()?;
    let names = ["PRODUCT_DEFINITION_FORMATION", "PRODUCT_DEFINITION_FORMATION_WITH_SPECIFIED_SOURCE"];
    let formation = file.record(reference(definition, 2).ok()?, &names).ok()?;
    let product = file.record(reference(formation, 2).ok()?, &["PRODUCT"]).ok()?;
    [1, 0].into_iter().find_map(|at| match product.values.get(at) {
        Some(Value::String(raw)) if !raw.trim().is_empty() => Some(part21::text(raw).into_owned()),
        _ => None,
    })
}
