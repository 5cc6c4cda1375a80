//! Fixed places for what is built on demand: an array of write-once cells, in pages that are made when first touched.
//!
//! Any thread may fill a cell; the value depends on the place alone, so who comes first does not matter. Pages are
//! small: a query touches few cells of each, and clearing the others is what it pays for. Sixteen places in heap
//! order lie below one node two quadtree levels up.

use std::sync::OnceLock;

const PAGE: usize = 16;

type Cell<T> = OnceLock<Box<T>>;
type Page<T> = OnceLock<Box<[Cell<T>]>>;

/// A lazily filled array.
#[derive(Debug)]
pub(crate) struct Slots<T> {
    length: usize,
    pages: OnceLock<Box<[Page<T>]>>,
}

impl<T> Slots<T> {
    /// With places 0..length.
    pub fn new(length: usize) -> Self {
        Self { length, pages: OnceLock::new() }
    }

    /// The value at a place below the length, made now if it was not before.
    #[inline]
    pub fn get_or(&self, at: usize, make: impl FnOnce() -> T) -> &T {
        let pages = self.pages.get_or_init(|| empty(self.length.div_ceil(PAGE)));
        let page = pages[at / PAGE].get_or_init(|| empty(PAGE.min(self.length - at / PAGE * PAGE)));
        page[at % PAGE].get_or_init(|| Box::new(make()))
    }

    /// The pages that are there.
    fn pages(&self) -> impl Iterator<Item = &[Cell<T>]> {
        self.pages.get().into_iter().flatten().filter_map(OnceLock::get).map(|page| &**page)
    }

    /// How many places are filled.
    pub fn filled(&self) -> usize {
        self.pages().flatten().filter(|cell| cell.get().is_some()).count()
    }

    /// Bytes on the heap: the page table, the pages, the values.
    pub fn bytes(&self) -> usize {
        let cells: usize = self.pages().map(<[_]>::len).sum();
        let table = self.pages.get().map_or(0, |pages| pages.len());
        table * size_of::<Page<T>>() + cells * size_of::<Cell<T>>() + self.filled() * size_of::<T>()
    }
}

fn empty<T>(count: usize) -> Box<[OnceLock<T>]> {
    (0..count).map(|_| OnceLock::new()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_is_filled_once_and_counted() {
        let slots = Slots::new(600);
        assert_eq!((slots.filled(), slots.bytes()), (0, 0));
        assert_eq!(*slots.get_or(599, || 7), 7);
        assert_eq!(*slots.get_or(599, || 8), 7);
        assert_eq!(*slots.get_or(0, || 9), 9);
        assert_eq!(slots.filled(), 2);
        // A page is a fat pointer and its state, a place a thin one and its state.
        assert_eq!(slots.bytes(), 38 * 24 + (16 + 8) * 16 + 2 * 4);
    }
}
