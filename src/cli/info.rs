//! `patchwright info FILE`: what a file contains, and what of it was not read.

use std::path::PathBuf;

use serde::Serialize;

use super::{CliError, Common, Exit, ProgressLine};
use crate::io::{self, ImportReport, Severity};
use crate::kernel::geom::{Aabb, Knots};
use crate::kernel::mesh::facets::{FacetCurve, FacetCurveKind, Facets};
use crate::kernel::mesh::grid::Grid;
use crate::model::defects::{self, DefectKind, DefectOptions, Defects};
use crate::model::document::{Document, Entity, Shape};
use crate::model::topology::{Meets, edges};

/// Arguments of `info`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The file
    pub file: PathBuf,
    /// List every entity, and every line of the import report
    #[arg(long)]
    pub all: bool,
    /// Look for faces that run through themselves too, which takes longest
    #[arg(long)]
    pub self_intersections: bool,
}

#[derive(Serialize)]
struct Info {
    file: String,
    unit: &'static str,
    surfaces: usize,
    /// Of the surfaces, those that are trimmed.
    faces: usize,
    curves: usize,
    patches: usize,
    meshes: usize,
    bounds: Option<Bounds>,
    /// How edges of faces and borders of whole surfaces meet.
    borders: BorderInfo,
    /// What is broken.
    defects: Defects,
    entities: Vec<EntityInfo>,
    import: ImportReport,
}

#[derive(Serialize)]
struct Bounds {
    min: [f64; 3],
    max: [f64; 3],
    diagonal: f64,
}

impl Bounds {
    fn of(bounds: &Aabb) -> Option<Self> {
        (!bounds.is_empty()).then(|| Self {
            min: bounds.min.to_array(),
            max: bounds.max.to_array(),
            diagonal: bounds.diagonal(),
        })
    }
}

#[derive(Default, Serialize)]
struct BorderInfo {
    /// What two edges may be apart and still be one.
    joining: f64,
    free: usize,
    /// Along others on a part of their length.
    partly: usize,
    shared: usize,
    /// Of the shared ones, those that are further off than contact.
    gaps: usize,
    largest_gap: f64,
    poles: usize,
}

impl BorderInfo {
    fn of(document: &Document) -> Self {
        let tolerances = document.tolerances();
        let mut info = Self { joining: tolerances.joining, ..Self::default() };
        for edge in edges(document, tolerances.joining, &super::job()) {
            match edge.meets {
                Meets::Free => info.free += 1,
                Meets::Pole => info.poles += 1,
                Meets::Partly { .. } => info.partly += 1,
                Meets::Shared { gap } => {
                    info.shared += 1;
                    info.gaps += usize::from(gap > tolerances.gap);
                    info.largest_gap = info.largest_gap.max(gap);
                }
            }
        }
        info
    }
}

#[derive(Serialize)]
struct EntityInfo {
    id: u64,
    kind: &'static str,
    /// The number by which specifications and subcommands name it: its place among those of its kind.
    number: usize,
    name: String,
    visible: bool,
    color: Option<[f32; 3]>,
    degree: Vec<usize>,
    control_points: Vec<usize>,
    spans: Vec<usize>,
    domain: Vec<[f64; 2]>,
    rational: bool,
    /// Of a mesh or block.
    #[serde(skip_serializing_if = "Option::is_none")]
    facets: Option<FacetsInfo>,
    bounds: Option<Bounds>,
}

#[derive(Serialize)]
struct FacetsInfo {
    /// The counts of a block in i, j, k.
    counts: Option<[usize; 3]>,
    vertices: usize,
    triangles: usize,
    area: f64,
    degenerate: usize,
    duplicate: usize,
    border_edges: usize,
    non_manifold_edges: usize,
    /// Borders, feature edges and grid lines: what `Chain` of a patch specification counts.
    chains: usize,
    /// Each of them, with `--all`.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    curves: Vec<ChainInfo>,
}

#[derive(Serialize)]
struct ChainInfo {
    name: String,
    kind: &'static str,
    points: usize,
    length: f64,
    from: [f64; 3],
    to: [f64; 3],
}

