//! Every shader goes through naga: parsed and validated, with no GPU.
#![cfg(feature = "editor")]

use naga::valid::{Capabilities, ValidationFlags, Validator};

#[test]
fn every_shader_is_valid_wgsl() {
    for (name, source) in patchwright::render::shader_sources() {
        let module = match naga::front::wgsl::parse_str(&source) {
            Ok(module) => module,
            Err(e) => panic!("{name}: {}", e.emit_to_string(&source)),
        };
        if let Err(e) = Validator::new(ValidationFlags::all(), Capabilities::empty()).validate(&module) {
            panic!("{name}: {}", e.emit_to_string(&source));
        }
    }
}

#[test]
fn every_file_of_the_shader_folder_is_used() {
    let sources = patchwright::render::shader_sources();
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/shaders");
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let text = std::fs::read_to_string(&path).unwrap();
        assert!(sources.iter().any(|(_, s)| s.contains(&text)), "{} is drawn by nobody", path.display());
    }
}
