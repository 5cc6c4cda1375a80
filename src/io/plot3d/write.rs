//! Plot3D files out: always 3-D and of several blocks, which every reader takes.

use super::Encoding;
use crate::kernel::mesh::grid::Grid;

/// Writes blocks in a layout (always 3-D, several blocks); IBLANK goes along where every block has it.
pub fn write(grids: &[Grid], encoding: Encoding) -> Vec<u8> {
    let blank = !grids.is_empty() && grids.iter().all(|g| g.blank().is_some());
    let header: Vec<usize> = std::iter::once(grids.len()).chain(grids.iter().flat_map(Grid::counts)).collect();
    let Encoding::Binary { records, big_endian, double } = encoding else { return write_ascii(grids, &header, blank) };
    let mut out = Vec::new();
    let int = |v: i32| if big_endian { v.to_be_bytes() } else { v.to_le_bytes() };
    let real = |v: f64, to: &mut Vec<u8>| match (double, big_endian) {
        (true, false) => to.extend(v.to_le_bytes()),
        (true, true) => to.extend(v.to_be_bytes()),
        (false, false) => to.extend((v as f32).to_le_bytes()),
        (false, true) => to.extend((v as f32).to_be_bytes()),
    };
    let mut record = |payload: Vec<u8>| {
        let mark = int(payload.len() as i32);
        if records {
            out.extend(mark);
        }
        out.extend(payload);
        if records {
            out.extend(mark);
        }
    };
    if records {
        record(int(grids.len() as i32).to_vec());
        record(header[1..].iter().flat_map(|&c| int(c as i32)).collect());
    } else {
        record(header.iter().flat_map(|&c| int(c as i32)).collect());
    }
    for grid in grids {
        let mut payload = Vec::new();
        for axis in 0..3 {
            grid.points().iter().for_each(|p| real(p[axis], &mut payload));
        }
        if let Some(values) = grid.blank().filter(|_| blank) {
            values.iter().for_each(|&b| payload.extend(int(b)));
        }
        record(payload);
    }
    out
}

fn write_ascii(grids: &[Grid], header: &[usize], blank: bool) -> Vec<u8> {
    use std::fmt::Write as _;
    let mut out = format!("{}\n", header[0]);
    for counts in header[1..].chunks(3) {
        let _infallible = writeln!(out, "{} {} {}", counts[0], counts[1], counts[2]);
    }
    for grid in grids {
        for axis in 0..3 {
            for p in grid.points() {
                let _infallible = writeln!(out, "{:?}", p[axis]);
            }
        }
        for b in grid.blank().filter(|_| blank).unwrap_or_default() {
            let _infallible = writeln!(out, "{b}");
        }
    }
    out.into_bytes()
}
