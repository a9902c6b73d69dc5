//! The studies that are built into the program: the files of `examples/studies`.

/// Name and text of each.
pub const STUDIES: &[(&str, &str)] = &[("arm", include_str!("../examples/studies/arm.toml"))];
