//! The status line of the picking tool: what tool, what to do now, which keys.

use super::corners::CornerState;
use super::{Mode, PatchTool, Stage};
use crate::kernel::geom::Direction;

/// A line of the list of keys.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HelpLine {
    /// The key.
    pub key: &'static str,
    /// What it does.
    pub what: &'static str,
}

const fn line(key: &'static str, what: &'static str) -> HelpLine {
    HelpLine { key, what }
}

/// The keys while the tool runs.
pub const HELP: [HelpLine; 19] = [
    line("Click", "add a curve to the side, or choose an iso-curve of a surface"),
    line("Shift+click", "split the curve at the point"),
    line("Click again", "the next thing under the cursor"),
    line("Alt+click", "list everything under the cursor"),
    line("Ctrl", "no snapping while held"),
    line("Enter", "next side, run, accept"),
    line("Backspace", "undo the last pick"),
    line("Esc", "step back, twice leaves"),
    line("1-4", "go to a side and add to it"),
    line("T", "add the curves that carry on smoothly"),
    line("X", "turn the side round"),
    line("Tab", "the other loop, or the other iso-curve"),
    line("L", "straight segment between two points"),
    line("P", "polyline"),
    line("W", "draw a curve across surfaces"),
    line("C", "trim the sides where they cross"),
    line("V", "preview on or off"),
    line("D", "deviation map on or off"),
    line("K", "keep what a cancelled heal had finished"),
];

/// A length with four digits and its unit.
pub fn length(value: f64, symbol: &str) -> String {
    let size = value.abs();
    let number = if value == 0.0 {
        "0".to_owned()
    } else if (1e-3..1e5).contains(&size) {
        let digits = (3.0 - size.log10().floor()).clamp(0.0, 6.0) as usize;
        let text = format!("{value:.digits$}");
        if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
    } else {
        format!("{value:.2e}")
    };
    if symbol.is_empty() { number } else { format!("{number} {symbol}") }
}

impl PatchTool {
    /// A length with the model's unit.
    pub fn length(&self, value: f64) -> String {
        length(value, self.unit.symbol())
    }

    /// The status line.
    pub fn prompt(&self) -> String {
        let parts: Vec<String> = match self.stage {
            Stage::Idle => return "Select · Click a thing to select it · P new patch · Ctrl+K all commands".to_owned(),
            Stage::Side(side) => self.side_prompt(side),
            Stage::Review => self.review_prompt(),
            Stage::Running => vec!["Healing".to_owned(), "Esc cancel".to_owned()],
            Stage::Result => {
                let mut parts = vec![self.result_summary()];
                parts.extend(["Enter accept", "1-4 adjust a side", "D deviation", "Esc discard"].map(str::to_owned));
                parts
            }
        };
        std::iter::once("Patch".to_owned()).chain(parts).collect::<Vec<_>>().join(" · ")
    }

    fn side_prompt(&self, side: usize) -> Vec<String> {
        let n = side + 1;
        let own = |texts: &[&str]| texts.iter().map(|t| (*t).to_owned()).collect::<Vec<_>>();
        let mut parts = match &self.mode {
            Mode::Line(points) => {
                let which = if points.is_empty() { "start" } else { "end" };
                let mut parts = vec![format!("Side {n} of 4, straight segment: pick its {which}")];
                parts.extend(own(&["Backspace undo point", "Ctrl no snap", "Esc back to curves"]));
                return parts;
            }
            Mode::Polyline(points) | Mode::Draw(points) => {
                let what = if matches!(self.mode, Mode::Draw(_)) { "drawn curve" } else { "polyline" };
                let mut parts = vec![format!("Side {n} of 4, {what}: pick point {}", points.len() + 1)];
                if points.len() >= 2 {
                    parts.push("Enter finish".to_owned());
                }
                parts.extend(own(&["Backspace undo point", "Ctrl no snap", "Esc back to curves"]));
                return parts;
            }
            Mode::Iso { fixed, .. } => {
                let along = if *fixed == Direction::U { "v" } else { "u" };
                let mut parts = vec![format!("Side {n} of 4, iso-curve along {along}")];
                parts.extend(own(&["Enter take it", "Tab the other one", "Esc back to curves"]));
                return parts;
            }
            Mode::Curves => vec![format!("Pick side {n} of 4")],
        };
        let empty = self.sides[side].pieces.is_empty();
        if empty {
            parts.extend(own(&["Click a curve, or a surface for its iso-curves", "L segment", "P polyline", "W draw"]));
            if self.sides.iter().any(|s| !s.pieces.is_empty()) {
                parts.push("Backspace back".to_owned());
            }
        } else {
            let next = if self.next_empty(side).is_some() { "Enter next side" } else { "Enter review" };
            parts.extend(own(&[next, "Backspace undo pick", "T chain", "X flip"]));
        }
        parts.extend(self.remarks());
        parts.push("Esc cancel".to_owned());
        parts
    }

