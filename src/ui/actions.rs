//! The list of everything a user can do. Menus, the toolbar, shortcuts, the command palette and the list of keys
//! are all made from it. What changes a document goes on as a [`crate::model::command::Command`].

use egui::{Key, KeyboardShortcut, Modifiers};

use super::icons::Icon;

/// One thing a user can do.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[allow(missing_docs, reason = "each is described by its entry in ACTIONS")]
pub enum Action {
    Open,
    OpenExample,
    Save,
    SaveAs,
    SaveSpec,
    Export,
    Quit,
    Undo,
    Redo,
    SelectAll,
    Deselect,
    Rename,
    Delete,
    Settings,
    Hide,
    Isolate,
    ShowAll,
    FrameAll,
    FrameSelection,
    Front,
    Back,
    Right,
    Left,
    Top,
    Bottom,
    Perspective,
    Shaded,
    Wireframe,
    Xray,
    Edges,
    IsoLines,
    WholeSurfaces,
    Section,
    LightTheme,
    DarkTheme,
    LeftPanel,
    RightPanel,
    UvView,
    ShowTool,
    ShowPatches,
    ShowDefects,
    ShowHistory,
    ShowJobs,
    ShowReport,
    SelectTool,
    PatchTool,
    AdjustPatch,
    Inspect,
    /// Measure between two places.
    MeasureTool,
    /// Stripes that show breaks of tangent and curvature.
    Zebra,
    InspectSearch,
    IntersectTool,
    IntersectVisible,
    SelfIntersectTool,
    SearchSelfIntersections,
    KeepCurves,
    ExportCurves,
    CoaxialDemo,
    MiterDemo,
    FindDefects,
    NextDefect,
    PreviousDefect,
    FixDefect,
    CancelJobs,
    Palette,
    Keys,
    About,
}

/// The menus, in their order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs, reason = "the names are the titles")]
pub enum Menu {
    File,
    Edit,
    View,
    Heal,
    Analyse,
    Help,
}

impl Menu {
    /// All menus.
    pub const ALL: [Self; 6] = [Self::File, Self::Edit, Self::View, Self::Heal, Self::Analyse, Self::Help];

    /// What the menu bar writes.
    pub fn title(self) -> &'static str {
        match self {
            Self::File => "File",
            Self::Edit => "Edit",
            Self::View => "View",
            Self::Heal => "Heal",
            Self::Analyse => "Analyse",
            Self::Help => "Help",
        }
    }
}

/// What is known of an action.
#[derive(Clone, Copy, Debug)]
pub struct Info {
    /// Which action.
    pub action: Action,
    /// Its name, in sentence case, with an ellipsis where more input follows.
    pub name: &'static str,
    /// Where it stands.
    pub menu: Menu,
    /// Actions of one menu with different groups are kept apart by a line.
    pub group: u8,
    /// Its key.
    pub shortcut: Option<KeyboardShortcut>,
    /// Whether the key is meant on the numeric pad.
    pub pad: bool,
    /// Its picture on the toolbar.
    pub icon: Option<Icon>,
    /// One sentence for tooltips and the palette.
    pub help: &'static str,
}

const fn key(modifiers: Modifiers, key: Key) -> Option<KeyboardShortcut> {
    Some(KeyboardShortcut::new(modifiers, key))
}

const fn entry(
    action: Action,
    menu: Menu,
    group: u8,
    name: &'static str,
    shortcut: Option<KeyboardShortcut>,
    help: &'static str,
) -> Info {
    Info { action, name, menu, group, shortcut, pad: false, icon: None, help }
}

const fn with(icon: Icon, info: Info) -> Info {
    Info { icon: Some(icon), ..info }
}

/// Its key is on the numeric pad.
const fn on_pad(info: Info) -> Info {
    Info { pad: true, ..info }
}

