//! What can be wrong with a mesh file.

/// Why a mesh or material file cannot be read: the value, its place and what is allowed.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ReadError {
    /// Text where a finite number should be.
    #[error("line {line}: \"{token}\" is not a finite number")]
    Number {
        /// Line of the file, from 1.
        line: usize,
        /// What stands there.
        token: String,
    },
    /// Text where a whole number should be.
    #[error("line {line}: \"{token}\" is not a whole number")]
    Whole {
        /// Line of the file, from 1.
        line: usize,
        /// What stands there.
        token: String,
    },
    /// A statement with too few values, or a facet with too many.
    #[error("line {line}: {statement} has {found} values, it takes {allowed}")]
    Count {
        /// Line of the file, from 1.
        line: usize,
        /// The statement.
        statement: String,
        /// Values found.
        found: usize,
        /// How many it takes.
        allowed: &'static str,
    },
    /// A corner of a face in no known form.
    #[error(
        "line {line}: \"{token}\" is not a corner of a face; v, v/vt, v//vn and v/vt/vn are, in whole numbers"
    )]
    Corner {
        /// Line of the file, from 1.
        line: usize,
        /// What stands there.
        token: String,
    },
    /// A vertex number that no vertex has.
    #[error(
        "line {line}: there is no vertex {index}; {vertices} are defined: numbers run from 1, or back from -1"
    )]
    Index {
        /// Line of the file, from 1.
        line: usize,
        /// The number as written.
        index: i64,
        /// How many vertices it may count from: all of the file, or for a negative number all above the line.
        vertices: usize,
    },
    /// More names than can be numbered.
    #[error("line {line}: \"{name}\" is one more name than the {limit} {what} a mesh can have")]
    Full {
        /// Line of the file, from 1.
        line: usize,
        /// The name.
        name: String,
        /// Groups or materials.
        what: &'static str,
        /// How many there can be.
        limit: usize,
    },
    /// A statement that does not belong where it stands.
    #[error("line {line}: \"{found}\" where {allowed} should be")]
    Misplaced {
        /// Line of the file, from 1.
        line: usize,
        /// What stands there.
        found: String,
        /// What may stand there.
        allowed: &'static str,
    },
    /// A binary STL file of the wrong length.
    #[error("a binary STL file of {facets} facets has {expected} bytes, this one has {found}")]
    Length {
        /// Facets the file says it has.
        facets: u32,
        /// Length it should have \[bytes\].
        expected: u64,
        /// Length it has \[bytes\].
        found: u64,
    },
    /// A file too short for any STL.
    #[error("{found} bytes are no STL file: a text one begins with \"solid\", a binary one has at least 84 bytes")]
    NoStl {
        /// Length of the file \[bytes\].
        found: usize,
    },
    /// A coordinate in a binary STL file that is not finite.
    #[error("facet {facet} (from 0), byte {byte}: a coordinate is {value}, it must be finite")]
    Coordinate {
        /// Facet, from 0.
        facet: usize,
        /// Where the coordinate stands in the file, from 0.
        byte: usize,
        /// The coordinate as text.
        value: String,
    },
}

/// Two meshes that do not fit into one.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("together the meshes have {count} {what}; one can have {limit}")]
pub struct Full {
    /// Vertices, groups or materials.
    pub what: &'static str,
    /// How many there would be, at least.
    pub count: usize,
    /// How many there can be.
    pub limit: usize,
}
