//! The command line of ndof.
