//! Curves out of segments: loop detection and curve tracing by PointUses (HJR99 section 4).

use super::topology::Topology;

/// A polyline of the intersection.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Chain {
    /// Numbers of its points in order; the first one is repeated at the end of a closed chain.
    pub points: Vec<u32>,
    /// Numbers of the segments between them.
    pub segments: Vec<u32>,
    /// Whether it closes.
    pub closed: bool,
}

/// All chains: first those between end points (points whose use count is not two), then the closed ones. Each
/// segment is in exactly one chain; bifurcations break chains. The order depends on the topology alone.
pub fn trace(topology: &Topology) -> Vec<Chain> {
    let mut used = vec![false; topology.segments.len()];
    let mut chains = Vec::new();
    for (at, point) in topology.points.iter().enumerate() {
        if point.uses.len() != 2 {
            for &segment in &point.uses {
                if !used[segment as usize] {
                    chains.push(follow(topology, at as u32, segment, &mut used));
                }
            }
        }
    }
    for segment in 0..topology.segments.len() as u32 {
        if !used[segment as usize] {
            let start = topology.segments[segment as usize].points[0];
            chains.push(follow(topology, start, segment, &mut used));
        }
    }
    chains
}

fn follow(topology: &Topology, start: u32, first: u32, used: &mut [bool]) -> Chain {
    let mut chain = Chain { points: vec![start], segments: Vec::new(), closed: false };
    let mut segment = first;
    let mut at = start;
    loop {
        used[segment as usize] = true;
        at = topology.across(segment, at);
        chain.segments.push(segment);
        chain.points.push(at);
        let uses = &topology.points[at as usize].uses;
        if at == start {
            chain.closed = uses.len() == 2;
            return chain;
        }
        let next = uses.iter().copied().find(|&s| !used[s as usize]);
        match next {
            Some(next) if uses.len() == 2 => segment = next,
            _ => return chain,
        }
    }
}
