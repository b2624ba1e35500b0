//! `cargo virtual-bench`.

fn main() {}
