//! The options of `convert` and `heal` for STL, OBJ and Plot3D files.

use super::{CliError, Common};
use crate::io::Saved;
use crate::io::export::ExportOptions;
use crate::kernel::geom::Side;
use crate::kernel::mesh::structured::{Counts, Spacing};

/// How surfaces and patches become triangles or structured grids.
#[derive(Clone, Debug, Default, clap::Args)]
#[command(next_help_heading = "STL, OBJ and Plot3D files")]
pub struct ExportArgs {
    /// Points on every edge of a grid [default for Plot3D: 33]
    #[arg(long, value_name = "N", conflicts_with = "chord")]
    pub points: Option<usize>,
    /// As many points as keep triangles this close to the surfaces [default for STL and OBJ: 1e-4 of the diagonal]
    #[arg(long, value_name = "T")]
    pub chord: Option<f64>,
    /// How points lie along an edge: even in parameter, even in arc length, or clustered towards the --cluster sides
    #[arg(long, value_enum, default_value_t = SpacingArg::Uniform)]
    pub spacing: SpacingArg,
    /// How strongly `--spacing tanh` clusters
    #[arg(long, value_name = "D", default_value_t = 2.5)]
    pub stretch: f64,
    /// Sides that attract grid lines, by the place of the surface or patch in the output: `0:umin,2:vmax`
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = cluster)]
    pub cluster: Vec<(usize, Side)>,
    /// Text instead of bytes (STL, Plot3D)
    #[arg(long)]
    pub ascii: bool,
    /// Fortran records (Plot3D)
    #[arg(long, conflicts_with = "ascii")]
    pub records: bool,
    /// The most significant byte first (Plot3D)
    #[arg(long, conflicts_with = "ascii")]
    pub big_endian: bool,
    /// Single precision (Plot3D)
    #[arg(long, conflicts_with = "ascii")]
    pub single: bool,
}

/// The spacings.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum SpacingArg {
    /// Even in parameter.
    #[default]
    Uniform,
    /// Even in arc length.
    Arc,
    /// Clustered by the hyperbolic tangent.
    Tanh,
}

fn cluster(text: &str) -> Result<(usize, Side), String> {
    let expected = || format!("`{text}` is no side: expected NUMBER:umin, umax, vmin or vmax");
    let (number, side) = text.split_once(':').ok_or_else(expected)?;
    let side = match side.trim().to_ascii_lowercase().as_str() {
        "umin" => Side::UMin,
        "umax" => Side::UMax,
        "vmin" => Side::VMin,
        "vmax" => Side::VMax,
        _ => return Err(expected()),
    };
    Ok((number.trim().parse().map_err(|_| expected())?, side))
}

impl ExportArgs {
    /// The options that they mean.
    pub fn options(&self) -> Result<ExportOptions, CliError> {
        if !self.cluster.is_empty() && self.spacing != SpacingArg::Tanh {
            return Err(CliError::BadArguments("--cluster has no effect without --spacing tanh".into()));
        }
        Ok(ExportOptions {
            counts: self.points.map(Counts::Points).or(self.chord.map(Counts::ChordTolerance)),
            spacing: match self.spacing {
                SpacingArg::Uniform => Spacing::Uniform,
                SpacingArg::Arc => Spacing::ArcLength,
                SpacingArg::Tanh => Spacing::Tanh(self.stretch),
            },
            clusters: self.cluster.clone(),
            joining: None,
            ascii: self.ascii,
            records: self.records,
            big_endian: self.big_endian,
            single: self.single,
        })
    }
}

/// Says what surfaces became, or how well they fit.
pub fn tell(saved: &Saved, common: &Common) {
    let Some(e) = saved.export.as_ref().filter(|e| e.surfaces > 0) else { return };
    let named =
        |pair: &Option<[String; 2]>| pair.as_ref().map_or(String::new(), |[a, b]| format!(" between `{a}` and `{b}`"));
    let between = named(&e.largest_between);
    if let Some(angle) = e.largest_angle_deg {
        let at = named(&e.angle_between);
        return common.say(format!(
            "{} shared edges, largest gap {:.3e}{between}, largest normal angle {angle:.3} deg{at}",
            e.seams, e.largest_gap
        ));
    }
    common.say(format!(
        "{} points, {} cells; {} shared edges, largest seam gap {:.3e}{between}, closed in the file; middles of cells \
         within {:.3e} of the surfaces",
        e.points, e.cells, e.seams, e.largest_gap, e.chord_error
    ));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sides_are_read_or_refused() {
        assert_eq!(cluster("0:umin"), Ok((0, Side::UMin)));
        assert_eq!(cluster(" 12:VMAX"), Ok((12, Side::VMax)));
        for bad in ["umin", "0:", "0:left", "-1:umin", "x:umin"] {
            assert!(cluster(bad).is_err(), "{bad}");
        }
    }
}
