//! docs/robot-file.md says what the reader does.

#[test]
fn the_document_has_the_readers_tables() {
    const BEGIN: &str = "<!-- made from the reader's own list; a test compares -->\n";
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/robot-file.md");
    let text = std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{path}: {error}"));
    let expected = robot_file::reference::markdown();
    let (_, found) = text.split_once(BEGIN).unwrap_or_else(|| panic!("{path} has no line {BEGIN}"));
    assert!(
        found.trim() == expected.trim(),
        "{path} is out of date. Replace everything after the line {BEGIN} by:\n\n{expected}"
    );
}
