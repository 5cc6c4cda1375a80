//! Makes small STEP files for tests, statement by statement, by the rules of the format and by no code of the program.

#![allow(dead_code, reason = "each test binary uses a part of it")]

use patchwright::io::{Opened, step};

/// A STEP file, statement by statement.
#[derive(Clone, Default)]
pub struct File {
    pub lines: Vec<String>,
    pub bound_sense: bool,
}

impl File {
    pub fn add(&mut self, text: impl AsRef<str>) -> usize {
        let number = self.lines.len() + 1;
        self.lines.push(format!("#{number}={};", text.as_ref()));
        number
    }

    pub fn point(&mut self, p: [f64; 3]) -> usize {
        self.add(format!("CARTESIAN_POINT('',({:?},{:?},{:?}))", p[0], p[1], p[2]))
    }

    pub fn direction(&mut self, p: [f64; 3]) -> usize {
        self.add(format!("DIRECTION('',({:?},{:?},{:?}))", p[0], p[1], p[2]))
    }

    pub fn frame(&mut self, origin: [f64; 3], z: [f64; 3], x: [f64; 3]) -> usize {
        let (o, z, x) = (self.point(origin), self.direction(z), self.direction(x));
        self.add(format!("AXIS2_PLACEMENT_3D('',#{o},#{z},#{x})"))
    }

    pub fn vertex(&mut self, p: [f64; 3]) -> usize {
        let p = self.point(p);
        self.add(format!("VERTEX_POINT('',#{p})"))
    }

    pub fn line(&mut self, a: [f64; 3], b: [f64; 3]) -> usize {
        let d = [b[0] - a[0], b[1] - a[1], b[2] - a[2]];
        let (p, d) = (self.point(a), self.direction(d));
        let v = self.add(format!("VECTOR('',#{d},1.)"));
        self.add(format!("LINE('',#{p},#{v})"))
    }

    pub fn circle(&mut self, origin: [f64; 3], z: [f64; 3], x: [f64; 3], r: f64) -> usize {
        let f = self.frame(origin, z, x);
        self.add(format!("CIRCLE('',#{f},{r:?})"))
    }

    pub fn edge(&mut self, from: usize, to: usize, curve: usize) -> usize {
        self.add(format!("EDGE_CURVE('',#{from},#{to},#{curve},.T.)"))
    }

    /// A bound of edges with their senses.
    pub fn bound(&mut self, uses: &[(usize, bool)]) -> usize {
        // Some files run a loop backwards and say so at the bound.
        let turned = self.bound_sense;
        let mut uses: Vec<(usize, bool)> = uses.iter().map(|&(e, s)| (e, s != turned)).collect();
        if turned {
            uses.reverse();
        }
        let list: Vec<String> = uses
            .iter()
            .map(|(e, s)| {
                format!("#{}", self.add(format!("ORIENTED_EDGE('',*,*,#{e},.{}.)", if *s { 'T' } else { 'F' })))
            })
            .collect();
        let ring = self.add(format!("EDGE_LOOP('',({}))", list.join(",")));
        self.add(format!("FACE_OUTER_BOUND('',#{ring},.{}.)", if turned { 'F' } else { 'T' }))
    }

    pub fn face(&mut self, surface: usize, bounds: &[usize], sense: bool) -> usize {
        let list: Vec<String> = bounds.iter().map(|b| format!("#{b}")).collect();
        self.add(format!("ADVANCED_FACE('',({}),#{surface},.{}.)", list.join(","), if sense { 'T' } else { 'F' }))
    }

    /// A context in millimetres and degrees.
    pub fn context(&mut self) -> usize {
        let mm = self.add("(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.))");
        let radian = self.add("(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.))");
        let measure =
            self.add(format!("PLANE_ANGLE_MEASURE_WITH_UNIT(PLANE_ANGLE_MEASURE(0.017453292519943295),#{radian})"));
        let degree = self.add(format!("(CONVERSION_BASED_UNIT('DEGREE',#{measure})NAMED_UNIT(*)PLANE_ANGLE_UNIT())"));
        self.add(format!(
            "(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNIT_ASSIGNED_CONTEXT((#{mm},#{degree}))REPRESENTATION_CONTEXT('',''))"
        ))
    }

    pub fn shell(&mut self, faces: &[usize]) -> usize {
        let list: Vec<String> = faces.iter().map(|f| format!("#{f}")).collect();
        self.add(format!("CLOSED_SHELL('',({}))", list.join(",")))
    }

    /// A representation of these items.
    pub fn shape(&mut self, items: &[usize]) -> usize {
        let context = self.context();
        let list: Vec<String> = items.iter().map(|f| format!("#{f}")).collect();
        self.add(format!("ADVANCED_BREP_SHAPE_REPRESENTATION('',({}),#{context})", list.join(",")))
    }

    /// The text of the file.
    pub fn text(&self) -> String {
        format!(
            "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION((''),'2;1');\nENDSEC;\nDATA;\n{}\nENDSEC;\nEND-ISO-10303-21;\n",
            self.lines.join("\n")
        )
    }

    pub fn read(&self) -> Opened {
        let opened = step::open(self.text().as_bytes());
        for line in &opened.report.lines {
            println!("{line}");
        }
        opened
    }
}

pub const X: [f64; 3] = [1.0, 0.0, 0.0];
pub const Z: [f64; 3] = [0.0, 0.0, 1.0];
pub const O: [f64; 3] = [0.0; 3];

/// A frustum (radius 1 below, 2 above, height 1) with a seam, and its two caps.
pub fn frustum(file: &mut File) -> Vec<usize> {
    let (low, high) = (file.vertex(X), file.vertex([2.0, 0.0, 1.0]));
    let (c0, c1) = (file.circle(O, Z, X, 1.0), file.circle(Z, Z, X, 2.0));
    let l = file.line(X, [2.0, 0.0, 1.0]);
    let (e0, e1, seam) = (file.edge(low, low, c0), file.edge(high, high, c1), file.edge(low, high, l));
    let f = file.frame(O, Z, X);
    let cone = file.add(format!("CONICAL_SURFACE('',#{f},1.,45.)"));
    let side = file.bound(&[(e0, true), (seam, true), (e1, false), (seam, false)]);
    let side = file.face(cone, &[side], true);
    let bottom = file.add(format!("PLANE('',#{f})"));
    let below = file.bound(&[(e0, false)]);
    let below = file.face(bottom, &[below], false);
    let g = file.frame(Z, Z, X);
    let top = file.add(format!("PLANE('',#{g})"));
    let above = file.bound(&[(e1, true)]);
    vec![side, below, file.face(top, &[above], true)]
}
