//! Makes small IGES files for tests, line by line, by the rules of the format and by no code of the program.

#![allow(dead_code, reason = "each test binary uses a part of it")]

/// One entity.
#[derive(Clone, Debug, Default)]
pub struct Entity {
    pub kind: i64,
    pub form: i64,
    pub transform: usize,
    pub color: i64,
    pub status: Option<&'static str>,
    pub label: &'static str,
    /// Everything behind the entity type.
    pub parameters: String,
}

/// A file.
#[derive(Clone, Debug)]
pub struct File {
    pub global: String,
    pub entities: Vec<Entity>,
    pub line_end: &'static str,
    pub value_delimiter: char,
    pub record_delimiter: char,
    /// The last column of parameter data: 64 by the book, 65 in some files.
    pub width: usize,
}

impl Default for File {
    fn default() -> Self {
        Self::with_unit("2,2HMM", "1.")
    }
}

impl File {
    /// A file with `flag,name` of the unit and the scale.
    pub fn with_unit(unit: &str, scale: &str) -> Self {
        let global = format!(
            "1H,,1H;,4Htest,8Htest.igs,4Htest,1H1,32,38,6,308,15,4Htest,{scale},{unit},1,0.01,\
             15H20260101.000000,1.E-9,10.,2Hme,2Hus,11,0;"
        );
        Self { global, entities: Vec::new(), line_end: "\n", value_delimiter: ',', record_delimiter: ';', width: 64 }
    }

    /// Adds an entity and gives its directory entry.
    pub fn add(&mut self, kind: i64, parameters: impl Into<String>) -> usize {
        self.add_entity(Entity { kind, parameters: parameters.into(), ..Entity::default() })
    }

    /// Adds an entity with attributes and gives its directory entry.
    pub fn add_entity(&mut self, entity: Entity) -> usize {
        self.entities.push(entity);
        2 * self.entities.len() - 1
    }

    fn lines_of(&self, text: &str, width: usize) -> Vec<String> {
        let mut lines = vec![String::new()];
        for value in text.split_inclusive([self.value_delimiter, self.record_delimiter]) {
            let last = lines.len() - 1;
            if lines[last].len() + value.len() > width {
                lines.push(value.to_owned());
            } else {
                lines[last].push_str(value);
            }
        }
        lines
    }

    /// The text of the file.
    pub fn text(&self) -> String {
        let mut out = vec![format!("{:72}S{:7}", "test", 1)];
        let translate = |text: &str| -> String {
            let mark = |c| match c {
                ',' => self.value_delimiter,
                ';' => self.record_delimiter,
                other => other,
            };
            text.chars().map(mark).collect()
        };
        let global = self.lines_of(&translate(&self.global), 72);
        out.extend(global.iter().enumerate().map(|(i, line)| format!("{line:72}G{:7}", i + 1)));
        let (mut directory, mut parameter) = (Vec::new(), Vec::new());
        for (i, e) in self.entities.iter().enumerate() {
            let sequence = 2 * i + 1;
            let text = translate(&format!("{},{};", e.kind, e.parameters));
            let lines = self.lines_of(&text, self.width);
            let status = e.status.unwrap_or("00000000");
            let (kind, first, transform) = (e.kind, parameter.len() + 1, e.transform);
            directory.push(format!("{kind:8}{first:8}{0:8}{0:8}{0:8}{0:8}{transform:8}{0:8}{status}D{sequence:7}", 0));
            let (color, count, form, label) = (e.color, lines.len(), e.form, e.label);
            let next = sequence + 1;
            directory.push(format!("{kind:8}{0:8}{color:8}{count:8}{form:8}{1:16}{label:>8}{0:8}D{next:7}", 0, ""));
            for line in lines {
                let number = parameter.len() + 1;
                let pointer_width = 72 - self.width;
                parameter.push(format!("{line:0$}{sequence:1$}P{number:7}", self.width, pointer_width));
            }
        }
        let (d, p) = (directory.len(), parameter.len());
        out.extend(directory);
        out.extend(parameter);
        let counts = format!("S{:7}G{:7}D{d:7}P{p:7}", 1, global.len());
        out.push(format!("{counts:72}T{:7}", 1));
        out.join(self.line_end) + self.line_end
    }
}

/// Parameters of entity 128: a bilinear patch over [0, 1]^2 with these corners (00, 10, 01, 11).
pub fn bilinear(corners: [[f64; 3]; 4]) -> String {
    let points: Vec<String> = corners.as_flattened().iter().map(|c| format!("{c:?}")).collect();
    format!("1,1,1,1,0,0,1,0,0,0.,0.,1.,1.,0.,0.,1.,1.,1.,1.,1.,1.,{},0.,1.,0.,1.", points.join(","))
}

/// The unit square at height z.
pub fn square(z: f64) -> String {
    bilinear([[0.0, 0.0, z], [1.0, 0.0, z], [0.0, 1.0, z], [1.0, 1.0, z]])
}