    /// What the loop and the preview have to say: ambiguity, folds, open corners.
    fn remarks(&self) -> Vec<String> {
        let mut out = Vec::new();
        if self.is_ambiguous() {
            out.push("Two loops fit, Tab switches".to_owned());
        }
        if let Some(preview) = self.preview()
            && let Some(corner) = preview.fold_corner()
        {
            let side = self.order().and_then(|o| o.sides.get(corner)).map_or(corner, |s| *s);
            out.push(format!("Preview folds near the start of side {}, X turns a side round", side + 1));
        }
        let open: Vec<usize> = (0..self.corners.len()).filter(|&k| !self.corners[k].is_settled()).collect();
        if let [first, ..] = open[..] {
            let corner = &self.corners[first];
            let [a, b] = corner.sides;
            let more = if open.len() > 1 { format!(", {} more open", open.len() - 1) } else { String::new() };
            let trim = if corner.crossing.is_some() { ", C trims at crossings" } else { "" };
            out.push(format!("Gap {} between sides {} and {}{more}{trim}", self.length(corner.gap), a + 1, b + 1));
        }
        out
    }

    fn review_prompt(&self) -> Vec<String> {
        let mut parts = self.remarks();
        if parts.is_empty() {
            let widest = self.corners.iter().map(|c| c.gap).fold(0.0, f64::max);
            parts.push(format!("Four sides, widest gap {}", self.length(widest)));
        }
        let closed_by_hand = self.corners.iter().filter(|c| matches!(c.state, CornerState::ClosedBy(_))).count();
        if closed_by_hand > 0 {
            parts.push(format!("{closed_by_hand} closed by hand"));
        }
        let settled = self.corners.iter().all(super::corners::Corner::is_settled);
        if self.partial.is_some() {
            parts.push("K keep the cancelled patch".to_owned());
        }
        parts.push(if settled { "Enter heal" } else { "Choose on the corner card" }.to_owned());
        parts.extend(["1-4 change a side", "V preview", "Esc cancel"].map(str::to_owned));
        parts
    }

    fn result_summary(&self) -> String {
        let Some(patch) = &self.result else { return "No patch".to_owned() };
        let report = &patch.report;
        let samples = report.projected + report.artificial;
        let share = if samples > 0 { 100.0 * report.artificial as f64 / samples as f64 } else { 0.0 };
        let verdict = match (report.incomplete, report.reached) {
            (true, _) => "Healed in part, cancelled before the end",
            (false, true) => "Healed",
            (false, false) => "Healed, tolerance not reached",
        };
        format!("{verdict}, max error {}, {share:.0} % artificial", self.length(report.max_error))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_have_four_digits_and_their_unit() {
        for (value, text) in [
            (0.0, "0 mm"),
            (1.0, "1 mm"),
            (8.765_432_1, "8.765 mm"),
            (1234.5678, "1235 mm"),
            (1200.0, "1200 mm"),
            (0.00321, "0.00321 mm"),
            (1.234e-7, "1.23e-7 mm"),
            (2.5e9, "2.50e9 mm"),
        ] {
            assert_eq!(length(value, "mm"), text);
        }
        assert_eq!(length(0.5, ""), "0.5");
    }
}
