//! Rectangular arrays of samples: (M + 1) x (N + 1) values, I along u running fastest.

use std::ops::{Index, IndexMut};

/// Values at the samples I = 0..=m, J = 0..=n.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid<T> {
    m: usize,
    n: usize,
    values: Vec<T>,
}

impl<T> Grid<T> {
    /// Calls `f(i, j)` for every sample, row by row.
    pub fn from_fn(m: usize, n: usize, mut f: impl FnMut(usize, usize) -> T) -> Self {
        let mut values = Vec::with_capacity((m + 1) * (n + 1));
        for j in 0..=n {
            for i in 0..=m {
                values.push(f(i, j));
            }
        }
        Self { m, n, values }
    }

    /// From rows J = 0..=n of m + 1 values each; `None` when a row has another length or there is none.
    pub fn from_rows(rows: Vec<Vec<T>>) -> Option<Self> {
        let width = rows.first().map(Vec::len).filter(|&w| w > 0)?;
        if rows.iter().any(|r| r.len() != width) {
            return None;
        }
        let (m, n) = (width - 1, rows.len() - 1);
        Some(Self { m, n, values: rows.into_iter().flatten().collect() })
    }

    /// The number of spans along u.
    pub fn m(&self) -> usize {
        self.m
    }

    /// The number of spans along v.
    pub fn n(&self) -> usize {
        self.n
    }

    /// All values, row by row.
    pub fn values(&self) -> &[T] {
        &self.values
    }

    /// The row J = j.
    pub fn row(&self, j: usize) -> &[T] {
        &self.values[j * (self.m + 1)..(j + 1) * (self.m + 1)]
    }

    /// Whether a sample lies on the border.
    pub fn on_border(&self, i: usize, j: usize) -> bool {
        i == 0 || j == 0 || i == self.m || j == self.n
    }

    /// The same shape with other values.
    pub fn map<U>(&self, f: impl FnMut(&T) -> U) -> Grid<U> {
        Grid { m: self.m, n: self.n, values: self.values.iter().map(f).collect() }
    }
}

impl<T: Clone> Grid<T> {
    /// The column I = i.
    pub fn column(&self, i: usize) -> Vec<T> {
        (0..=self.n).map(|j| self[(i, j)].clone()).collect()
    }
}

impl<T> Index<(usize, usize)> for Grid<T> {
    type Output = T;

    fn index(&self, (i, j): (usize, usize)) -> &T {
        &self.values[j * (self.m + 1) + i]
    }
}

impl<T> IndexMut<(usize, usize)> for Grid<T> {
    fn index_mut(&mut self, (i, j): (usize, usize)) -> &mut T {
        &mut self.values[j * (self.m + 1) + i]
    }
}
