//! A level in the domain: one square of colour for each node, or for a block of nodes where they are too fine.

use std::sync::Arc;

use super::shown::{Scale, Shown};
use crate::kernel::bvh::SurfaceTree;
use crate::kernel::geom::Surface;
use crate::view::uv::UvCells;

/// The most columns or rows.
const SIDE: usize = 1024;

/// The colours of a level over the domain of its surface. A square that stands for several nodes shows the largest
/// value among them.
pub fn cells(tree: &SurfaceTree, surface: &Surface, shown: &Shown, revision: u64) -> UvCells {
    let [spans_u, spans_v] = tree.grid();
    let finest = (SIDE / spans_u.max(spans_v).max(1)).max(1).ilog2();
    let level = shown.level.min(finest).min(tree.options().height);
    let side = 1_usize << level;
    let (width, height) = (spans_u * side, spans_v * side);
    let mut largest = vec![f32::NAN; width * height];
    let mut seen = vec![false; width * height];
    for (id, value) in shown.nodes.iter().zip(&shown.values) {
        let Some(patch) = tree.patches().get(id.patch as usize) else { continue };
        let (column, row) = (id.patch as usize % spans_u, id.patch as usize / spans_u);
        let [low, high] = patch.local_rectangle(id.index).map(|p| p * side as f64);
        // A block holds whole nodes or a node whole blocks, so flooring is exact.
        let range = |a: f64, b: f64| a.floor() as usize..(b.ceil() as usize).min(side);
        for j in range(low.y, high.y) {
            for i in range(low.x, high.x) {
                let at = (row * side + j) * width + column * side + i;
                largest[at] = if seen[at] { largest[at].max(*value) } else { *value };
                seen[at] = true;
            }
        }
    }
    let colors = largest.iter().zip(&seen).map(|(v, seen)| color(&shown.scale, *v, *seen)).collect();
    UvCells {
        revision,
        breaks: surface.knots().each_ref().map(|k| k.breaks()),
        per_span: [side, side],
        colors: Arc::new(colors),
    }
}

fn color(scale: &Scale, value: f32, seen: bool) -> [u8; 4] {
    let [r, g, b, _] = scale.color(value);
    if seen { [r, g, b, 0xff] } else { [0; 4] }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::bvh::BvhOptions;
    use crate::kernel::job::Job;
    use crate::view::display::tests::sphere;
    use crate::view::inspect::{Coloring, VolumeForm};

    #[test]
    fn every_node_colours_its_own_rectangle() {
        let surface = sphere();
        let tree = SurfaceTree::new(&surface, &BvhOptions { height: 3, ..BvhOptions::default() }).unwrap();
        let shown = Shown::new(&tree, &surface, 3, VolumeForm::None, Coloring::Error, &Job::new()).unwrap();
        let cells = cells(&tree, &surface, &shown, 1);
        let [width, height] = cells.size();
        assert_eq!(cells.colors.len(), width * height);
        let [us, vs] = &cells.breaks;
        for (id, color) in shown.nodes.iter().zip(shown.colors()) {
            let [low, high] = tree.rectangle(*id);
            let middle = 0.5 * (low + high);
            let place = |breaks: &[f64], t: f64| {
                let span = breaks.windows(2).position(|b| t < b[1]).unwrap();
                span * 8 + ((t - breaks[span]) / (breaks[span + 1] - breaks[span]) * 8.0) as usize
            };
            assert_eq!(cells.colors[place(vs, middle.y) * width + place(us, middle.x)], color);
        }
    }
}
