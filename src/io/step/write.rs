//! Writing STEP (ISO 10303-21, AP242): surfaces, trimmed faces and patches as open shells of faces that share their edges and vertices,
//! curves as a set beside them; names, colours, visibility and the unit.
//!
//! Faces that hang together ([`crate::model::shell`]) are one shell, so that a mesher finds the topology in the file and
//! need not sew. The uncertainty that the file states is the largest distance of borders that became one edge. Numbers
//! have as few digits as give the same double back; splines are not changed, except that knots which are not clamped are
//! refined exactly until they are, because many readers want that.

use std::collections::HashMap;
use std::fmt::Write as _;
use std::time::SystemTime;

use glam::DVec3;

use crate::io::Saved;
use crate::io::color::percent_of_linear;
use crate::io::number::real;
use crate::io::stamp::civil;
use crate::kernel::geom::{Curve, Knots, Surface};
use crate::model::document::{Document, Entity, EntityId, Shape, Unit};
use crate::model::shell::Shells;

/// How a file is written.
#[derive(Clone, Debug)]
pub struct StepOptions {
    /// The file name that the header states.
    pub file_name: String,
    /// The time that the header states.
    pub time: SystemTime,
    /// What two borders may be apart and still be one edge.
    pub joining: f64,
}

/// The text of a document. Meshes and blocks, which STEP faces do not hold, are counted in the notes.
pub fn write(document: &Document, options: &StepOptions) -> (String, Saved) {
    let shells = Shells::of(document, options.joining);
    let mut writer = Writer::default();
    let mut saved = Saved::default();
    let left_out = document.meshes().count();
    if left_out > 0 {
        let note = "meshes and blocks were left out: STEP holds surfaces and curves; save those as STL, OBJ or Plot3D";
        saved.notes.push(format!("{left_out} {note}"));
    }
    if document.unit == Unit::Unknown {
        saved.notes.push("the model has no unit; STEP needs one, millimetres were written".to_owned());
    }
    let product = writer.product(&options.file_name);
    let context = writer.context(document, shells.seams.largest_gap);
    let mut styles: Vec<(usize, EntityId)> = Vec::new();
    let models = writer.shells(document, &shells, &mut styles);
    let curves = writer.curves(document, &mut styles);
    saved.entities = styles.len();
    let name = text(&options.file_name);
    let origin = writer.frame();
    let listed = |items: &[usize]| items.iter().map(|n| format!(",#{n}")).collect::<String>();
    // The shells are the shape of the product, and curves too where there are no shells.
    let (kind, items) = match models.is_empty() {
        false => ("MANIFOLD_SURFACE_SHAPE_REPRESENTATION", listed(&models)),
        true => ("GEOMETRICALLY_BOUNDED_WIREFRAME_SHAPE_REPRESENTATION", listed(curves.as_slice())),
    };
    let shape = writer.add(&format!("{kind}({name},(#{origin}{items}),#{context})"));
    writer.add(&format!("SHAPE_DEFINITION_REPRESENTATION(#{product},#{shape})"));
    if let (false, Some(set)) = (models.is_empty(), curves) {
        let kind = "GEOMETRICALLY_BOUNDED_WIREFRAME_SHAPE_REPRESENTATION";
        let wires = writer.add(&format!("{kind}('curves',(#{origin},#{set}),#{context})"));
        writer.add(&format!("SHAPE_REPRESENTATION_RELATIONSHIP('','',#{shape},#{wires})"));
    }
    writer.styles(document, &styles, context);
    (writer.finish(options), saved)
}

/// A string: quotes and backslashes doubled, what is not ASCII as `\X2\` codes.
fn text(value: &str) -> String {
    let mut out = String::from("'");
    for c in value.chars() {
        match c {
            '\'' => out.push_str("''"),
            '\\' => out.push_str("\\\\"),
            ' '..='~' => out.push(c),
            // Writing to a string cannot fail.
            c if u32::from(c) > 0xFFFF => _ = write!(out, "\\X4\\{:08X}\\X0\\", u32::from(c)),
            c => _ = write!(out, "\\X2\\{:04X}\\X0\\", u32::from(c)),
        }
    }
    out.push('\'');
    out
}