impl ChainInfo {
    fn of(chain: &FacetCurve) -> Self {
        let kind = match chain.kind {
            FacetCurveKind::Border => "border",
            FacetCurveKind::Feature => "feature",
            FacetCurveKind::GridBorder => "grid-border",
            FacetCurveKind::GridLine => "grid-line",
        };
        let [from, to] = chain.curve.ends().map(|p| p.to_array());
        let points = chain.curve.points();
        let length = points.windows(2).map(|p| p[0].distance(p[1])).sum();
        Self { name: chain.name.clone(), kind, points: points.len(), length, from, to }
    }
}

impl FacetsInfo {
    fn of(facets: &Facets, all: bool) -> Self {
        let (mesh, defects) = (facets.mesh(), facets.mesh().defects());
        Self {
            counts: facets.grid().map(Grid::counts),
            vertices: mesh.points().len(),
            triangles: mesh.triangles().len(),
            area: mesh.area(),
            degenerate: defects.degenerate,
            duplicate: defects.duplicate,
            border_edges: defects.border_edges,
            non_manifold_edges: defects.non_manifold_edges,
            chains: facets.curves().len(),
            curves: if all { facets.curves().iter().map(ChainInfo::of).collect() } else { Vec::new() },
        }
    }

    fn line(&self) -> String {
        let counts = self.counts.map_or(String::new(), |c| format!("{} x {} x {} points, ", c[0], c[1], c[2]));
        format!(
            "{counts}{} vertices, {} triangles, area {}, {} degenerate, {} duplicate, {} border edges, {} non-manifold \
             edges, {} pickable curves",
            self.vertices,
            self.triangles,
            self.area,
            self.degenerate,
            self.duplicate,
            self.border_edges,
            self.non_manifold_edges,
            self.chains
        )
    }
}

impl EntityInfo {
    fn of(entity: &Entity, number: usize, all: bool) -> Self {
        let (kind, knots, rational): (_, Vec<&Knots>, _) = match &entity.shape {
            Shape::Surface(s) => ("surface", s.knots().iter().collect(), s.weights().is_some()),
            Shape::Face(f) => ("face", f.surface().knots().iter().collect(), f.surface().weights().is_some()),
            Shape::Patch(p) => ("patch", p.surface.knots().iter().collect(), p.surface.weights().is_some()),
            Shape::Curve(c) => ("curve", vec![c.knots()], c.weights().is_some()),
            Shape::Mesh(_) => ("mesh", Vec::new(), false),
            Shape::Block(_) => ("block", Vec::new(), false),
        };
        Self {
            id: entity.id.0,
            kind,
            number,
            name: entity.name.clone(),
            visible: entity.visible,
            color: entity.color,
            degree: knots.iter().map(|k| k.degree()).collect(),
            control_points: knots.iter().map(|k| k.control_count()).collect(),
            spans: knots.iter().map(|k| k.breaks().len() - 1).collect(),
            domain: knots.iter().map(|k| k.domain()).collect(),
            rational,
            facets: entity.facets().map(|f| FacetsInfo::of(f, all)),
            bounds: Bounds::of(&entity.bounds()),
        }
    }

    fn line(&self) -> String {
        if let Some(facets) = &self.facets {
            let hidden = if self.visible { "" } else { ", hidden" };
            return format!("{} {} `{}`: {}{hidden}", self.kind, self.number, self.name, facets.line());
        }
        let product = |values: &[usize]| values.iter().map(usize::to_string).collect::<Vec<_>>().join(" x ");
        let domain = self.domain.iter().map(|[a, b]| format!("{a}..{b}")).collect::<Vec<_>>().join(" x ");
        format!(
            "{} {} `{}`: degree {}, {} control points, {} spans, {domain}{}{}",
            self.kind,
            self.number,
            self.name,
            product(&self.degree),
            product(&self.control_points),
            product(&self.spans),
            if self.rational { ", rational" } else { "" },
            if self.visible { "" } else { ", hidden" },
        )
    }
}