impl Info {
    /// Its key for people, empty without one.
    pub fn keys(&self, ctx: &egui::Context) -> String {
        match &self.shortcut {
            None => String::new(),
            Some(shortcut) if !self.pad => ctx.format_shortcut(shortcut),
            Some(shortcut) => {
                let digit = shortcut.logical_key.symbol_or_name();
                let held = if shortcut.modifiers.command { "Ctrl+" } else { "" };
                format!("{held}Num {digit}")
            }
        }
    }
}

const NONE: Modifiers = Modifiers::NONE;
const CTRL: Modifiers = Modifiers::COMMAND;
const SHIFT: Modifiers = Modifiers::SHIFT;
const ALT: Modifiers = Modifiers::ALT;
const CTRL_SHIFT: Modifiers = Modifiers::COMMAND.plus(Modifiers::SHIFT);

use Menu::{Analyse, Edit, File, Heal, Help, View};

/// Every action, in menu order.
pub const ACTIONS: &[Info] = &[
    with(
        Icon::Open,
        entry(
            Action::Open,
            File,
            0,
            "Open…",
            key(CTRL, Key::O),
            "Open an IGES, STEP, STL, OBJ or Plot3D file or a project",
        ),
    ),
    entry(Action::OpenExample, File, 0, "Open example…", None, "Open one of the bundled example models"),
    with(
        Icon::Save,
        entry(Action::Save, File, 1, "Save", key(CTRL, Key::S), "Write the model and its patches back to its file"),
    ),
    entry(
        Action::SaveAs,
        File,
        1,
        "Save as…",
        key(CTRL_SHIFT, Key::S),
        "Write to another file: a project (.ron) or IGES (.igs)",
    ),
    entry(
        Action::SaveSpec,
        File,
        1,
        "Save patch specification…",
        None,
        "Write the picked sides of all patches as RON, which the command line heals again",
    ),
    entry(
        Action::Export,
        File,
        1,
        "Export…",
        key(CTRL, Key::E),
        "Write patches as STEP or IGES, a structured Plot3D grid, STL or OBJ, after a look at gaps and normal angles",
    ),
    entry(
        Action::Quit,
        File,
        9,
        "Quit",
        key(CTRL, Key::Q),
        "Close the window; asks first when there are unsaved changes",
    ),
    with(Icon::Undo, entry(Action::Undo, Edit, 0, "Undo", key(CTRL, Key::Z), "Take the last change back")),
    with(Icon::Redo, entry(Action::Redo, Edit, 0, "Redo", key(CTRL_SHIFT, Key::Z), "Bring back what undo took")),
    entry(Action::SelectAll, Edit, 1, "Select all", key(CTRL, Key::A), "Select everything that is visible"),
    entry(Action::Deselect, Edit, 1, "Deselect", key(CTRL_SHIFT, Key::A), "Select nothing"),
    entry(Action::Rename, Edit, 2, "Rename…", key(NONE, Key::F2), "Give the selected entity another name"),
    with(
        Icon::Trash,
        entry(Action::Delete, Edit, 2, "Delete", key(NONE, Key::Delete), "Remove what is selected from the model"),
    ),
    entry(Action::Settings, Edit, 3, "Settings…", key(CTRL, Key::Comma), "Navigation, theme and tolerances"),
    with(
        Icon::FrameAll,
        entry(Action::FrameAll, View, 0, "Frame all", key(NONE, Key::Home), "Fit the whole model into the view"),
    ),
    with(
        Icon::FrameSelection,
        entry(
            Action::FrameSelection,
            View,
            0,
            "Frame selection",
            key(NONE, Key::F),
            "Fit what is selected into the view",
        ),
    ),
    on_pad(entry(Action::Front, View, 1, "Front view", key(NONE, Key::Num1), "Look along +y")),
    on_pad(entry(Action::Back, View, 1, "Back view", key(CTRL, Key::Num1), "Look along -y")),
    on_pad(entry(Action::Right, View, 1, "Right view", key(NONE, Key::Num3), "Look along -x")),
    on_pad(entry(Action::Left, View, 1, "Left view", key(CTRL, Key::Num3), "Look along +x")),
    on_pad(entry(Action::Top, View, 1, "Top view", key(NONE, Key::Num7), "Look along -z")),
    on_pad(entry(Action::Bottom, View, 1, "Bottom view", key(CTRL, Key::Num7), "Look along +z")),
    with(
        Icon::Projection,
        on_pad(entry(
            Action::Perspective,
            View,
            1,
            "Perspective",
            key(NONE, Key::Num5),
            "Switch between perspective and parallel projection",
        )),
    ),
    with(Icon::Shaded, entry(Action::Shaded, View, 2, "Shaded", key(ALT, Key::Num1), "Fill the surfaces")),
    with(
        Icon::Wireframe,
        entry(Action::Wireframe, View, 2, "Wireframe", key(ALT, Key::Num2), "Draw the triangles' edges only"),
    ),
    with(Icon::Xray, entry(Action::Xray, View, 2, "X-ray", key(ALT, Key::Num3), "Let what is behind shine through")),
    with(Icon::Edges, entry(Action::Edges, View, 3, "Edges", key(ALT, Key::E), "Draw the edges of the surfaces")),
    with(Icon::Iso, entry(Action::IsoLines, View, 3, "Iso-lines", key(ALT, Key::I), "Draw lines of constant u and v")),
    entry(
        Action::Zebra,
        View,
        3,
        "Zebra stripes",
        key(ALT, Key::Z),
        "Reflect stripes: they break where surfaces meet at an angle and kink where the curvature jumps",
    ),
    entry(
        Action::WholeSurfaces,
        View,
        3,
        "Untrimmed surfaces",
        key(ALT, Key::U),
        "Draw the whole surfaces under trimmed faces",
    ),
    with(
        Icon::Section,
        entry(
            Action::Section,
            View,
            3,
            "Section plane",
            key(ALT, Key::S),
            "Cut the view open along a plane; drag its handle",
        ),
    ),
    with(
        Icon::Inspect,
        entry(
            Action::Inspect,
            View,
            3,
            "Inspect hierarchy",
            key(NONE, Key::I),
            "Look into the bounding volumes and osculating tori of one or two surfaces, level by level",
        ),
    ),
    entry(
        Action::InspectSearch,
        View,
        3,
        "Inspect self-intersection search",
        key(SHIFT, Key::I),
        "Look at the ternary tree of a surface: what was proved, which windows failed, how leaves were converted",
    ),
    with(Icon::EyeOff, entry(Action::Hide, View, 4, "Hide", key(NONE, Key::H), "Hide what is selected")),
    with(Icon::Isolate, entry(Action::Isolate, View, 4, "Isolate", key(SHIFT, Key::H), "Hide everything else")),
    with(Icon::Eye, entry(Action::ShowAll, View, 4, "Show all", key(ALT, Key::H), "Show every entity again")),
    entry(Action::LightTheme, View, 5, "Light theme", None, "Dark text on a light window"),
    entry(Action::DarkTheme, View, 5, "Dark theme", None, "Light text on a dark window"),
    entry(Action::LeftPanel, View, 6, "Outliner and properties", key(NONE, Key::F9), "Show or hide the left panel"),
    entry(Action::RightPanel, View, 6, "Tool panel", key(NONE, Key::F10), "Show or hide the right panel"),
    entry(
        Action::UvView,
        View,
        6,
        "UV view",
        key(NONE, Key::U),
        "Show or hide the parameter domains of what is selected or worked on, with the cursor linked to the 3D view",
    ),
    entry(Action::ShowTool, View, 7, "Show tool", None, "Bring the tool's page to the front"),
    entry(Action::ShowPatches, View, 7, "Show patches", None, "Bring the table of patches to the front"),
    entry(Action::ShowDefects, View, 7, "Show defects", None, "Bring the list of what is broken to the front"),
    entry(Action::ShowHistory, View, 7, "Show history", None, "Bring the list of changes to the front"),
    entry(Action::ShowJobs, View, 7, "Show jobs", None, "Bring the list of computations to the front"),
    entry(Action::ShowReport, View, 7, "Show import report", None, "Bring the account of the last file to the front"),
    with(Icon::Select, entry(Action::SelectTool, Heal, 0, "Select", key(NONE, Key::Q), "Pick entities in the view")),
    with(
        Icon::Patch,
        entry(
            Action::PatchTool,
            Heal,
            0,
            "New patch",
            key(NONE, Key::P),
            "Pick four sides and lay a patch over what is broken between them",
        ),
    ),
    entry(
        Action::AdjustPatch,
        Heal,
        0,
        "Adjust patch",
        key(NONE, Key::E),
        "Go back to the sides of the selected patch; what is healed then takes its place",
    ),
    entry(
        Action::FindDefects,
        Heal,
        1,
        "Find defects",
        key(CTRL, Key::D),
        "List free edges, gaps, overlaps, crossing faces, slivers and bad parametrizations",
    ),
    entry(Action::NextDefect, Heal, 1, "Next defect", key(NONE, Key::F8), "Look at the next defect of the list"),
    entry(
        Action::PreviousDefect,
        Heal,
        1,
        "Previous defect",
        key(SHIFT, Key::F8),
        "Look at the defect before this one",
    ),
    entry(
        Action::FixDefect,
        Heal,
        1,
        "Fix with patch",
        None,
        "Start a patch whose sides are filled in from the gap or the loop of free edges",
    ),
    entry(
        Action::CancelJobs,
        Heal,
        1,
        "Cancel all jobs",
        key(SHIFT, Key::Escape),
        "Ask every running computation to stop",
    ),
    with(
        Icon::Intersect,
        entry(
            Action::IntersectTool,
            Analyse,
            0,
            "Intersect",
            key(NONE, Key::X),
            "Find every curve and point in which two surfaces or sets of surfaces meet",
        ),
    ),
    entry(
        Action::IntersectVisible,
        Analyse,
        0,
        "Intersect all visible",
        key(CTRL_SHIFT, Key::X),
        "Find where the visible surfaces meet each other, all pairs",
    ),
    with(
        Icon::SelfIntersect,
        entry(
            Action::SelfIntersectTool,
            Analyse,
            1,
            "Self-intersection",
            key(SHIFT, Key::X),
            "Find where a surface meets itself, and the miter points in which such curves end",
        ),
    ),
    entry(
        Action::SearchSelfIntersections,
        Analyse,
        1,
        "Search all for self-intersections",
        None,
        "Look through every visible surface in the background",
    ),
    with(
        Icon::Measure,
        entry(
            Action::MeasureTool,
            Analyse,
            0,
            "Measure",
            key(NONE, Key::M),
            "Measure between two places: distance, distance from a surface, gap between two curves, angle",
        ),
    ),
    entry(
        Action::KeepCurves,
        Analyse,
        2,
        "Keep curves",
        key(NONE, Key::K),
        "Make the curves that were found free curves of the model, to be picked as sides of a patch",
    ),
    entry(
        Action::ExportCurves,
        Analyse,
        2,
        "Export curves…",
        None,
        "Write the curves that were found, in space and on their surfaces",
    ),
    entry(
        Action::CoaxialDemo,
        Analyse,
        3,
        "Cylinder-angle demo",
        None,
        "Two nearly coaxial cylinders whose intersection follows a slider",
    ),
    entry(
        Action::MiterDemo,
        Analyse,
        3,
        "Miter-point demo",
        None,
        "A cross-cap and the plane through its miter point, moved by sliders",
    ),
    with(
        Icon::Search,
        entry(Action::Palette, Help, 0, "Find command…", key(CTRL, Key::K), "Search all commands by name"),
    ),
    entry(Action::Keys, Help, 0, "Keys and mouse", key(NONE, Key::F1), "List every key and what the mouse does"),
    entry(Action::About, Help, 1, "About Patchwright", None, "Version and licence"),
];

