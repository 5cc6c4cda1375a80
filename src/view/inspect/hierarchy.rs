//! A hierarchy that is looked into, and its overlaps with another one.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::kernel::bvh::{
    BvhError, BvhOptions, Memory, NodeId, Summary, SurfaceTree, TraverseOptions, Verdict, traverse,
};
use crate::kernel::geom::Surface;
use crate::kernel::job::Job;
use crate::model::document::EntityId;

/// The most bytes that a hierarchy for display may take.
const MEMORY: usize = 1 << 30;

/// A built hierarchy.
#[derive(Debug)]
pub struct Hierarchy {
    /// Of which entity.
    pub entity: EntityId,
    /// Its surface.
    pub surface: Arc<Surface>,
    /// The tree, built in full with its tori.
    pub tree: SurfaceTree,
    /// The numbers of all levels.
    pub levels: Vec<Summary>,
    /// What the tree takes.
    pub memory: Memory,
    /// How long the build took.
    pub took: Duration,
    /// False when it was cancelled: what is not built yet is built when it is looked at.
    pub complete: bool,
}

impl Hierarchy {
    /// Builds the whole tree and counts its levels.
    pub fn build(entity: EntityId, surface: Arc<Surface>, height: u32, job: &Job) -> Result<Self, BvhError> {
        let begun = Instant::now();
        let options = BvhOptions { height, memory_limit: MEMORY, ..BvhOptions::default() };
        let tree = SurfaceTree::new(&surface, &options)?;
        let complete = tree.build_all(true, job)?;
        let took = begun.elapsed();
        job.phase("Counting the levels");
        // A cancelled build must not be finished one node at a time by counting it.
        let levels = if complete { tree.summaries() } else { Vec::new() };
        let memory = tree.memory();
        Ok(Self { entity, surface, tree, levels, memory, took, complete })
    }

    /// Quadtree levels below the Bezier patches.
    pub fn height(&self) -> u32 {
        self.tree.options().height
    }
}

/// The pairs of nodes of one level whose swept spheres overlap.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Overlaps {
    /// The level of both hierarchies.
    pub level: u32,
    /// How many pairs.
    pub pairs: usize,
    /// Pairs of nodes that were compared.
    pub tests: u64,
    /// How long that took.
    pub took: Duration,
    /// For every node of the first that overlaps, its partners in the second.
    pub partners: BTreeMap<NodeId, Vec<NodeId>>,
    /// The same the other way round.
    pub back: BTreeMap<NodeId, Vec<NodeId>>,
    /// False when it was cancelled.
    pub complete: bool,
}

impl Overlaps {
    /// Traverses two hierarchies down to a level.
    pub fn find(a: &Hierarchy, b: &Hierarchy, level: u32, job: &Job) -> Self {
        job.phase("Testing pairs");
        let begun = Instant::now();
        let options = TraverseOptions { level: Some(level), ..TraverseOptions::default() };
        let found = traverse(&a.tree, &b.tree, &options, |_| Verdict::Descend, job);
        let took = begun.elapsed();
        let mut out = Self {
            level,
            pairs: found.pairs.len(),
            tests: found.tests,
            took,
            complete: found.complete,
            ..Self::default()
        };
        for pair in found.pairs {
            out.partners.entry(pair.a).or_default().push(pair.b);
            out.back.entry(pair.b).or_default().push(pair.a);
        }
        out
    }

    /// The nodes of the first (or second) hierarchy that overlap something.
    pub fn nodes(&self, second: bool) -> BTreeSet<NodeId> {
        if second { self.back.keys().copied().collect() } else { self.partners.keys().copied().collect() }
    }
}
