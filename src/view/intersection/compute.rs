//! From picks to a result: what a worker runs.

use std::fmt;

use super::{Found, Picks, Subject, Task, subjects};
use crate::kernel::geom::Surface;
use crate::kernel::job::Job;
use crate::kernel::self_ssi::SelfIntersectOptions;
use crate::kernel::self_ssi::model::{merged, self_intersect_all};
use crate::kernel::ssi::{SsiOptions, intersect, intersect_all};
use crate::model::document::Document;

/// Everything that a worker needs.
#[derive(Clone, Debug)]
pub struct Request {
    /// What is intersected with what.
    pub task: Task,
    /// All surfaces of the document; the sides are places in it.
    pub subjects: Vec<Subject>,
    /// The surfaces of both sides.
    pub sides: [Vec<usize>; 2],
    /// How closely curves follow, in model units; by the model's size when left out.
    pub tol: Option<f64>,
}

impl Request {
    /// What the picks ask for, or what is missing.
    pub fn new(picks: &Picks, document: &Document) -> Result<Self, &'static str> {
        let chosen = picks.chosen(document)?;
        let subjects = subjects(document);
        let place = |id| subjects.iter().position(|s: &Subject| s.id == id);
        let sides = chosen.map(|ids| ids.into_iter().filter_map(place).collect());
        Ok(Self { task: picks.task, subjects, sides, tol: None })
    }

    /// What the job is called.
    pub fn name(&self) -> String {
        let count = |side: &[usize]| match side {
            [one] => self.subjects.get(*one).map_or_else(|| "a surface".to_owned(), |s| s.name.clone()),
            many => format!("{} surfaces", many.len()),
        };
        match self.task {
            Task::Sets => format!("Intersect {} and {}", count(&self.sides[0]), count(&self.sides[1])),
            Task::Pairs => format!("Intersect {} with each other", count(&self.sides[0])),
            Task::Itself => format!("Self-intersection of {}", count(&self.sides[0])),
        }
    }
}

impl fmt::Display for Request {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names = |side: &[usize]| {
            side.iter().filter_map(|&n| self.subjects.get(n)).map(|s| s.name.as_str()).collect::<Vec<_>>().join(", ")
        };
        write!(f, "{:?} a: [{}] b: [{}] tol: {:?}", self.task, names(&self.sides[0]), names(&self.sides[1]), self.tol)
    }
}

/// Runs the kernel. Cancelled: what was ready, marked. An error is one line for people.
pub fn compute(request: &Request, job: &Job) -> Result<Found, String> {
    let numbered = |side: &[usize]| -> Vec<(usize, &Surface)> {
        side.iter().filter_map(|&n| Some((n, request.subjects.get(n)?.surface.as_ref()))).collect()
    };
    let options = SsiOptions { tol: request.tol, ..SsiOptions::default() };
    let result = match request.task {
        Task::Sets => intersect(&numbered(&request.sides[0]), &numbered(&request.sides[1]), &options, job)
            .map_err(|e| e.to_string())?,
        Task::Pairs => intersect_all(&numbered(&request.sides[0]), &options, job).map_err(|e| e.to_string())?,
        Task::Itself => {
            let options = SelfIntersectOptions { tol: request.tol, ..SelfIntersectOptions::default() };
            let surfaces = request.sides[0].iter().filter_map(|&n| Some((n, &request.subjects.get(n)?.surface)));
            let surfaces: Vec<_> = surfaces.collect();
            let all = self_intersect_all(&surfaces, &options, job).map_err(|e| e.to_string())?;
            merged(all.into_iter().map(|found| found.result))
        }
    };
    Ok(Found {
        subjects: request.subjects.clone(),
        result,
        with_itself: request.task == Task::Itself,
        cancelled: job.is_cancelled(),
        warnings: job.warnings(),
    })
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::view::intersection::testing::{document, met, square, two_planes};

    #[test]
    fn two_planes_meet_in_the_segment_they_share() {
        let found = met(&two_planes());
        assert!(found.result.complete && !found.cancelled && found.result.curves.len() == 1);
        let bounds = found.bounds(super::super::Item::Curve(0), 0.0).unwrap();
        assert!(bounds.min.distance(-DVec3::X) < 1e-9 && bounds.max.distance(DVec3::X) < 1e-9);
        assert_eq!(found.numbers(), [0, 1]);
    }

    #[test]
    fn three_planes_make_three_pairs_and_far_ones_none() {
        let [x, y, z] = DVec3::AXES;
        let model = document([
            square(DVec3::ZERO, x, y),
            square(DVec3::ZERO, y, z),
            square(DVec3::ZERO, z, x),
            square(x * 50.0, x, y),
        ]);
        let request = Request::new(&Picks::new(Task::Pairs, &[]), &model).unwrap();
        let found = compute(&request, &Job::new()).unwrap();
        assert_eq!(found.result.curves.len(), 3);
        assert!(found.result.complete);
        assert_eq!(found.numbers(), [0, 1, 2]);
        assert!(request.name().contains("4 surfaces"));
    }

    #[test]
    fn a_cancelled_job_leaves_a_marked_result() {
        let request = Request::new(&Picks::new(Task::Pairs, &[]), &two_planes()).unwrap();
        let job = Job::new();
        job.cancel();
        let found = compute(&request, &job).unwrap();
        assert!(found.cancelled && !found.result.complete);
    }
}
