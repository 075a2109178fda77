//! Robot files that say only how they differ from another one.

use std::path::Path;

use robot_file::edit::Document;
use sweep::VariantBuilder;

use super::LearnError;

/// The robot of a file but for what is in `differs`, tables of a robot file; `name` and `summary` are the new file's.
pub fn variant(base: &Path, [name, summary]: [&str; 2], differs: &str) -> Result<VariantBuilder, LearnError> {
    let base_name = base.file_name().unwrap_or_default().to_string_lossy();
    let text = format!("base = {base_name:?}\nname = {name:?}\nsummary = {summary:?}\n{differs}");
    let path = base.with_file_name(format!("{name}.toml"));
    let document = Document::parse(&text, &path.display().to_string())?;
    let robot = document.robot()?;
    Ok(VariantBuilder::new(document, robot)?)
}

/// A line of a robot file: a quantity that was chosen and has no spread.
pub fn quantity(key: &str, value: f64, chosen: &str) -> String {
    format!("{key} = {{ value = {value:?}, low = {value:?}, high = {value:?}, source = \"chosen: {chosen}\" }}\n")
}