/// What is known of `action`.
pub fn info(action: Action) -> &'static Info {
    // Every action has an entry (tested), so the fallback is never shown.
    ACTIONS.iter().find(|i| i.action == action).unwrap_or(&ACTIONS[0])
}

/// The toolbar, in groups.
pub const TOOLBAR: &[&[Action]] = &[
    &[Action::Open, Action::Save],
    &[Action::Undo, Action::Redo],
    &[Action::SelectTool, Action::PatchTool, Action::IntersectTool, Action::SelfIntersectTool, Action::MeasureTool],
    &[Action::FrameAll, Action::FrameSelection, Action::Perspective],
    &[Action::Shaded, Action::Wireframe, Action::Xray],
    &[Action::Edges, Action::IsoLines, Action::Section, Action::Inspect],
    &[Action::Hide, Action::Isolate, Action::ShowAll],
];

/// How well `query` fits `text`: every letter must come in order; letters at the start of words and in a row
/// weigh more. `None` when it does not fit.
pub fn fuzzy(query: &str, text: &str) -> Option<i32> {
    let text: Vec<char> = text.to_lowercase().chars().collect();
    let (mut at, mut score, mut last) = (0, 0, usize::MAX);
    for c in query.to_lowercase().chars().filter(|c| !c.is_whitespace()) {
        // Prefer the start of a word, then whatever comes first.
        let word = (at..text.len()).find(|&i| text[i] == c && (i == 0 || !text[i - 1].is_alphanumeric()));
        let next = (at..text.len()).find(|&i| text[i] == c)?;
        let found = if last != usize::MAX && next == last + 1 { next } else { word.unwrap_or(next) };
        score += if last != usize::MAX && found == last + 1 { 8 } else { 0 };
        score += if found == 0 || !text[found - 1].is_alphanumeric() { 6 } else { 1 };
        (at, last) = (found + 1, found);
    }
    // A query that ends with a word fits better than one that ends inside it.
    let ends_word = last != usize::MAX && text.get(last + 1).is_none_or(|c| !c.is_alphanumeric());
    Some(score * 100 + if ends_word { 50 } else { 0 } - text.len() as i32)
}

