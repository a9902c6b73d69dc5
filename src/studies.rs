//! The studies that are built into the program: the files of `examples/studies`.

/// Name and text of each.
pub const STUDIES: &[(&str, &str)] = &[
    ("arm", include_str!("../examples/studies/arm.toml")),
    ("arm-moving", include_str!("../examples/studies/arm_moving.toml")),
    ("arm-hidden", include_str!("../examples/studies/arm_hidden.toml")),
    ("sensitivity", include_str!("../examples/studies/sensitivity.toml")),
    ("drift", include_str!("../examples/studies/drift.toml")),
    ("masses", include_str!("../examples/studies/masses.toml")),
    ("spring-array", include_str!("../examples/studies/spring_array.toml")),
    ("wrist", include_str!("../examples/studies/wrist.toml")),
];
