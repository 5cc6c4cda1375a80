//! What a hierarchy says it takes is what the allocator handed out for it, to the byte.

#![allow(clippy::unwrap_used, reason = "a test stops at what it did not expect")]
#![allow(unsafe_code, reason = "only the allocator itself knows what it handed out")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicIsize, Ordering};

use glam::{DVec2, DVec3};
use patchwright::kernel::bvh::{BvhOptions, SurfaceTree, VolumeKind, VolumeTree};
use patchwright::kernel::geom::{Knots, Surface};
use patchwright::kernel::job::Job;

static BYTES: AtomicIsize = AtomicIsize::new(0);

struct Counting;

// SAFETY: every call goes on to the system's allocator as it came.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        BYTES.fetch_add(layout.size() as isize, Ordering::SeqCst);
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, at: *mut u8, layout: Layout) {
        BYTES.fetch_sub(layout.size() as isize, Ordering::SeqCst);
        unsafe { System.dealloc(at, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

fn surface(degree: [usize; 2], spans: usize, rational: bool) -> Surface {
    let breaks: Vec<f64> = (0..=spans).map(|i| i as f64).collect();
    let [u, v] = degree.map(|p| Knots::clamped(p, &breaks, 1).unwrap());
    let (nu, nv) = (u.control_count(), v.control_count());
    let point = |at: usize| {
        let (x, y) = ((at % nu) as f64, (at / nu) as f64);
        DVec3::new(x, y, (1.3 * x).sin() * (0.9 * y).cos())
    };
    let weights = rational.then(|| (0..nu * nv).map(|at| 1.0 + 0.3 * (at % 3) as f64).collect());
    Surface::new(u, v, (0..nu * nv).map(point).collect(), weights).unwrap()
}

/// Bytes that are handed out and kept while `make` runs, with what it made.
fn counted<T>(make: impl FnOnce() -> T) -> (T, isize) {
    let before = BYTES.load(Ordering::SeqCst);
    let made = make();
    (made, BYTES.load(Ordering::SeqCst) - before)
}

// One test: another one beside it would allocate too.
#[test]
fn memory_is_what_was_allocated() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    pool.install(|| {
        // What is made once in a process is made before anything is counted.
        let first = SurfaceTree::new(&surface([3, 3], 1, false), &BvhOptions::default()).unwrap();
        drop((first.build_all(true, &Job::new()).unwrap(), first));
        for surface in [surface([3, 3], 1, false), surface([3, 3], 3, false), surface([2, 4], 2, true)] {
            for height in [0, 1, 4] {
                let options = BvhOptions { height, ..BvhOptions::default() };
                let itself = size_of::<SurfaceTree>() as isize;
                let (tree, heap) = counted(|| SurfaceTree::new(&surface, &options).unwrap());
                assert_eq!(tree.memory().total() as isize, heap + itself, "new, height {height}");
                let visit = |tree: &SurfaceTree| {
                    for k in 0..20 {
                        let [u, v] = surface.domain();
                        let (s, t) = (f64::from(k * 7 % 20) / 20.0, f64::from(k) / 20.0);
                        let uv = DVec2::new(u[0] + (u[1] - u[0]) * s, v[0] + (v[1] - v[0]) * t);
                        let leaf = tree.node_over(height, uv);
                        let _ = (tree.node(leaf), tree.torus(leaf));
                    }
                };
                let ((), more) = counted(|| visit(&tree));
                assert_eq!(tree.memory().total() as isize, heap + more + itself, "lazy, height {height}");
                let (_, full) = counted(|| tree.build_all(true, &Job::new()).unwrap());
                assert_eq!(tree.memory().total() as isize, heap + more + full + itself, "full, height {height}");
                let ((), freed) = counted(|| drop(tree));
                assert_eq!(-freed, heap + more + full);

                for kind in [VolumeKind::Aabb, VolumeKind::Hull] {
                    let (tree, heap) = counted(|| VolumeTree::build(&surface, &options, kind, &Job::new()).unwrap());
                    let itself = size_of::<VolumeTree>() as isize;
                    assert_eq!(tree.bytes() as isize, heap + itself, "{kind:?}, height {height}");
                }
            }
        }
    });
}
