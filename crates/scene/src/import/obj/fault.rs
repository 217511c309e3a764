/// What is wrong with a line of an OBJ file.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ObjFault {
    /// A word that should be a number.
    #[error("\"{0}\" is not a number; correct the line or export the file again")]
    NotANumber(String),
    /// NaN, infinity, or beyond what single precision holds.
    #[error("\"{0}\" is not a finite number of single precision; repair the geometry and export the file again")]
    NotFinite(String),
    /// A statement that ends early.
    #[error("{statement} needs {needed} numbers, but the line has {found}; the file may be truncated")]
    TooFewNumbers {
        /// The statement.
        statement: &'static str,
        /// Numbers it needs.
        needed: usize,
        /// Numbers there are.
        found: usize,
    },
    /// A corner that is not of the form `v`, `v/vt`, `v//vn` or `v/vt/vn`.
    #[error("\"{0}\" is no corner; write v, v/vt, v//vn or v/vt/vn with whole numbers")]
    NotACorner(String),
    /// The index 0.
    #[error("the index of a {0} is 0, but they are counted from 1; export the file again")]
    ZeroIndex(&'static str),
    /// An index to something that is not there.
    #[error("there is no {kind} {index}: the file has {total}, {before} of them before this line")]
    IndexRange {
        /// What it should name.
        kind: &'static str,
        /// The index as the file has it; negative ones count back from the line.
        index: i64,
        /// How many the whole file has.
        total: usize,
        /// How many came before the line.
        before: usize,
    },
    /// More than 32-bit indices can name.
    #[error("there are more than {limit} {kind}; split the file")]
    TooMany {
        /// What.
        kind: &'static str,
        /// How many there may be.
        limit: u64,
    },
}
