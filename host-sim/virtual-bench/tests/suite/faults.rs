//! The fault campaign: each fault once, the five states in turn. The whole of it, each in each state: `cargo virtual-bench --faults`.

use super::firmware;
use std::collections::BTreeMap;
use std::ops::ControlFlow;
use virtual_bench::campaign::table::{counted, failed, table};
use virtual_bench::campaign::{self, Done, Plan};

#[test]
fn each_fault_ends_safe_with_its_reason_and_no_motion_by_itself() {
    let goes_on = &mut |_: Done<'_>| Ok(ControlFlow::Continue(()));
    let runs = campaign::run(firmware(), &Plan::part(7), BTreeMap::new(), goes_on).unwrap();
    println!("{}", table(&runs));
    assert!(failed(&runs).is_empty(), "{:#?}", failed(&runs));
    assert!(counted(&runs) >= 65, "only {} of {} faults acted", counted(&runs), runs.len());
}

#[test]
fn noise_on_the_line_and_power_cuts_while_a_setting_is_stored_do_no_harm() {
    for verdict in campaign::trials(firmware(), &std::env::temp_dir()).unwrap() {
        println!("{}: {}", verdict.name, verdict.said);
        assert!(verdict.problems.is_empty(), "{verdict:#?}");
    }
}
