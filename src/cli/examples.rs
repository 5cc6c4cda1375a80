//! `patchwright examples DIR`: writes the bundled example models, as `assets/` has them. Hidden: users find them
//! in `assets/`; this makes them again after a change of the generator (`cargo run -- examples assets`).

use std::path::PathBuf;

use super::{CliError, Common, Exit};
use crate::model::examples;

/// Arguments of `examples`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The folder that gets the models and their patch specifications
    #[arg(value_name = "DIR")]
    pub folder: PathBuf,
}

/// The files of an example: names and contents. They are the same at every run.
pub fn files(example: &examples::Example) -> Result<[(String, String); 2], CliError> {
    let options = crate::io::iges::IgesOptions {
        file_name: format!("{}.igs", example.name),
        time: std::time::UNIX_EPOCH + std::time::Duration::from_secs(1_767_225_600),
    };
    let (model, _) = crate::io::iges::write(&example.document, &options)?;
    let spec = format!("// {}\n{}", example.about, example.spec.to_ron()?);
    Ok([(format!("{}.igs", example.name), model), (format!("{}.heal.ron", example.name), spec)])
}

/// Runs `examples`.
pub fn run(args: &Args, common: &Common) -> Result<Exit, CliError> {
    for example in examples::all() {
        for (name, text) in files(&example)? {
            let path = args.folder.join(name);
            std::fs::write(&path, text)
                .map_err(|error| CliError::failed(format!("cannot write {}: {error}", path.display())))?;
            common.say(path.display().to_string());
        }
    }
    Ok(Exit::Done)
}
