//! `rig`: simulate, identify and diagnose the rubber-asphalt friction rig.
#![forbid(unsafe_code)]

fn main() -> std::process::ExitCode {
    host_sim::cli::main()
}
