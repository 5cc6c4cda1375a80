//! Counts the zero contours of a function on a grid.
#![allow(dead_code, clippy::unwrap_used, reason = "a test helper may stop the test; not every test uses all")]

/// The numbers of open and closed zero contours of a function over [-1, 1]^2 by marching squares: slow and plain.
pub fn contours(f: &impl Fn(f64, f64) -> f64, n: usize) -> (usize, usize) {
    let at = |k: usize| -1.0 + 2.0 * k as f64 / n as f64;
    let sign: Vec<bool> =
        (0..=n).flat_map(|j| (0..=n).map(move |i| (i, j))).map(|(i, j)| f(at(i), at(j)) > 0.0).collect();
    let s = |i: usize, j: usize| sign[j * (n + 1) + i];
    // Crossed grid edges are nodes, cells link them: along u first, then along v.
    let edges = 2 * (n + 1) * (n + 1);
    let along_u = |i: usize, j: usize| j * (n + 1) + i;
    let along_v = |i: usize, j: usize| (n + 1) * (n + 1) + j * (n + 1) + i;
    let mut links: Vec<Vec<usize>> = vec![Vec::new(); edges];
    for j in 0..n {
        for i in 0..n {
            let mut crossed = Vec::new();
            for (a, b, e) in [
                (s(i, j), s(i + 1, j), along_u(i, j)),
                (s(i + 1, j), s(i + 1, j + 1), along_v(i + 1, j)),
                (s(i + 1, j + 1), s(i, j + 1), along_u(i, j + 1)),
                (s(i, j + 1), s(i, j), along_v(i, j)),
            ] {
                if a != b {
                    crossed.push(e);
                }
            }
            if crossed.len() == 4 && (f(0.5 * (at(i) + at(i + 1)), 0.5 * (at(j) + at(j + 1))) > 0.0) == s(i, j) {
                crossed.rotate_left(1);
            }
            for pair in crossed.chunks(2) {
                links[pair[0]].push(pair[1]);
                links[pair[1]].push(pair[0]);
            }
        }
    }
    let mut seen = vec![false; edges];
    let (mut open, mut closed) = (0, 0);
    for start in 0..edges {
        if seen[start] || links[start].is_empty() {
            continue;
        }
        let (mut stack, mut ends) = (vec![start], 0);
        seen[start] = true;
        while let Some(e) = stack.pop() {
            ends += usize::from(links[e].len() == 1);
            for &next in &links[e] {
                if !seen[next] {
                    seen[next] = true;
                    stack.push(next);
                }
            }
        }
        if ends == 0 { closed += 1 } else { open += 1 }
    }
    (open, closed)
}

/// The same on a rectangle.
pub fn contours_on(low: [f64; 2], high: [f64; 2], f: &impl Fn(f64, f64) -> f64, n: usize) -> (usize, usize) {
    let at = |x: f64, k: usize| low[k] + (high[k] - low[k]) * 0.5 * (x + 1.0);
    contours(&|x, y| f(at(x, 0), at(y, 1)), n)
}
