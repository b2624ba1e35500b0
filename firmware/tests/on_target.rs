//! Tests that run on the board: `cargo test --release` with a board on the ST-LINK and the drives unplugged.
//!
//! Each check of `self_test.rs` starts from a reset and with the firmware's own start. Nothing needs to be wired;
//! encoders must not be. Here the test crate brings the panic handler, so the firmware's own, which makes safe and
//! restarts, is not in the way of the report.
#![no_std]
#![no_main]

use defmt_rtt as _;

#[cfg(test)]
#[embedded_test::tests]
mod tests {
    use rig_firmware::self_test::{self, Checked};
    use rig_firmware::start::{self, Started};

    #[init]
    fn init() {
        let Started { board, .. } = start::start();
        self_test::prepare(board);
    }

    fn passed(checked: Checked) {
        if let Err(why) = checked {
            panic!("{}: {}, must be {}", why.what, why.found, why.expected);
        }
    }

    #[test]
    fn the_core_runs_from_the_8_mhz_of_the_st_link() {
        passed(self_test::crystal());
    }

    // The crystal may take 4 s to start.
    #[test]
    #[timeout(15)]
    fn the_clock_is_within_1_percent_by_the_32_khz_crystal() {
        passed(self_test::clock());
    }

    #[test]
    fn every_model_gives_the_bits_it_gave_on_the_computer() {
        passed(self_test::models());
    }

    #[test]
    fn what_goes_out_of_the_dac_comes_back_through_the_adc() {
        passed(self_test::loop_back());
    }

    #[test]
    fn both_encoders_count_forth_and_back() {
        passed(self_test::encoders());
    }

    #[test]
    fn a_board_without_wires_reads_unsafe() {
        passed(self_test::inputs());
    }

    #[test]
    fn making_safe_takes_drives_and_torque_away() {
        passed(self_test::making_safe());
    }

    #[test]
    #[timeout(10)]
    fn ten_thousand_ticks_take_a_second_and_none_is_late() {
        passed(self_test::ticks());
    }
}