/// The actions that fit `query`, best first; all of them, in menu order, for an empty one.
pub fn matching(query: &str) -> Vec<&'static Info> {
    let mut found: Vec<(i32, &Info)> = ACTIONS
        .iter()
        .filter_map(|info| {
            let name = fuzzy(query, info.name);
            let help = fuzzy(query, info.help).filter(|_| query.len() > 3).map(|s| s / 3 - 1000);
            name.max(help).map(|score| (score, info))
        })
        .collect();
    if !query.trim().is_empty() {
        found.sort_by_key(|(score, _)| std::cmp::Reverse(*score));
    }
    found.into_iter().map(|(_, info)| info).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    #[test]
    fn names_and_keys_are_unique_and_follow_the_rules() {
        let mut names = HashSet::new();
        let mut keys = HashSet::new();
        for info in ACTIONS {
            assert!(names.insert(info.name), "{} twice", info.name);
            assert!(info.name.starts_with(char::is_uppercase) && !info.name.ends_with(['.', ':']), "{}", info.name);
            assert!(!info.name.contains("..."), "{}", info.name);
            assert!(!info.help.is_empty() && !info.help.ends_with('.'), "{}", info.help);
            if let Some(shortcut) = info.shortcut {
                assert!(keys.insert((shortcut, info.pad)), "{shortcut:?} twice");
            }
            assert_eq!(super::info(info.action).name, info.name);
        }
        assert!(TOOLBAR.iter().flat_map(|g| g.iter()).all(|&a| info(a).icon.is_some()));
    }

    #[test]
    fn the_palette_finds_by_initials_and_by_parts() {
        assert_eq!(matching("fa")[0].action, Action::FrameAll);
        assert_eq!(matching("np")[0].action, Action::PatchTool);
        assert_eq!(matching("iso")[0].action, Action::IsoLines);
        assert_eq!(matching("undo")[0].action, Action::Undo);
        assert_eq!(matching("quit")[0].action, Action::Quit);
        assert!(matching("zzzz").is_empty());
        assert_eq!(matching("").len(), ACTIONS.len());
    }
}
