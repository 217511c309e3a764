//! How a command fails: an exit code and one line that says the file, the place in it, what is wrong and what to do.

use std::path::{Path, PathBuf};

/// The exit codes of the program. 0 is success.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Exit {
    /// A fault of the program itself.
    Internal = 1,
    /// The command line makes no sense.
    Usage = 2,
    /// A file is unreadable, malformed or too large, or an output cannot be written.
    BadInput = 3,
    /// The device or a required feature is missing.
    Missing = 4,
    /// A check that was asked for failed.
    CheckFailed = 5,
}

/// Why a command failed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{}", self.line())]
pub struct Failure {
    /// The exit code.
    pub exit: Exit,
    /// The file it is about.
    pub file: Option<PathBuf>,
    /// The place in the file: a JSON pointer, a line or a byte offset.
    pub place: Option<String>,
    /// What is wrong.
    pub what: String,
    /// What to do about it.
    pub remedy: Option<String>,
}

impl Failure {
    /// A failure that is about no file.
    pub fn new(exit: Exit, what: impl Into<String>) -> Self {
        Self { exit, file: None, place: None, what: what.into(), remedy: None }
    }

    /// The command line makes no sense.
    pub fn usage(what: impl Into<String>) -> Self {
        Self::new(Exit::Usage, what)
    }

    /// A file is bad.
    pub fn bad_input(file: &Path, what: impl Into<String>) -> Self {
        Self::new(Exit::BadInput, what).in_file(file)
    }

    /// The device or a feature is missing.
    pub fn missing(what: impl Into<String>) -> Self {
        Self::new(Exit::Missing, what)
    }

    /// A file cannot be read or written.
    pub fn io(file: &Path, doing: &str, error: &std::io::Error) -> Self {
        let remedy = match error.kind() {
            std::io::ErrorKind::NotFound => "check the path",
            std::io::ErrorKind::PermissionDenied => "check the permissions",
            std::io::ErrorKind::StorageFull => "free some space",
            _ => "check the file and its disk",
        };
        let what = match error.kind() {
            std::io::ErrorKind::InvalidData => "it is no UTF-8 text".to_owned(),
            // The system's number for it helps nobody.
            _ => error.to_string().split(" (os error").next().unwrap_or_default().to_owned(),
        };
        Self::bad_input(file, format!("cannot {doing}: {what}")).remedy(remedy)
    }

    /// Names the file.
    #[must_use]
    pub fn in_file(mut self, file: &Path) -> Self {
        self.file = Some(file.to_owned());
        self
    }

    /// Names the place in the file.
    #[must_use]
    pub fn at(mut self, place: impl Into<String>) -> Self {
        self.place = Some(place.into());
        self
    }

    /// Says what to do.
    #[must_use]
    pub fn remedy(mut self, remedy: impl Into<String>) -> Self {
        self.remedy = Some(remedy.into());
        self
    }

    /// The one line: `file: place: what: remedy`, without the parts that are absent. Line breaks in the parts (messages
    /// of other libraries have them) become spaces.
    pub fn line(&self) -> String {
        let file = self.file.as_ref().map(|f| f.display().to_string());
        let parts = [file.as_deref(), self.place.as_deref(), Some(self.what.as_str()), self.remedy.as_deref()];
        let joined = parts.into_iter().flatten().collect::<Vec<_>>().join(": ");
        joined.split_whitespace().collect::<Vec<_>>().join(" ")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_is_one_line_that_says_file_place_fault_and_remedy() {
        let failure = Failure::bad_input(Path::new("a.gltf"), "index 9 is\nout of range")
            .at("/nodes/3/mesh")
            .remedy("the file has 2 meshes");
        assert_eq!(failure.to_string(), "a.gltf: /nodes/3/mesh: index 9 is out of range: the file has 2 meshes");
        assert_eq!(Failure::usage("no").to_string(), "no");
    }
}
