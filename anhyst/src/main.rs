use std::process::ExitCode;

fn main() -> ExitCode {
    anhyst::entry::main(&std::env::args_os().collect::<Vec<_>>()).into()
}