fn joined<T>(values: impl IntoIterator<Item = T>, each: impl Fn(T) -> String) -> String {
    values.into_iter().map(each).collect::<Vec<_>>().join(",")
}

/// The multiplicities and the distinct knots, as two lists.
fn knots(knots: &Knots) -> [String; 2] {
    let all = knots.multiplicities();
    [joined(&all, |m| m.1.to_string()), joined(&all, |m| real(m.0))]
}

/// The statements of a file, numbered as they come.
#[derive(Default)]
struct Writer {
    data: String,
    last: usize,
    /// Colours by their bits.
    colors: HashMap<[u32; 3], usize>,
}

impl Writer {
    /// Adds a statement and says its number.
    fn add(&mut self, body: &str) -> usize {
        self.last += 1;
        let _ = writeln!(self.data, "#{}={body};", self.last);
        self.last
    }

    /// What the shape belongs to: a product, its definition, and the definition of its shape, which is returned.
    fn product(&mut self, name: &str) -> usize {
        let name = text(name);
        let application = self.add("APPLICATION_CONTEXT('managed model based 3d engineering')");
        self.add(&format!(
            "APPLICATION_PROTOCOL_DEFINITION('international standard','ap242_managed_model_based_3d_engineering',2014,\
             #{application})"
        ));
        let context = self.add(&format!("PRODUCT_CONTEXT('',#{application},'mechanical')"));
        let product = self.add(&format!("PRODUCT({name},{name},'',(#{context}))"));
        self.add(&format!("PRODUCT_RELATED_PRODUCT_CATEGORY('part','',(#{product}))"));
        let formation = self.add(&format!("PRODUCT_DEFINITION_FORMATION('','',#{product})"));
        let stage = self.add(&format!("PRODUCT_DEFINITION_CONTEXT('part definition',#{application},'design')"));
        let definition = self.add(&format!("PRODUCT_DEFINITION('design','',#{formation},#{stage})"));
        self.add(&format!("PRODUCT_DEFINITION_SHAPE('','',#{definition})"))
    }

    /// The context of all representations: units, and how far edges are from the faces that share them.
    fn context(&mut self, document: &Document, gap: f64) -> usize {
        let si = |prefix: &str| format!("(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT({prefix},.METRE.))");
        let mut converted = |name: &str, millimetres: f64| {
            let exponents = self.add("DIMENSIONAL_EXPONENTS(1.,0.,0.,0.,0.,0.,0.)");
            let base = self.add(&si(".MILLI."));
            let size = real(millimetres);
            let measure = self.add(&format!("LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE({size}),#{base})"));
            format!("(CONVERSION_BASED_UNIT('{name}',#{measure})LENGTH_UNIT()NAMED_UNIT(#{exponents}))")
        };
        let length = match document.unit {
            Unit::Unknown | Unit::Millimetre => si(".MILLI."),
            Unit::Metre => si("$"),
            Unit::Centimetre => si(".CENTI."),
            Unit::Kilometre => si(".KILO."),
            Unit::Micrometre => si(".MICRO."),
            Unit::Inch => converted("INCH", 25.4),
            Unit::Foot => converted("FOOT", 304.8),
            Unit::Mile => converted("MILE", 1_609_344.0),
            Unit::Mil => converted("MIL", 0.0254),
            Unit::Microinch => converted("MICROINCH", 0.000_025_4),
        };
        let length = self.add(&length);
        let angle = self.add("(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.))");
        let solid = self.add("(NAMED_UNIT(*)SI_UNIT($,.STERADIAN.)SOLID_ANGLE_UNIT())");
        let uncertainty = real(gap.max(1e-3 * document.tolerances().follow));
        let uncertainty = self.add(&format!(
            "UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE({uncertainty}),#{length},'distance_accuracy_value',\
             'the largest distance of borders that share an edge')"
        ));
        self.add(&format!(
            "(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT((#{uncertainty}))\
             GLOBAL_UNIT_ASSIGNED_CONTEXT((#{length},#{angle},#{solid}))REPRESENTATION_CONTEXT('',''))"
        ))
    }

