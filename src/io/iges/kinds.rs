//! Entity types by number: their names, what is said of those that are not read, and the standard colours.

use crate::io::Severity;

/// The name of an entity type.
pub(super) fn name(kind: i64) -> &'static str {
    match kind {
        100 => "circular arc",
        102 => "composite curve",
        104 => "conic arc",
        106 => "copious data",
        108 => "plane",
        110 => "line",
        112 => "parametric spline curve",
        114 => "parametric spline surface",
        116 => "point",
        118 => "ruled surface",
        120 => "surface of revolution",
        122 => "tabulated cylinder",
        123 => "direction",
        124 => "transform",
        126 => "B-spline curve",
        128 => "B-spline surface",
        130 => "offset curve",
        132 => "connect point",
        134..=138 | 146 | 148 => "finite element data",
        140 => "offset surface",
        141 => "boundary",
        142 => "curve on a surface",
        143 => "bounded surface",
        144 => "trimmed surface",
        150..=168 | 180 | 184 | 430 => "solid",
        182 => "selected component",
        186 => "B-rep solid",
        190 => "plane surface",
        192 => "cylinder",
        194 => "cone",
        196 => "sphere",
        198 => "torus",
        202..=230 => "annotation",
        302..=322 => "definition",
        402 => "associativity",
        404 => "drawing",
        406 => "property",
        408 => "subfigure instance",
        410 => "view",
        412 | 414 => "pattern",
        416 => "external reference",
        418 | 420 => "network",
        422 => "attributes",
        502 => "vertex list",
        504 => "edge list",
        508 => "loop",
        510 => "face",
        514 => "shell",
        _ => "unknown",
    }
}

/// What is said of an entity of a type that becomes no geometry.
pub(super) fn unread(kind: i64, consumed: bool) -> (Severity, String) {
    let name = name(kind);
    match kind {
        141 | 142 | 502 | 504 | 508 => (Severity::Info, format!("{name}: only describes faces")),
        186 | 514 => (Severity::Info, format!("{name}: its faces are opened, the group is not kept")),
        308 | 408 => (Severity::Info, format!("{name}: its members are opened where it stands")),
        116 | 123 => (Severity::Info, format!("{name}: no curve or surface, left out")),
        108 => (Severity::Info, format!("{name}: unbounded, and no face uses it")),
        402 => (Severity::Info, format!("{name}: of views or drawings, no geometry; its members are opened")),
        404 | 406 | 410 | 422 => (Severity::Info, format!("{name}: no geometry, left out")),
        132 if consumed => (Severity::Info, format!("{name}: only describes another entity")),
        202..=230 => (Severity::Info, format!("{name}: no geometry of the model, left out")),
        _ => (Severity::Skipped, format!("{name}: this type is not read")),
    }
}

/// The colours 1 to 8, linear RGB.
pub(super) fn standard_color(number: i64) -> Option<[f32; 3]> {
    Some(match number {
        1 => [0.0, 0.0, 0.0],
        2 => [1.0, 0.0, 0.0],
        3 => [0.0, 1.0, 0.0],
        4 => [0.0, 0.0, 1.0],
        5 => [1.0, 1.0, 0.0],
        6 => [1.0, 0.0, 1.0],
        7 => [0.0, 1.0, 1.0],
        8 => [1.0, 1.0, 1.0],
        _ => return None,
    })
}
