//! The program from outside: each command, exit code and message.

mod commands;
mod design;
mod errors;
mod faults;
mod privacy;
mod reference;
mod support;