    /// The axes of the model.
    fn frame(&mut self) -> usize {
        let origin = self.point(DVec3::ZERO);
        let z = self.add("DIRECTION('',(0.,0.,1.))");
        let x = self.add("DIRECTION('',(1.,0.,0.))");
        self.add(&format!("AXIS2_PLACEMENT_3D('',#{origin},#{z},#{x})"))
    }

    fn point(&mut self, p: DVec3) -> usize {
        self.add(&format!("CARTESIAN_POINT('',({}))", joined(p.to_array(), real)))
    }

    fn points(&mut self, points: impl IntoIterator<Item = DVec3>) -> String {
        let numbers: Vec<usize> = points.into_iter().map(|p| self.point(p)).collect();
        joined(numbers, |n| format!("#{n}"))
    }

    fn curve(&mut self, curve: &Curve, name: &str) -> usize {
        let [a, b] = curve.domain();
        // A restriction to the whole domain clamps the knots; it cannot fail, and if it did they would be kept.
        let refined = if curve.knots().is_clamped() { None } else { curve.restricted(a, b).ok() };
        let curve = refined.as_ref().unwrap_or(curve);
        let points = self.points(curve.points().iter().copied());
        self.spline(curve, &points, name)
    }

    /// A spline through points that stand already.
    fn spline(&mut self, curve: &Curve, points: &str, name: &str) -> usize {
        let [multiplicities, values] = knots(curve.knots());
        let shape = format!("{},({points}),.UNSPECIFIED.,.F.,.F.", curve.knots().degree());
        let knots = format!("({multiplicities}),({values}),.UNSPECIFIED.");
        let name = text(name);
        self.add(&match curve.weights() {
            None => format!("B_SPLINE_CURVE_WITH_KNOTS({name},{shape},{knots})"),
            Some(weights) => format!(
                "(BOUNDED_CURVE()B_SPLINE_CURVE({shape})B_SPLINE_CURVE_WITH_KNOTS({knots})CURVE()\
                 GEOMETRIC_REPRESENTATION_ITEM()RATIONAL_B_SPLINE_CURVE(({}))REPRESENTATION_ITEM({name}))",
                joined(weights, |&w| real(w))
            ),
        })
    }

    fn surface(&mut self, surface: &Surface) -> usize {
        let clamped = surface.knots().iter().all(Knots::is_clamped);
        let [u, v] = surface.domain();
        let refined = if clamped { None } else { surface.restricted(u, v).ok() };
        let surface = refined.as_ref().unwrap_or(surface);
        let [nu, nv] = surface.counts();
        let rows: Vec<String> =
            (0..nu).map(|i| format!("({})", self.points((0..nv).map(|j| surface.point(i, j))))).collect();
        let [[mu, ku], [mv, kv]] = [0, 1].map(|d| knots(&surface.knots()[d]));
        let [du, dv] = [0, 1].map(|d| surface.knots()[d].degree());
        let shape = format!("{du},{dv},({}),.UNSPECIFIED.,.F.,.F.,.F.", rows.join(","));
        let knots = format!("({mu}),({mv}),({ku}),({kv}),.UNSPECIFIED.");
        self.add(&match surface.weights() {
            None => format!("B_SPLINE_SURFACE_WITH_KNOTS('',{shape},{knots})"),
            Some(weights) => {
                let rows = joined(0..nu, |i| format!("({})", joined(0..nv, |j| real(weights[j * nu + i]))));
                format!(
                    "(BOUNDED_SURFACE()B_SPLINE_SURFACE({shape})B_SPLINE_SURFACE_WITH_KNOTS({knots})\
                     GEOMETRIC_REPRESENTATION_ITEM()RATIONAL_B_SPLINE_SURFACE(({rows}))REPRESENTATION_ITEM('')SURFACE())"
                )
            }
        })
    }

