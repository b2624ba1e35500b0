//! A short soak. An hour of it: `cargo virtual-bench --soak 3600`.

use super::firmware;
use virtual_bench::budget::{Budget, recorded_soak};

#[test]
fn twenty_seconds_of_experiments_and_commands_lose_nothing() {
    let soaked = recorded_soak(firmware()).unwrap();
    println!("{soaked:#?}");
    println!("{}", soaked.stack);
    assert!(soaked.problems.is_empty(), "{:#?}", soaked.problems);
    Budget::read().unwrap().check_stack(&soaked.stack).unwrap();
    assert!(soaked.experiments >= 4 && soaked.rows > 4_000);
}