/// Runs `info`.
pub fn run(args: &Args, common: &Common) -> Result<Exit, CliError> {
    let opened = io::open(&args.file)?;
    let document = &opened.document;
    let bounds = document.bounds();
    let mut numbers = [0; 4];
    let entities: Vec<EntityInfo> = document
        .entities()
        .iter()
        .map(|entity| {
            let number = match entity.shape {
                Shape::Surface(_) | Shape::Face(_) => &mut numbers[0],
                Shape::Curve(_) => &mut numbers[1],
                Shape::Patch(_) => &mut numbers[2],
                Shape::Mesh(_) | Shape::Block(_) => &mut numbers[3],
            };
            *number += 1;
            EntityInfo::of(entity, *number - 1, args.all)
        })
        .collect();
    let [surfaces, curves, patches, meshes] = numbers;
    let unit = document.unit.symbol();
    let discrete = if meshes > 0 { format!(", {meshes} meshes and blocks") } else { String::new() };
    common.say(format!("{}: {surfaces} surfaces, {curves} curves, {patches} patches{discrete}", args.file.display()));
    common.say(format!("unit: {}", if unit.is_empty() { "unknown" } else { unit }));
    if let Some(b) = Bounds::of(&bounds) {
        let point = |p: [f64; 3]| format!("({}, {}, {})", p[0], p[1], p[2]);
        common.say(format!("box: {} to {}, diagonal {}", point(b.min), point(b.max), b.diagonal));
    }
    let border = BorderInfo::of(document);
    if surfaces > 0 {
        common.say(format!(
            "edges, joined within {:.3e}: {} free, {} partly shared, {} shared ({} with gaps, the \
             largest {:.3e}), {} poles",
            border.joining, border.free, border.partly, border.shared, border.gaps, border.largest_gap, border.poles
        ));
    }
    let options = DefectOptions { self_intersections: args.self_intersections, ..DefectOptions::of(document) };
    let job = super::job();
    let found = {
        let _progress = ProgressLine::watch(&job);
        defects::find(document, &options, &job)
    };
    say_defects(&found, document, args.all, common);
    if args.all {
        for entity in &entities {
            common.say(format!("  {}", entity.line()));
            for (k, c) in entity.facets.iter().flat_map(|f| f.curves.iter().enumerate()) {
                let point = |p: [f64; 3]| format!("({}, {}, {})", p[0], p[1], p[2]);
                let (from, to) = (point(c.from), point(c.to));
                common.say(format!(
                    "    chain {k} `{}`: {} points, length {}, {from} to {to}",
                    c.name, c.points, c.length
                ));
            }
        }
        opened.report.lines.iter().for_each(|line| common.say(format!("  {line}")));
    } else {
        say_report(&opened.report, Severity::Info, common);
    }
    common.json(&Info {
        file: args.file.display().to_string(),
        unit,
        surfaces,
        faces: document.faces().count(),
        curves,
        patches,
        meshes,
        bounds: Bounds::of(&bounds),
        borders: border,
        defects: found,
        entities,
        import: opened.report,
    })?;
    Ok(Exit::Done)
}

/// Prints how many defects of each kind there are and the worst of them; or all of them.
fn say_defects(found: &Defects, document: &Document, all: bool, common: &Common) {
    if found.faces == 0 {
        return;
    }
    let unit = document.unit.symbol();
    for kind in DefectKind::ALL {
        let of_kind: Vec<_> = found.of(kind).collect();
        let Some(worst) = of_kind.first() else { continue };
        let (measure, is_length) = kind.measure();
        let unit = if is_length && !unit.is_empty() { format!(" {unit}") } else { String::new() };
        common.say(format!("{}: {}, the worst {:.3e}{unit} ({measure})", kind.name(), of_kind.len(), worst.size));
        for defect in of_kind.iter().filter(|_| all) {
            let (faces, at) = (&defect.faces, defect.at);
            let deep = defect.depth.map_or(String::new(), |d| format!(", {d:.3e}{unit} deep,"));
            common.say(format!("  {:.3e}{unit}{deep} at ({}, {}, {}), faces {faces:?}", defect.size, at.x, at.y, at.z));
        }
    }
    if found.list.is_empty() {
        common.say("no defects found");
    }
    found.notes.iter().for_each(|note| common.warn(format!("warning: {note}")));
    if !found.complete {
        common.warn("warning: not everything was looked at");
    }
}

/// Prints the report from a severity on, equal lines counted together.
pub fn say_report(report: &ImportReport, from: Severity, common: &Common) {
    for (severity, entity, reason, count) in report.grouped().into_iter().filter(|line| line.0 >= from) {
        let times = if count > 1 { format!(" ({count} times)") } else { String::new() };
        common.say(format!("  {}: {entity}{times}: {reason}", severity.name()));
    }
}
