//! What a control tick costs, and that a run is the same run each time.

use super::runs::{again, run};
use virtual_bench::budget::{Budget, Cost, RECORDED};

#[test]
fn no_tick_costs_more_than_is_on_the_record() {
    let budget = Budget::read().unwrap();
    // From the last on: other checks begin with the first, and would wait for a run that is being made.
    let refused: Vec<String> = RECORDED
        .iter()
        .rev()
        .filter_map(|name| {
            let cost = Cost::of(&run(name).ticks);
            println!("{name:<12} {cost}");
            budget.check(name, &cost).err().map(|error| error.to_string())
        })
        .collect();
    assert!(refused.is_empty(), "{}", refused.join("\n"));
}

#[test]
fn a_run_repeated_gives_the_same_bytes_and_the_same_instructions() {
    let (first, second) = (run("fig18"), again("fig18"));
    assert_eq!(first.csv().to_csv(), second.csv().to_csv(), "log.csv");
    assert_eq!(first.record.log, second.record.log, "bytes of the defmt log");
    // Number, sum, least, most and a hash over every tick's count.
    assert_eq!(first.ticks, second.ticks, "instructions of the ticks");
    assert_eq!(first.record.instructions, second.record.instructions, "instructions of the whole run");
    let capture = |done: &virtual_bench::experiment::Done| done.captured.as_ref().map(|c| c.log().to_csv());
    assert!(capture(&first).is_some());
    assert_eq!(capture(&first), capture(&second), "capture.csv");
}
