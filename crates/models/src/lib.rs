//! Mechanical models, the effects that extend them, and their fitting.
