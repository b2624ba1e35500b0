//! Keeps the bench's clock in step with the wall's, and knows when it cannot.
//!
//! The bench never runs ahead. Where it falls behind by more than [`SLACK`] it lets the time go instead of catching
//! up: a host that counts on the wall's clock would see a rig that runs too fast.

use std::time::Duration;

/// What a hiccup of the computer may cost and still be caught up.
const SLACK: Duration = Duration::from_millis(50);
/// Shortest time between two reports, and the least that is worth one.
const REPORT_EVERY: Duration = Duration::from_secs(5);
const WORTH_A_REPORT: Duration = Duration::from_millis(100);

/// How fast the bench's time goes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Speed {
    /// So many seconds of the bench in one of the wall.
    Times(f64),
    /// As fast as the computer can.
    Max,
}

impl std::str::FromStr for Speed {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "max" {
            return Ok(Self::Max);
        }
        let allowed = "allowed: 0.05 to 5 (seconds of the bench in one of the wall), or max";
        match text.parse::<f64>() {
            Ok(times) if (0.05..=5.0).contains(&times) => Ok(Self::Times(times)),
            _ => Err(allowed.to_owned()),
        }
    }
}

/// How far the bench fell behind.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Behind {
    /// Time lost since the last report.
    pub lost: Duration,
    /// Time since the last report.
    pub over: Duration,
}

impl Behind {
    /// The sentence for the person at the bench.
    #[must_use]
    pub fn sentence(&self) -> String {
        let share = 1.0 - self.lost.as_secs_f64() / self.over.as_secs_f64().max(1e-9);
        format!(
            "falls behind: {:.2} s lost in the last {:.1} s, so the rig runs at {:.2} of the speed asked for",
            self.lost.as_secs_f64(),
            self.over.as_secs_f64(),
            share.max(0.0)
        )
    }
}

/// The two clocks.
#[derive(Debug)]
pub struct Pace {
    speed: Speed,
    /// The same moment on the wall and on the bench.
    anchor: (Duration, u64),
    reported: Duration,
    lost: Duration,
}

impl Pace {
    /// Both clocks start now.
    #[must_use]
    pub fn new(speed: Speed, wall: Duration, bench_ns: u64) -> Self {
        Self { speed, anchor: (wall, bench_ns), reported: wall, lost: Duration::ZERO }
    }

    /// How long to sleep before the bench may go on from `bench_ns`.
    pub fn sleep(&mut self, wall: Duration, bench_ns: u64) -> Duration {
        let Speed::Times(times) = self.speed else { return Duration::ZERO };
        let (wall_0, bench_0) = self.anchor;
        let due = wall_0 + Duration::from_nanos(bench_ns.saturating_sub(bench_0)).div_f64(times);
        if wall > due + SLACK {
            self.lost += wall - due;
            self.anchor = (wall, bench_ns);
        }
        due.saturating_sub(wall)
    }

    /// What has to be said about falling behind, once in a while.
    pub fn report(&mut self, wall: Duration) -> Option<Behind> {
        let over = wall.saturating_sub(self.reported);
        if self.lost < WORTH_A_REPORT || over < REPORT_EVERY {
            return None;
        }
        self.reported = wall;
        Some(Behind { lost: std::mem::take(&mut self.lost), over })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: Duration = Duration::from_millis(1);

    #[test]
    fn a_bench_that_is_ahead_sleeps_and_one_at_half_speed_twice_as_long() {
        let mut pace = Pace::new(Speed::Times(1.0), MS, 0);
        assert_eq!(pace.sleep(MS, 3_000_000), 3 * MS);
        assert_eq!(pace.sleep(3 * MS, 3_000_000), MS);
        let mut pace = Pace::new(Speed::Times(0.5), MS, 0);
        assert_eq!(pace.sleep(MS, 3_000_000), 6 * MS);
        let mut pace = Pace::new(Speed::Max, MS, 0);
        assert_eq!(pace.sleep(MS, 3_000_000), Duration::ZERO);
    }

    #[test]
    fn a_hiccup_is_caught_up_and_more_is_let_go_and_reported() {
        let mut pace = Pace::new(Speed::Times(1.0), Duration::ZERO, 0);
        // 40 ms late: no sleep until it is made good.
        assert_eq!(pace.sleep(50 * MS, 10_000_000), Duration::ZERO);
        assert_eq!(pace.sleep(50 * MS, 60_000_000), 10 * MS);
        // The bench makes 1 s in 2 s of the wall: half of that is lost, and it does not run fast afterwards.
        for step in 1..=100_u32 {
            pace.sleep(60 * MS + 60 * MS * step * 2, 60_000_000 + 60_000_000 * u64::from(step));
        }
        let behind = pace.report(12_060 * MS).unwrap();
        assert!((5.9..=6.0).contains(&behind.lost.as_secs_f64()), "{behind:?}");
        assert!(behind.sentence().contains("at 0.50 of the speed"), "{}", behind.sentence());
        assert_eq!(pace.report(20_000 * MS), None);
        assert_eq!(pace.sleep(12_060 * MS, 6_061_000_000), MS);
    }

    #[test]
    fn a_speed_is_a_factor_or_max() {
        assert_eq!("max".parse(), Ok(Speed::Max));
        assert_eq!("0.5".parse(), Ok(Speed::Times(0.5)));
        for wrong in ["0", "-1", "fast", "nan", "100"] {
            assert!(wrong.parse::<Speed>().unwrap_err().contains("0.05 to 5"), "{wrong}");
        }
    }
}
