//! A short soak. An hour of it: `cargo virtual-bench --soak 3600`.

use super::firmware;
use virtual_bench::soak::soak;

#[test]
fn twenty_seconds_of_experiments_and_commands_lose_nothing() {
    let soaked = soak(firmware(), 20.0, 3, &mut |_| ()).unwrap();
    println!("{soaked:#?}");
    println!("{}", soaked.stack);
    assert!(soaked.problems.is_empty(), "{:#?}", soaked.problems);
    assert!(soaked.experiments >= 4 && soaked.rows > 4_000);
}
