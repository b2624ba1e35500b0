//! Tests that run on the board: `cargo test --release` with a board on the ST-LINK and the drives unplugged.
//!
//! Each test starts from a reset. Nothing needs to be wired; encoders must not be. Here the test crate brings
//! the panic handler, so the firmware's own, which makes safe and restarts, is not in the way of the report.
#![no_std]
#![no_main]

use defmt_rtt as _;

#[cfg(test)]
#[embedded_test::tests]
mod tests {
    use model_core::control::{AdcScan, ControlSettings, ControlState, DAC_ZERO, Samples};
    use model_core::selfcheck;
    use rig_firmware::board::Board;
    use rig_firmware::self_test::{DIGESTS, Encoder, STEPS, loop_back};
    use rig_firmware::{adc_scan, board, clocks, encoders, inputs, outputs, tick};

    #[init]
    fn init() -> Board {
        let crystal = clocks::crystal_present();
        let board = board::configure(embassy_stm32::init(clocks::config(crystal)));
        outputs::start();
        // The cycle counter is used by the tick.
        if let Some(mut core) = cortex_m::Peripherals::take() {
            core.DCB.enable_trace();
            core.DWT.enable_cycle_counter();
        }
        board
    }

    #[test]
    fn the_board_has_its_crystal(_board: Board) {
        assert!(clocks::crystal_is_used());
    }

    #[test]
    fn every_model_gives_the_bits_it_gave_on_the_computer(_board: Board) {
        for (model, (name, expected)) in selfcheck::NAMES.iter().zip(DIGESTS).enumerate() {
            let digest = selfcheck::run_model(model, STEPS);
            assert!(digest == expected, "{}: {:#x}, on the computer {:#x}", name, digest, expected);
        }
    }

    #[test]
    fn what_goes_out_of_the_dac_comes_back_through_the_adc(board: Board) {
        adc_scan::start(board.adc);
        for codes in [[DAC_ZERO; 2], [1024, 3072], [3072, 1024], [400, 3700]] {
            for (code, read) in codes.into_iter().zip(loop_back(codes)) {
                // Offset and gain errors of DAC and ADC together stay within 1 % of the range by their data sheet.
                let (sent, read) = (i32::from(code) * 16, i32::from(read));
                assert!((sent - read).abs() < 655, "sent {}, read {}", sent, read);
            }
        }
    }

    #[test]
    fn both_encoders_count_forth_and_back(_board: Board) {
        encoders::start();
        Encoder::M1.turn(400);
        Encoder::M2.turn(-200);
        assert_eq!((encoders::m1_count(), encoders::m2_count()), (400, 200u32.wrapping_neg()));
        Encoder::M1.turn(-404);
        assert_eq!(encoders::m1_count(), 0xFFFC, "16 bits wrap below zero");
    }

    #[test]
    fn a_board_without_wires_reads_unsafe(_board: Board) {
        let mut samples = Samples::default();
        inputs::read_into(&mut samples);
        assert!(samples.emergency_stop && samples.m1_drive_fault && samples.m2_drive_fault);
        assert!(!samples.arm_switch);
    }

    #[test]
    fn making_safe_takes_drives_and_torque_away(_board: Board) {
        outputs::write_references([4095, 0]);
        outputs::write_enables([true; 2]);
        outputs::make_safe();
        assert_eq!(outputs::shown(), ([DAC_ZERO; 2], [false; 2]));
    }

    #[test]
    #[timeout(10)]
    fn ten_thousand_ticks_take_a_second_and_none_is_late(board: Board) {
        encoders::start();
        adc_scan::start(board.adc);
        let mut settings = ControlSettings::default();
        settings.m1_encoder.counter_bits = board::M1_COUNTER_BITS;
        let config = match settings.build() {
            Ok(config) => config,
            Err(_) => panic!("the default settings are out of range"),
        };
        let mut ends = tick::start(config, ControlState::new(&config));
        let mut seen = 0;
        let health = loop {
            if let Some(health) = ends.health.dequeue() {
                seen += 1;
                if seen == 10 {
                    break health;
                }
            }
        };
        defmt::info!("most cycles of a tick: {=u32}", health.cycles_max);
        assert_eq!((health.tick, health.deadline_misses, health.missed_scans), (9999, 0, 0));
        assert!(health.cycles_max < 48_000);
        assert_ne!(adc_scan::codes(), AdcScan::default(), "the scan fills its memory");
    }
}
