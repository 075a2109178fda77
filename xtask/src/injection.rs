//! Whether an image would break itself on request: none that is handed out may.

use std::path::Path;

use miette::{IntoDiagnostic, Result, WrapErr, miette};

/// What such an image prints when it starts (firmware/src/inject.rs).
const NOTICE: &[u8] = b"FAULT INJECTION BUILT IN";

/// Fails where fault injection is linked.
pub fn refuse(binary: &str, file: &Path) -> Result<()> {
    let bytes = std::fs::read(file).into_diagnostic().wrap_err_with(|| file.display().to_string())?;
    if bytes.windows(NOTICE.len()).any(|window| window == NOTICE) {
        return Err(miette!(
            help = "the feature `inject` of firmware/Cargo.toml is for `cargo flash-robot CHIP --inject` alone",
            "{binary} breaks itself on request: its image is not for use"
        ));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::project::Project;

    #[test]
    fn an_image_with_fault_injection_is_refused() {
        let project = Project::find(true).expect("the project");
        let source = std::fs::read_to_string(project.firmware().join("src/inject.rs")).expect("it is there");
        assert!(source.as_bytes().windows(NOTICE.len()).any(|window| window == NOTICE), "it prints something else");
        let folder = tempfile::tempdir().expect("a directory");
        let file = folder.path().join("robot");
        for (contents, good) in [(&b"an image"[..], true), (source.as_bytes(), false)] {
            std::fs::write(&file, contents).expect("writes");
            assert_eq!(refuse("robot", &file).is_ok(), good);
        }
    }

    #[test]
    fn fault_injection_is_no_default() {
        let project = Project::find(true).expect("the project");
        let manifest = std::fs::read_to_string(project.firmware().join("Cargo.toml")).expect("it is there");
        let manifest: toml::Table = toml::from_str(&manifest).expect("a manifest");
        let features = manifest["features"].as_table().expect("features");
        let of =
            |name: &str| features[name].as_array().expect("a list").iter().filter_map(|one| one.as_str()).collect();
        let mut reached: Vec<&str> = of("default");
        for index in 0.. {
            let Some(name) = reached.get(index).copied() else { break };
            if features.contains_key(name) {
                let more: Vec<&str> = of(name);
                reached.extend(more);
            }
        }
        assert!(features.contains_key("inject") && !reached.contains(&"inject"), "{reached:?}");
    }
}