    /// The curves of edges in the parameters of the faces that use them: per edge, the face and the statement.
    fn pcurves(&mut self, shells: &Shells, surfaces: &[usize]) -> Vec<Vec<(usize, usize)>> {
        let mut out = vec![Vec::new(); shells.edges.len()];
        let mut plane = None;
        for (k, face) in shells.faces.iter().enumerate() {
            for used in face.rings.iter().flatten() {
                let Some(pcurve) = &used.pcurve else { continue };
                let context = *plane.get_or_insert_with(|| {
                    let kinds = "GEOMETRIC_REPRESENTATION_CONTEXT(2)PARAMETRIC_REPRESENTATION_CONTEXT()";
                    self.add(&format!("({kinds}REPRESENTATION_CONTEXT('',''))"))
                });
                let points: Vec<usize> = pcurve
                    .points()
                    .iter()
                    .map(|p| self.add(&format!("CARTESIAN_POINT('',({},{}))", real(p.x), real(p.y))))
                    .collect();
                let curve = self.spline(pcurve, &joined(points, |n| format!("#{n}")), "");
                let shape = self.add(&format!("DEFINITIONAL_REPRESENTATION('',(#{curve}),#{context})"));
                out[used.edge].push((k, self.add(&format!("PCURVE('',#{},#{shape})", surfaces[k]))));
            }
        }
        out
    }

    /// One surface model a shell. `styles` takes every face with its entity.
    fn shells(&mut self, document: &Document, shells: &Shells, styles: &mut Vec<(usize, EntityId)>) -> Vec<usize> {
        let vertices: Vec<usize> = shells
            .vertices
            .iter()
            .map(|&at| {
                let point = self.point(at);
                self.add(&format!("VERTEX_POINT('',#{point})"))
            })
            .collect();
        let surfaces: Vec<usize> = shells.faces.iter().map(|f| self.surface(&f.surface)).collect();
        let pcurves = self.pcurves(shells, &surfaces);
        let mut edges = Vec::new();
        for (edge, on) in shells.edges.iter().zip(pcurves) {
            let curve = self.curve(&edge.curve, "");
            let [a, b] = edge.ends.map(|end| vertices[end]);
            let listed = joined(&on, |(_, pcurve)| format!("#{pcurve}"));
            let curve = match on.as_slice() {
                [] => curve,
                [(f, _), (g, _)] if f == g => self.add(&format!("SEAM_CURVE('',#{curve},({listed}),.CURVE_3D.)")),
                // More than two is not manifold, and no surface curve.
                [_] | [_, _] => self.add(&format!("SURFACE_CURVE('',#{curve},({listed}),.CURVE_3D.)")),
                _ => curve,
            };
            edges.push(self.add(&format!("EDGE_CURVE('',#{a},#{b},#{curve},.T.)")));
        }
        let mut models = Vec::new();
        for shell in &shells.shells {
            let mut faces = Vec::new();
            for &k in shell {
                let face = &shells.faces[k];
                let surface = surfaces[k];
                let flag = |forward: bool| if forward { ".T." } else { ".F." };
                let mut bounds = Vec::new();
                for (at, ring) in face.rings.iter().enumerate() {
                    let mut uses: Vec<usize> = ring
                        .iter()
                        .map(|used| {
                            let forward = flag(used.reversed == face.turned);
                            self.add(&format!("ORIENTED_EDGE('',*,*,#{},{forward})", edges[used.edge]))
                        })
                        .collect();
                    if face.turned {
                        uses.reverse();
                    }
                    let edges = self.add(&format!("EDGE_LOOP('',({}))", joined(uses, |n| format!("#{n}"))));
                    let kind = if at == 0 { "FACE_OUTER_BOUND" } else { "FACE_BOUND" };
                    bounds.push(self.add(&format!("{kind}('',#{edges},.T.)")));
                }
                let bound = joined(bounds, |n| format!("#{n}"));
                let name = document.get(face.entity).map_or("", |e| e.name.as_str());
                let sense = flag(!face.turned);
                let face_number = self.add(&format!("ADVANCED_FACE({},({bound}),#{surface},{sense})", text(name)));
                faces.push(face_number);
                styles.push((face_number, face.entity));
            }
            let shell = self.add(&format!("OPEN_SHELL('',({}))", joined(faces, |n| format!("#{n}"))));
            models.push(self.add(&format!("SHELL_BASED_SURFACE_MODEL('',(#{shell}))")));
        }
        models
    }

