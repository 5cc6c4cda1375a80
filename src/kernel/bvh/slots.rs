//! Fixed places for what is built on demand: an array of write-once cells, in pages that are made when first touched.
//!
//! Any thread may fill a cell; the value depends on the place alone, so who comes first does not matter.

use std::sync::OnceLock;

const PAGE: usize = 256;

type Cell<T> = OnceLock<Box<T>>;
type Page<T> = OnceLock<Box<[Cell<T>]>>;

/// A lazily filled array.
#[derive(Debug)]
pub(crate) struct Slots<T> {
    length: usize,
    pages: Box<[Page<T>]>,
}

impl<T> Slots<T> {
    /// With places 0..length.
    pub fn new(length: usize) -> Self {
        Self { length, pages: (0..length.div_ceil(PAGE)).map(|_| OnceLock::new()).collect() }
    }

    /// The value at a place below the length, made now if it was not before.
    #[inline]
    pub fn get_or(&self, at: usize, make: impl FnOnce() -> T) -> &T {
        let page = self.pages[at / PAGE]
            .get_or_init(|| (0..PAGE.min(self.length - at / PAGE * PAGE)).map(|_| OnceLock::new()).collect());
        page[at % PAGE].get_or_init(|| Box::new(make()))
    }

    /// How many places are filled.
    pub fn filled(&self) -> usize {
        self.pages.iter().filter_map(OnceLock::get).flatten().filter(|cell| cell.get().is_some()).count()
    }

    /// Bytes on the heap: the page table, the pages, the values.
    pub fn bytes(&self) -> usize {
        let pages: usize = self.pages.iter().filter_map(OnceLock::get).map(|page| page.len()).sum();
        self.pages.len() * size_of::<Page<T>>() + pages * size_of::<Cell<T>>() + self.filled() * size_of::<T>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_is_filled_once_and_counted() {
        let slots = Slots::new(600);
        assert_eq!(slots.filled(), 0);
        assert_eq!(*slots.get_or(599, || 7), 7);
        assert_eq!(*slots.get_or(599, || 8), 7);
        assert_eq!(*slots.get_or(0, || 9), 9);
        assert_eq!(slots.filled(), 2);
        // A page is a fat pointer and its state, a place a thin one and its state.
        assert_eq!(slots.bytes(), 3 * 24 + (256 + 88) * 16 + 2 * 4);
    }
}
