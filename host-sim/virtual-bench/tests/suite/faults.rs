//! The fault campaign.

use super::firmware;
use virtual_bench::campaign;

#[test]
fn every_fault_ends_with_safe_outputs_its_reason_and_no_motion_by_itself() {
    let scratch = std::env::temp_dir();
    let verdicts = campaign::run(firmware(), &scratch, &mut |_| ()).unwrap();
    println!("{}", campaign::table(&verdicts));
    let failed: Vec<_> = verdicts.iter().filter(|verdict| !verdict.held()).collect();
    assert!(failed.is_empty(), "{failed:#?}");
    assert!(verdicts.len() >= 24, "the campaign lost a fault");
}
