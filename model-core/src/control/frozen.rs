//! Analogue inputs that stay at one code.
//!
//! The noise of sensor, amplifier and converter moves every input by several codes from scan to scan. A channel that gives
//! the same code in each scan of a whole window is no measurement any more: its multiplexer, its converter or its
//! amplifier hangs, and a limit on it protects nothing. In windows that follow each other a channel that freezes is found
//! at the end of the first window that lies wholly after it, so within two.
//!
//! A window is long against chance: with a code taken half of the time 250 scans agree once in 2²⁴⁹. How noisy the inputs
//! are is the board's, so the board sets the window; without one nothing is watched.

use super::samples::AdcScan;

/// What is remembered of the window under way.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct FrozenState {
    first: AdcScan,
    /// Bits that differed from the first scan's in some scan since.
    varied: AdcScan,
    left: u32,
    frozen: bool,
}

/// One fresh scan; whether some channel stayed the same throughout the last whole window of so many ticks.
#[inline(always)]
pub(crate) fn step(state: &mut FrozenState, window_ticks: u32, scan: &AdcScan) -> bool {
    let FrozenState { first, varied, .. } = state;
    varied.friction_bridge |= scan.friction_bridge ^ first.friction_bridge;
    varied.normal_bridge |= scan.normal_bridge ^ first.normal_bridge;
    varied.m1_torque |= scan.m1_torque ^ first.m1_torque;
    varied.m2_torque |= scan.m2_torque ^ first.m2_torque;
    varied.supply |= scan.supply ^ first.supply;
    if state.left > 1 {
        state.left -= 1;
    } else {
        state.close(window_ticks, scan);
    }
    state.frozen
}

impl FrozenState {
    #[cold]
    fn close(&mut self, window_ticks: u32, scan: &AdcScan) {
        let v = &self.varied;
        // Before the first window there is none to judge.
        self.frozen = self.left == 1
            && [v.friction_bridge, v.normal_bridge, v.m1_torque, v.m2_torque, v.supply].contains(&0);
        (self.first, self.varied, self.left) = (*scan, AdcScan::default(), window_ticks);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WINDOW: u32 = 250;

    fn noisy(tick: u16) -> AdcScan {
        let n = tick % 3;
        AdcScan {
            friction_bridge: 32_768 + n,
            normal_bridge: 5_000 + n,
            m1_torque: 32_768 + n,
            m2_torque: 32_768 + n,
            supply: 43_000 + n,
        }
    }

    #[test]
    fn a_channel_that_freezes_is_found_within_two_windows_and_let_go_after_two_more() {
        type Freeze = fn(&mut AdcScan);
        let freeze: [Freeze; 5] = [
            |s| s.friction_bridge = 40_000,
            |s| s.normal_bridge = 40_000,
            |s| s.m1_torque = 40_000,
            |s| s.m2_torque = 40_000,
            |s| s.supply = 40_000,
        ];
        for freeze in freeze {
            for at in [700_u16, 749, 750, 751, 999] {
                let mut state = FrozenState::default();
                assert!((0..at).all(|tick| !step(&mut state, WINDOW, &noisy(tick))));
                let found = (0..).find(|n| {
                    let mut scan = noisy(at + n);
                    freeze(&mut scan);
                    step(&mut state, WINDOW, &scan)
                });
                let found = u32::from(found.expect("found"));
                assert!((WINDOW - 1..2 * WINDOW).contains(&found), "from {at}: after {found} scans");
                let gone = (0..).find(|n| !step(&mut state, WINDOW, &noisy(*n))).expect("gone");
                assert!(u32::from(gone) < 2 * WINDOW);
            }
        }
    }
}
