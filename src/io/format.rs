//! The file formats, told apart by content first and by extension second.

use std::path::Path;

/// A file format.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Format {
    /// IGES 5.3, fixed 80-column ASCII.
    Iges,
    /// STEP (ISO 10303-21); AP203, AP214 and AP242 in, AP242 out.
    Step,
    /// STL, ASCII or binary.
    Stl,
    /// Wavefront OBJ, its polygons.
    Obj,
    /// Plot3D structured grids.
    Plot3d,
    /// This program's own project: RON.
    Project,
}

/// The extension of a project, without the leading dot.
pub const PROJECT_EXTENSION: &str = "patchwright.ron";

impl Format {
    /// The extensions of every format.
    pub const EXTENSIONS: [(&'static [&'static str], Self); 6] = [
        (&["igs", "iges"], Self::Iges),
        (&["stp", "step", "p21"], Self::Step),
        (&["stl"], Self::Stl),
        (&["obj"], Self::Obj),
        (&["xyz", "p3d", "plot3d", "fmt", "xfmt", "grd", "grid", "x", "g"], Self::Plot3d),
        (&["ron"], Self::Project),
    ];

    /// The format that a file name asks for.
    pub fn of_name(path: &Path) -> Option<Self> {
        let name = path.file_name()?.to_string_lossy().to_ascii_lowercase();
        let extension = name.rsplit_once('.')?.1;
        Self::EXTENSIONS.iter().find(|(names, _)| names.contains(&extension)).map(|(_, format)| *format)
    }

    /// The format that the bytes of a file look like.
    pub fn of_content(bytes: &[u8]) -> Option<Self> {
        Self::of_beginning(bytes, bytes.len() as u64)
    }

    /// The format that a file of this length looks like by its first bytes.
    pub fn of_beginning(bytes: &[u8], length: u64) -> Option<Self> {
        let first = bytes.split(|&b| b == b'\n' || b == b'\r').find(|line| !line.trim_ascii().is_empty())?;
        if first.len() >= 73 && matches!(first[72], b'S' | b'G' | b'D') {
            return Some(Self::Iges);
        }
        if super::step::part21::looks_like(bytes) {
            return Some(Self::Step);
        }
        if super::stl::looks_like(bytes, length) {
            return Some(Self::Stl);
        }
        let text = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes).trim_ascii_start();
        (text.starts_with(b"(") || text.starts_with(b"//") || text.starts_with(b"Project(")).then_some(Self::Project)
    }

    /// All formats for an error message.
    pub fn list() -> &'static str {
        "IGES (.igs, .iges), STEP (.stp, .step), STL (.stl), OBJ (.obj), Plot3D (.xyz, .p3d, .fmt) or a project \
         (.patchwright.ron)"
    }

    /// The name for people.
    pub fn name(self) -> &'static str {
        match self {
            Self::Iges => "IGES",
            Self::Step => "STEP",
            Self::Stl => "STL",
            Self::Obj => "OBJ",
            Self::Plot3d => "Plot3D",
            Self::Project => "Patchwright project",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_contents_tell_formats_apart() {
        assert_eq!(Format::of_name(Path::new("a/B.IGS")), Some(Format::Iges));
        assert_eq!(Format::of_name(Path::new("wing.patchwright.ron")), Some(Format::Project));
        assert_eq!(Format::of_name(Path::new("igs")), None);
        let line = format!("{:72}S      1\r\n", "start");
        assert_eq!(Format::of_content(line.as_bytes()), Some(Format::Iges));
        assert_eq!(Format::of_content(b"\n\n(version: 1)"), Some(Format::Project));
        assert_eq!(Format::of_content(b"ISO-10303-21;\nHEADER;"), Some(Format::Step));
        assert_eq!(Format::of_name(Path::new("hull.XYZ")), Some(Format::Plot3d));
        assert_eq!(Format::of_content(b"solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0"), Some(Format::Stl));
        assert_eq!(Format::of_content(b"\x7fELF"), None);
        assert_eq!(Format::of_content(b""), None);
    }
}
