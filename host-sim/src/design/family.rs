//! Families of experiments, each made to tell one kind of cause from another, and their settings.
//!
//! | family | tells apart |
//! |---|---|
//! | load staircase | what follows the load: its dependence, crosstalk, hardening; what does not: a film |
//! | speed staircase | the shapes of friction over speed, and the two directions |
//! | reversals | elastic parts, relaxation, what happens around standstill |
//! | dwells | ageing of the contact at rest |
//! | slide, rest, slide | what recovers (heat) from what stays (wear) and from what goes on by itself (drift) |
//! | load steps | elastic parts in the first milliseconds, delays |
//! | there and back | places on the disc from time, heat and distance |
//! | press, then turn | what the bridge shows without friction |

/// An experiment with its levels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Setting {
    /// What is done.
    pub family: Family,
    /// Largest normal force asked for, N.
    pub load_n: f64,
    /// Largest speed asked for, rpm.
    pub speed_rpm: f64,
    /// Length of the longest hold, s.
    pub hold_s: f64,
}

/// What is done.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Family {
    /// Load up and down in steps at one speed.
    LoadStaircase,
    /// Speed up and down in steps in both directions under one load.
    SpeedStaircase,
    /// Speed follows a sine.
    Reversals,
    /// Standstill of growing length between short slides.
    Dwells,
    /// A long slide, a rest with the elements lifted off, a slide.
    SlideRestSlide,
    /// Load jumps between light and full at one speed.
    LoadSteps,
    /// Some revolutions forward, as many back.
    ThereAndBack,
    /// Load at standstill, turning without load, then both.
    PressThenTurn,
}

impl Family {
    /// All of them.
    pub const ALL: [Self; 8] = [
        Self::LoadStaircase,
        Self::SpeedStaircase,
        Self::Reversals,
        Self::Dwells,
        Self::SlideRestSlide,
        Self::LoadSteps,
        Self::ThereAndBack,
        Self::PressThenTurn,
    ];

    /// In words.
    #[must_use]
    pub const fn words(self) -> &'static str {
        match self {
            Self::LoadStaircase => "load staircase at constant speed",
            Self::SpeedStaircase => "speed staircase in both directions",
            Self::Reversals => "sinusoidal reversals",
            Self::Dwells => "dwells of growing length",
            Self::SlideRestSlide => "slide, rest lifted off, slide",
            Self::LoadSteps => "load steps at constant speed",
            Self::ThereAndBack => "revolutions there and back",
            Self::PressThenTurn => "press, then turn",
        }
    }
}

/// Load under which elements rest on the disc without pressing, N.
const LIGHT_N: f64 = 2.0;
/// Time that a change of load or speed takes before a hold counts, s.
const SETTLE_S: f64 = 0.3;

/// What one motor is asked for from a time on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Ask {
    /// A constant: N for M1, rpm for M2.
    Hold(f64),
    /// A sine around zero: amplitude, angular frequency in rad/s.
    Sine(f64, f64),
}

/// What both motors are asked for.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Course {
    /// Normal force: (start in s, N).
    pub load: Vec<(f64, Ask)>,
    /// Speed: (start in s, rpm).
    pub speed: Vec<(f64, Ask)>,
    /// Length, s.
    pub duration_s: f64,
}

impl Course {
    fn load(&mut self, newtons: f64) -> &mut Self {
        self.load.push((self.duration_s, Ask::Hold(newtons)));
        self
    }

    fn speed(&mut self, rpm: f64) -> &mut Self {
        self.speed.push((self.duration_s, Ask::Hold(rpm)));
        self
    }

    fn wait(&mut self, seconds: f64) -> &mut Self {
        self.duration_s += seconds;
        self
    }
}

impl Setting {
    /// The course of load and speed.
    #[must_use]
    pub fn course(&self) -> Course {
        let Self { load_n, speed_rpm, hold_s, .. } = *self;
        let mut c = Course::default();
        match self.family {
            Family::LoadStaircase => {
                c.load(0.2 * load_n).speed(speed_rpm).wait(SETTLE_S + hold_s);
                for share in [0.4, 0.6, 0.8, 1.0, 0.6, 0.2] {
                    c.load(share * load_n).wait(SETTLE_S + hold_s);
                }
            }
            Family::SpeedStaircase => {
                c.load(load_n);
                for share in [0.05, 0.2, 0.5, 1.0, 0.3, -0.05, -0.2, -0.5, -1.0, -0.3] {
                    c.speed(share * speed_rpm).wait(SETTLE_S + 0.7 * hold_s);
                }
            }
            Family::Reversals => {
                let turns = 6.0;
                c.load(load_n);
                c.speed.push((0.0, Ask::Sine(speed_rpm, std::f64::consts::TAU / hold_s)));
                c.wait(turns * hold_s);
            }
            Family::Dwells => {
                c.load(load_n).speed(speed_rpm).wait(1.0);
                for share in [0.05, 0.2, 1.0, 3.0, 0.2] {
                    c.speed(0.0).wait(share * hold_s);
                    c.speed(speed_rpm).wait(0.5 + SETTLE_S);
                }
            }
            Family::SlideRestSlide => {
                c.load(load_n).speed(speed_rpm).wait(4.0 * hold_s);
                c.load(0.0).speed(0.0).wait(4.0 * hold_s);
                c.load(load_n).speed(speed_rpm).wait(2.0 * hold_s);
            }
            Family::LoadSteps => {
                c.load(LIGHT_N).speed(speed_rpm).wait(1.0);
                for _ in 0..4 {
                    c.load(load_n).wait(0.5 * hold_s + SETTLE_S);
                    c.load(LIGHT_N).wait(0.3 + SETTLE_S);
                }
            }
            Family::ThereAndBack => {
                c.load(load_n).speed(speed_rpm).wait(3.0 * hold_s);
                c.speed(-speed_rpm).wait(3.0 * hold_s);
            }
            Family::PressThenTurn => {
                c.load(load_n).speed(0.0).wait(hold_s);
                c.load(0.0).wait(SETTLE_S).speed(speed_rpm).wait(hold_s);
                c.load(load_n).wait(hold_s);
                c.speed(-speed_rpm).wait(hold_s);
            }
        }
        c
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_family_begins_at_once_keeps_its_limits_and_never_goes_back() {
        for family in Family::ALL {
            let setting = Setting { family, load_n: 80.0, speed_rpm: 60.0, hold_s: 1.5 };
            let course = setting.course();
            assert!(course.duration_s > 1.0, "{family:?}");
            for (asked, most) in [(&course.load, 80.0), (&course.speed, 60.0)] {
                assert_eq!(asked[0].0, 0.0, "{family:?}");
                assert!(asked.windows(2).all(|w| w[0].0 < w[1].0), "{family:?}");
                assert!(asked.last().is_some_and(|last| last.0 < course.duration_s), "{family:?}");
                let highest = asked.iter().map(|(_, ask)| match ask {
                    Ask::Hold(value) | Ask::Sine(value, _) => value.abs(),
                });
                assert_eq!(highest.fold(0.0, f64::max), most, "{family:?}");
            }
        }
    }
}
