//! Recording files: one module a format, and atomic writing.