    /// The set of all free curves.
    fn curves(&mut self, document: &Document, styles: &mut Vec<(usize, EntityId)>) -> Option<usize> {
        let mut numbers = Vec::new();
        for entity in document.entities() {
            if let Shape::Curve(curve) = &entity.shape {
                let number = self.curve(curve, &entity.name);
                numbers.push(number);
                styles.push((number, entity.id));
            }
        }
        if numbers.is_empty() {
            return None;
        }
        Some(self.add(&format!("GEOMETRIC_CURVE_SET('',({}))", joined(numbers, |n| format!("#{n}")))))
    }

    /// Colours, and what is hidden.
    fn styles(&mut self, document: &Document, items: &[(usize, EntityId)], context: usize) {
        let entities: HashMap<EntityId, &Entity> = document.entities().iter().map(|e| (e.id, e.as_ref())).collect();
        let (mut styled, mut hidden) = (Vec::new(), Vec::new());
        for &(item, id) in items {
            let Some(entity) = entities.get(&id).filter(|e| e.color.is_some() || !e.visible) else { continue };
            let style = entity.color.map(|color| self.style(color, entity.surface().is_some()));
            let styles = style.map(|s| format!("#{s}")).unwrap_or_default();
            let number = self.add(&format!("STYLED_ITEM('',({styles}),#{item})"));
            styled.push(number);
            if !entity.visible {
                hidden.push(number);
            }
        }
        if !styled.is_empty() {
            let items = joined(&styled, |n| format!("#{n}"));
            let kind = "MECHANICAL_DESIGN_GEOMETRIC_PRESENTATION_REPRESENTATION";
            self.add(&format!("{kind}('',({items}),#{context})"));
        }
        if !hidden.is_empty() {
            self.add(&format!("INVISIBILITY(({}))", joined(&hidden, |n| format!("#{n}"))));
        }
    }

    /// The style of a colour.
    fn style(&mut self, color: [f32; 3], is_surface: bool) -> usize {
        let known = self.colors.get(&color.map(f32::to_bits)).copied();
        let number = known.unwrap_or_else(|| {
            let rgb = joined(color, |c| real(percent_of_linear(c) / 100.0));
            self.add(&format!("COLOUR_RGB('',{rgb})"))
        });
        self.colors.insert(color.map(f32::to_bits), number);
        let style = if is_surface {
            let fill = self.add(&format!("FILL_AREA_STYLE_COLOUR('',#{number})"));
            let area = self.add(&format!("FILL_AREA_STYLE('',(#{fill}))"));
            let fill = self.add(&format!("SURFACE_STYLE_FILL_AREA(#{area})"));
            let side = self.add(&format!("SURFACE_SIDE_STYLE('',(#{fill}))"));
            self.add(&format!("SURFACE_STYLE_USAGE(.BOTH.,#{side})"))
        } else {
            let font = self.add("DRAUGHTING_PRE_DEFINED_CURVE_FONT('continuous')");
            self.add(&format!("CURVE_STYLE('',#{font},POSITIVE_LENGTH_MEASURE(0.1),#{number})"))
        };
        self.add(&format!("PRESENTATION_STYLE_ASSIGNMENT((#{style}))"))
    }

    fn finish(self, options: &StepOptions) -> String {
        let [year, month, day, hour, minute, second] = civil(options.time);
        let time = format!("{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}");
        let name = text(&options.file_name);
        let program = concat!("Patchwright ", env!("CARGO_PKG_VERSION"));
        format!(
            "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION((''),'2;1');\n\
             FILE_NAME({name},'{time}',(''),(''),'{program}','{program}','');\n\
             FILE_SCHEMA(('AP242_MANAGED_MODEL_BASED_3D_ENGINEERING_MIM_LF {{ 1 0 10303 442 1 1 4 }}'));\n\
             ENDSEC;\nDATA;\n{}ENDSEC;\nEND-ISO-10303-21;\n",
            self.data
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strings_keep_quotes_backslashes_and_letters_of_every_script() {
        for name in ["", "it's", "a\\b", "Flügel", "翼 𝛼", "tab\there"] {
            let written = text(name);
            assert!(written.is_ascii() && !written[1..written.len() - 1].replace("''", "").contains('\''), "{written}");
            let raw = &written[1..written.len() - 1];
            assert_eq!(super::super::part21::text(raw), name, "{written}");
        }
    }
}
