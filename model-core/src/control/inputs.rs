//! Switches and fault lines without their bounces: what is unsafe counts at once, what permits only after a time.
//!
//! A contact bounces for some milliseconds, and a broken wire may touch now and then. So a line that reads unsafe in one
//! sample is unsafe, and is safe again only when it read so for [`PERMISSION_S`] without a break.

use super::samples::Samples;

/// Time that a line must read safe without a break.
pub(crate) const PERMISSION_S: f32 = 5e-3;

/// Ticks for which each line still counts as unsafe.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct InputState {
    /// All lines have permitted for long enough.
    settled: bool,
    emergency_stop: u32,
    arm_switch: u32,
    m1_drive: u32,
    m2_drive: u32,
}

/// The lines as the core takes them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Lines {
    pub(crate) emergency_stop: bool,
    pub(crate) arm_switch: bool,
    pub(crate) m1_drive_fault: bool,
    pub(crate) m2_drive_fault: bool,
}

impl Lines {
    const PERMITTING: Self =
        Self { emergency_stop: false, arm_switch: true, m1_drive_fault: false, m2_drive_fault: false };
}

/// Whether a line counts as unsafe.
#[inline(always)]
fn unsafe_for(left: &mut u32, reads_unsafe: bool, ticks: u32) -> bool {
    *left = if reads_unsafe { ticks } else { left.saturating_sub(1) };
    *left != 0
}

impl InputState {
    /// Nothing was seen to be safe yet.
    pub(crate) const fn new(ticks: u32) -> Self {
        Self { settled: false, emergency_stop: ticks, arm_switch: ticks, m1_drive: ticks, m2_drive: ticks }
    }

    /// One tick; `ticks` is the time that permission takes, at least one.
    #[inline(always)]
    pub(crate) fn step(&mut self, samples: &Samples, ticks: u32) -> Lines {
        let permits = samples.arm_switch
            && !(samples.emergency_stop || samples.m1_drive_fault || samples.m2_drive_fault);
        if permits && self.settled { Lines::PERMITTING } else { self.count(samples, ticks) }
    }

    /// Some line does not permit, or did not lately.
    #[cold]
    fn count(&mut self, samples: &Samples, ticks: u32) -> Lines {
        let lines = Lines {
            emergency_stop: unsafe_for(&mut self.emergency_stop, samples.emergency_stop, ticks),
            arm_switch: !unsafe_for(&mut self.arm_switch, !samples.arm_switch, ticks),
            m1_drive_fault: unsafe_for(&mut self.m1_drive, samples.m1_drive_fault, ticks),
            m2_drive_fault: unsafe_for(&mut self.m2_drive, samples.m2_drive_fault, ticks),
        };
        self.settled = lines == Lines::PERMITTING;
        lines
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SAFE: Samples = Samples {
        m1_count: 0,
        m2_count: 0,
        counts_irregular: false,
        tick_irregular: false,
        adc: super::super::samples::AdcScan {
            friction_bridge: 0,
            normal_bridge: 0,
            m1_torque: 0,
            m2_torque: 0,
            supply: 0,
        },
        adc_fresh: true,
        adc_overrun: false,
        emergency_stop: false,
        arm_switch: true,
        m1_drive_fault: false,
        m2_drive_fault: false,
        deadline_missed: false,
        link_heard: true,
    };

    #[test]
    fn one_unsafe_sample_is_unsafe_and_safe_takes_its_time_without_a_break() {
        type Spoilt = (fn(&mut Samples), fn(&Lines) -> bool);
        let spoil: [Spoilt; 4] = [
            (|s| s.emergency_stop = true, |l| l.emergency_stop),
            (|s| s.arm_switch = false, |l| !l.arm_switch),
            (|s| s.m1_drive_fault = true, |l| l.m1_drive_fault),
            (|s| s.m2_drive_fault = true, |l| l.m2_drive_fault),
        ];
        for (spoil, is_unsafe) in spoil {
            let mut state = InputState::new(50);
            let first = (1..=100).find(|_| !is_unsafe(&state.step(&SAFE, 50)));
            assert_eq!(first, Some(50), "from the start");
            let mut spoiled = SAFE;
            spoil(&mut spoiled);
            assert!(is_unsafe(&state.step(&spoiled, 50)), "at once");
            for n in 0..200 {
                // Bounces: every 40th sample is bad again.
                let bounce = n % 40 == 39;
                assert!(is_unsafe(&state.step(if bounce { &spoiled } else { &SAFE }, 50)), "sample {n}");
            }
            let again = (1..=100).find(|_| !is_unsafe(&state.step(&SAFE, 50)));
            assert_eq!(again, Some(50));
        }
    }
}
