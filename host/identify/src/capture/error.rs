//! Why a capture cannot be used.

use std::path::PathBuf;

use miette::Diagnostic;
use thiserror::Error;

/// Why a capture cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, Error, Diagnostic)]
pub enum CaptureError {
    /// The file cannot be read.
    #[error("{}: cannot be read: {problem}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What the system says.
        problem: String,
    },
    /// Something in it is wrong.
    #[error("{}, line {line}{column}: {problem}", path.display())]
    #[diagnostic(help("docs/motion-capture.md says what is read of which system"))]
    Wrong {
        /// The file.
        path: PathBuf,
        /// From 1.
        line: usize,
        /// `, column …`, or nothing.
        column: String,
        /// What is wrong.
        problem: String,
    },
    /// A body that is points only.
    #[error("{}: `{body}` has no orientation", path.display())]
    #[diagnostic(help("name a rigid body; points alone have no orientation"))]
    NoOrientation {
        /// The file.
        path: PathBuf,
        /// Its name.
        body: String,
    },
    /// There is no body of this name.
    #[error("no body `{name}`: there are {names}")]
    NoBody {
        /// What was asked for.
        name: String,
        /// What there is.
        names: String,
    },
    /// There are several.
    #[error("which body? There are {names}")]
    #[diagnostic(help("name one of them: --body NAME, in Python body=NAME"))]
    WhichBody {
        /// What there is.
        names: String,
    },
}
