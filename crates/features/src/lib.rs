//! Empty: the manifest of this crate enables features of dependencies, so that the program, the
//! tests and the Python package share compiled crates.
