//! The `ndof` program.

fn main() -> std::process::ExitCode {
    ndof_cli::run(std::env::args_os(), ndof::studies::STUDIES)
}
