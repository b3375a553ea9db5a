//! Run folders made up from closed forms. Tests of other crates include some of the files.

pub mod flows;
pub mod fresh;
pub mod heap;
pub mod pair;
pub mod surfaces;
pub mod writing;
