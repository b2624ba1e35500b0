//! `cargo virtual-bench`.

use std::process::ExitCode;

fn main() -> ExitCode {
    virtual_bench::cli::main()
}
