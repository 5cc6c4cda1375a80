//! From picks to a result: what a worker runs.

use std::fmt;

use super::hatch::over_patches;
use super::{Found, Picks, Subject, Task, subjects};
use crate::kernel::intersect::{Engine, IntersectError, intersect_every_pair, intersect_with};
use crate::kernel::job::Job;
use crate::kernel::mesh::body::Body;
use crate::kernel::self_ssi::SelfIntersectOptions;
use crate::kernel::self_ssi::model::{merged, self_intersect_all};
use crate::model::document::Document;

/// Everything that a worker needs.
#[derive(Clone, Debug)]
pub struct Request {
    /// What is intersected with what.
    pub task: Task,
    /// All bodies of the document; the sides are places in it.
    pub subjects: Vec<Subject>,
    /// The bodies of both sides.
    pub sides: [Vec<usize>; 2],
    /// How closely curves follow, in model units; by the model's size when left out.
    pub tol: Option<f64>,
    /// Which engine; triangulations where they have to be when left out. Surfaces meet themselves on the exact ones only.
    pub engine: Option<Engine>,
}

impl Request {
    /// What the picks ask for, or what is missing.
    pub fn new(picks: &Picks, document: &Document) -> Result<Self, &'static str> {
        let chosen = picks.chosen(document)?;
        let subjects = subjects(document);
        let place = |id| subjects.iter().position(|s: &Subject| s.id == id);
        let sides = chosen.map(|ids| ids.into_iter().filter_map(place).collect());
        Ok(Self { task: picks.task, subjects, sides, tol: None, engine: picks.engine })
    }

    /// The bodies of a side with their numbers.
    fn bodies(&self, side: usize) -> Vec<(usize, Body)> {
        let all = self.sides[side].iter();
        all.filter_map(|&n| Some((n, self.subjects.get(n)?.body.clone()))).collect()
    }

    /// The engine that it runs on.
    pub fn engine(&self) -> Engine {
        if self.task == Task::Itself {
            return Engine::Bvh;
        }
        let all = self.sides.iter().flatten().filter_map(|&n| self.subjects.get(n));
        self.engine.unwrap_or_else(|| Engine::for_bodies(all.map(|s| &s.body)))
    }

    /// An error with the body's name in place of its number.
    fn explained(&self, error: IntersectError) -> String {
        let named = match &error {
            IntersectError::NotParametric { number } => self.subjects.get(*number).map(|s| &s.name),
            _ => None,
        };
        match named {
            Some(name) => format!("{name} has triangles only; intersect it on triangulations"),
            None => error.to_string(),
        }
    }

    /// What the job is called.
    pub fn name(&self) -> String {
        let count = |side: &[usize]| match side {
            [one] => self.subjects.get(*one).map_or_else(|| "something".to_owned(), |s| s.name.clone()),
            many => format!("{} bodies", many.len()),
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
    let (engine, tol) = (request.engine(), request.tol);
    let result = match request.task {
        Task::Sets => intersect_with(engine, &request.bodies(0), &request.bodies(1), tol, job)
            .map_err(|e| request.explained(e))?,
        Task::Pairs => intersect_every_pair(engine, &request.bodies(0), tol, job).map_err(|e| request.explained(e))?,
        Task::Itself => {
            let options = SelfIntersectOptions { tol: request.tol, ..SelfIntersectOptions::default() };
            let surfaces = request.sides[0].iter().filter_map(|&n| Some((n, request.subjects.get(n)?.surface()?)));
            let surfaces: Vec<_> = surfaces.collect();
            let all = self_intersect_all(&surfaces, &options, job).map_err(|e| e.to_string())?;
            merged(all.into_iter().map(|found| found.result))
        }
    };
    let mut found = Found {
        subjects: request.subjects.clone(),
        result,
        with_itself: request.task == Task::Itself,
        engine,
        cancelled: job.is_cancelled(),
        hatches: Vec::new(),
        warnings: job.warnings(),
    };
    if !found.with_itself {
        let second = if request.task == Task::Pairs { 0 } else { 1 };
        let sides = [&request.sides[0][..], &request.sides[second][..]];
        found.hatches = (0..found.result.regions.len()).map(|k| over_patches(&found, k, sides, job)).collect();
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::DVec3;

    use super::*;
    use crate::kernel::mesh::facets::Facets;
    use crate::kernel::mesh::tri_mesh::TriMesh;
    use crate::model::document::Shape;
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
        // Each line is cut where the third plane crosses it, and each piece can be kept as a curve.
        assert_eq!(found.result.curves.len(), 6);
        let kept = super::super::keep::curves(&found, 0..6);
        assert!(kept.notes.is_empty());
        for (_, curve) in &kept.curves {
            let [from, to] = curve.domain();
            assert!(
                [from, to].iter().any(|&t| curve.eval(t).length() < 1e-14),
                "it starts or ends in the point of all"
            );
        }
        assert!(found.result.complete);
        assert_eq!(found.numbers(), [0, 1, 2]);
        assert!(request.name().contains("4 bodies"));
    }

    /// A square crosses a mesh of the same square turned upright: the engine is the one for triangles, and the curve is
    /// the segment that they share.
    #[test]
    fn a_surface_meets_a_mesh() {
        let [x, y, z] = DVec3::AXES;
        let mut model = document([square(DVec3::ZERO, x, y)]);
        let corners = vec![-x - z, x - z, x + z, z - x];
        let mesh = TriMesh::new(corners, vec![[0, 1, 2], [0, 2, 3]]).unwrap();
        let upright = model.add("upright", Shape::Mesh(Arc::new(Facets::of_mesh(mesh))), None);
        let flat = model.entities()[0].id;
        let mut picks = Picks::new(Task::Sets, &[upright, flat]);
        let request = Request::new(&picks, &model).unwrap();
        assert_eq!(request.engine(), Engine::Mesh);
        let found = compute(&request, &Job::new()).unwrap();
        assert!(found.result.complete && found.result.curves.len() == 1 && found.engine == Engine::Mesh);
        let long = |p: &[DVec3]| p.windows(2).map(|s| s[0].distance(s[1])).sum::<f64>();
        let points = found.points(super::super::Item::Curve(0));
        assert!((long(&points) - 2.0).abs() < 1e-9, "{points:?}");
        let on = super::super::OnCurve::at_fraction(&found, 0, 0.25).unwrap();
        assert!((on.point(&found).unwrap().xyz.x.abs() - 0.5).abs() < 1e-9, "the cursor runs along it");
        picks.engine = Some(Engine::Bvh);
        let error = compute(&Request::new(&picks, &model).unwrap(), &Job::new()).unwrap_err();
        assert!(error.contains("upright"), "{error}");
        // A mesh is no surface that could meet itself, and is left out of all pairs unless triangles are asked for.
        assert!(Picks::new(Task::Itself, &[upright]).chosen(&model).is_err());
        assert!(Picks::new(Task::Pairs, &[]).chosen(&model).is_err());
        let all = Picks { engine: Some(Engine::Mesh), ..Picks::new(Task::Pairs, &[]) };
        let found = compute(&Request::new(&all, &model).unwrap(), &Job::new()).unwrap();
        assert_eq!(found.result.curves.len(), 1);
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