/// A file with every kind of entity that the reader knows.
pub fn one_of_each() -> File {
    let mut file = File::default();
    let name = file.add_entity(Entity { kind: 406, form: 15, parameters: "1,4Hname".into(), ..Entity::default() });
    let color = file.add(314, "10.,20.,30.") as i64;
    let map = file.add(124, "1.,0.,0.,1.,0.,1.,0.,2.,0.,0.,1.,3.");
    let parameters = format!("{},0,1,{name}", square(1.0));
    let s = file.add_entity(Entity { kind: 128, transform: map, color: -color, parameters, ..Entity::default() });
    let line = file.add(110, "0.,0.,0.,1.,0.,0.");
    let arc = file.add(100, "0.,0.,0.,1.,0.,0.,1.");
    let chain = file.add(102, format!("2,{line},{arc}"));
    let on = file.add(142, format!("0,{s},{chain},{chain},3"));
    file.add(144, format!("{s},1,1,{on},{on}"));
    let boundary = file.add(141, format!("0,3,{s},1,{line},1,1,{arc}"));
    file.add(143, format!("0,{s},1,{boundary}"));
    file.add(126, "2,2,0,0,1,0,0.,0.,0.,1.,1.,1.,1.,.5,1.,0.,0.,0.,1.,0.,0.,1.,1.,0.,0.,1.");
    let row = |n: usize| vec!["0.5"; n].join(",");
    file.add(112, format!("3,2,3,1,0.,1.,{}", row(24)));
    file.add(114, format!("3,1,1,1,0.,1.,0.,1.,{}", row(192)));
    file.add(120, format!("{line},{arc},0.,1."));
    file.add(122, format!("{arc},0.,0.,1."));
    file.add(502, "1,0.,0.,0.");
    let edges = file.add(504, format!("1,{line},1,1,1,1"));
    let ring = file.add(508, format!("1,0,{edges},1,1,1,0,{arc}"));
    let face = file.add(510, format!("{s},1,1,{ring}"));
    let shell = file.add(514, format!("1,{face},1"));
    file.add(186, format!("{shell},1,0"));
    file.add(402, format!("2,{line},{arc}"));
    // A real outline, a plane, quadrics, ruled and offset surfaces, conics, polylines, a subfigure.
    let outline: Vec<String> = [[0.1, 0.1], [0.9, 0.1], [0.9, 0.9], [0.1, 0.1]]
        .windows(2)
        .map(|p| file.add(110, format!("{:?},{:?},1.,{:?},{:?},1.", p[0][0], p[0][1], p[1][0], p[1][1])).to_string())
        .collect();
    let outline = file.add(102, format!("3,{}", outline.join(",")));
    let point = file.add(116, "0.,0.,1.,0");
    let axis = file.add(123, "0.,0.,1.");
    let plane = file.add(190, format!("{point},{axis}"));
    let on = file.add(142, format!("0,{plane},0,{outline},2"));
    let trimmed = file.add(144, format!("{plane},1,0,{on}"));
    let drum = file.add(192, format!("{point},{axis},2."));
    let rims = [0.0, 1.0].map(|z| file.add(100, format!("{z:?},0.,0.,2.,0.,2.,0.")));
    let rims = rims.map(|c| file.add(142, format!("0,{drum},0,{c},2")));
    file.add(144, format!("{drum},1,1,{},{}", rims[0], rims[1]));
    file.add(196, format!("{point},2."));
    file.add(198, format!("{point},{axis},3.,1."));
    let ruled = file.add(118, format!("{line},{arc},0,0"));
    file.add(140, format!("0.,0.,1.,.5,{ruled}"));
    file.add_entity(Entity {
        kind: 104,
        form: 1,
        parameters: "1.,0.,4.,0.,0.,-4.,0.,2.,0.,0.,1.".into(),
        ..Entity::default()
    });
    file.add_entity(Entity { kind: 106, form: 12, parameters: "2,2,0.,0.,0.,1.,1.,1.".into(), ..Entity::default() });
    let subfigure = file.add(308, format!("0,1Hs,1,{trimmed}"));
    for place in ["0.,0.,9.,1.", "0.,0.,9.,2."] {
        file.add(408, format!("{subfigure},{place}"));
    }
    file.add(110, "5.,0.,0.,1.,0.,0.");
    file.add(130, format!("{line},2,0,0,1,.1,0.,.3,1.,0.,0.,1.,0.,1."));
    file.add_entity(Entity {
        kind: 402,
        form: 7,
        parameters: format!("2,{s},{trimmed},0,1,{name}"),
        ..Entity::default()
    });
    file
}

/// Where the shared test data is, if it is.
pub fn shared_data() -> Option<std::path::PathBuf> {
    let folder = std::path::PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/data"));
    let there = folder.is_dir();
    if !there {
        println!("skipped: no shared data");
    }
    there.then_some(folder)
}

/// All files of a folder of the shared data with this extension, sorted.
pub fn shared_files(folder: &str, extension: &str) -> Vec<std::path::PathBuf> {
    let Some(data) = shared_data() else { return Vec::new() };
    let entries = std::fs::read_dir(data.join(folder)).unwrap();
    let mut files: Vec<_> = entries.map(|e| e.unwrap().path()).collect();
    files.retain(|f| f.extension().is_some_and(|e| e == extension));
    files.sort();
    assert!(!files.is_empty());
    files
}
