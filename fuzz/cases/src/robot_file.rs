//! Robot files: any text, and what is designed from it; and the same text as the file of a gait.

use robot_file::Robot;
use robot_file::design::design;
use robot_file::edit::Document;
use robot_file::gait::GaitFile;
use robot_file::image::Image;

/// A file that is not there: a `base` in the text is looked for beside it, where the real ones are.
const PLACE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../robots/any.toml");

/// A text, as far as it is UTF-8; reading the file has refused it otherwise.
pub fn robot_file(data: &[u8]) {
    let Ok(text) = std::str::from_utf8(data) else { return };
    gait_file(text);
    let read = Robot::parse(text, PLACE);
    if let Ok(document) = Document::parse(text, PLACE) {
        assert_eq!(document.robot().is_ok(), read.is_ok(), "one reader takes what the other does not");
    }
    match read {
        Ok(robot) => {
            if let Ok(design) = design(&robot) {
                assert_eq!(design.parameters.check(), Ok(()), "designed what no controller can run on");
            }
            let _ = Image::of(&robot);
        }
        Err(error) => assert!(!format!("{:?}", miette::Report::new(error)).is_empty()),
    }
}

/// What is read is written and read again as the same, and can be played by some robot.
fn gait_file(text: &str) {
    match GaitFile::parse(text, "any.toml") {
        Ok(file) => {
            assert_eq!(file.gait().check_form(), Ok(()));
            assert_eq!(GaitFile::parse(&file.to_toml(), "again.toml").ok(), Some(file));
        }
        Err(error) => assert!(!format!("{:?}", miette::Report::new(error)).is_empty()),
    }
}
