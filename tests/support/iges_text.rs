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
