//! Random courses of load and motion for contact logs.
//!
//! A course of 20 s is a shuffled deck of scenes: dwells of three lengths, a long slide at power, slow,
//! middle and fast slides in both directions, a crawl, ramps through zero, sines with and without
//! reversal, quick reversals, and parts in torque mode that do not slide. Loads come from a deck of
//! their own: steps, stairs, ramps, sines, wiggles over levels from light to full. Every course holds
//! all of it, so that the course does not tell which effect is hidden.

use std::f64::consts::TAU;

use crate::random::Stream;

/// A shape over time; times are relative to its start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Shape {
    /// Constant.
    Hold(f64),
    /// Straight line over a time, then constant.
    Ramp {
        /// Start value.
        from: f64,
        /// End value.
        to: f64,
        /// Time it takes.
        over_s: f64,
    },
    /// mean + amplitude·sin(2π f t).
    Sine {
        /// Mean value.
        mean: f64,
        /// Amplitude.
        amplitude: f64,
        /// Frequency.
        hz: f64,
    },
    /// Changes sign every half period.
    Square {
        /// Amplitude.
        amplitude: f64,
        /// Frequency.
        hz: f64,
    },
    /// Equal steps over a time, then constant.
    Stairs {
        /// First level.
        from: f64,
        /// Last level.
        to: f64,
        /// Number of steps.
        steps: f64,
        /// Time it takes.
        over_s: f64,
    },
}

impl Shape {
    /// Value at a time after the start.
    #[must_use]
    pub fn at(&self, t: f64) -> f64 {
        match *self {
            Self::Hold(value) => value,
            Self::Ramp { from, to, over_s } => from + (to - from) * (t / over_s).clamp(0.0, 1.0),
            Self::Sine { mean, amplitude, hz } => mean + amplitude * (TAU * hz * t).sin(),
            Self::Square { amplitude, hz } => {
                if (hz * t).fract() < 0.5 {
                    amplitude
                } else {
                    -amplitude
                }
            }
            Self::Stairs { from, to, steps, over_s } => {
                let step = (t / over_s * steps).floor().clamp(0.0, steps);
                from + (to - from) * step / steps
            }
        }
    }
}

/// What M2 does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Motion {
    /// Speed in rad/s, reached at no more than the acceleration in rad/s².
    Speed(Shape, f64),
    /// Torque in N·m.
    Torque(Shape),
}

/// A course: both lists begin at 0 and are in order of time.
#[derive(Debug, Clone, PartialEq)]
pub struct Course {
    /// Static normal force asked for, N.
    pub load: Vec<(f64, Shape)>,
    /// Motion of M2.
    pub motion: Vec<(f64, Motion)>,
    /// Length.
    pub duration_s: f64,
}

/// What a course may ask of the rig.
#[derive(Debug, Clone, Copy)]
pub struct Limits {
    /// Greatest normal force, N.
    pub normal_n: f64,
    /// Torque per normal force that is sure not to break the contact away, N·m/N.
    pub holding_nm_per_n: f64,
    /// Greatest speed, rad/s.
    pub speed_rad_s: f64,
}

/// Entry of `list` that is in force at `time`, with its start; `list` must not be empty.
#[must_use]
pub fn active<T: Copy>(list: &[(f64, T)], time: f64) -> (f64, T) {
    let next = list.partition_point(|(start, _)| *start <= time);
    list[next.saturating_sub(1)]
}

#[derive(Clone, Copy, PartialEq)]
enum Scene {
    LongDwell,
    MiddleDwell,
    ShortDwell,
    LongSlide,
    MiddleSlide(f64),
    FastSlide,
    Crawl,
    ThroughZero,
    ReversingSine,
    OneWaySine,
    Reversals,
    TorqueSine,
    TorqueSteps,
}

#[derive(Clone, Copy)]
enum Loading {
    Step,
    StairsUp,
    StairsDown,
    Ramp,
    Sine,
    Wiggle,
    Hat,
}

struct Writer<'a> {
    s: &'a mut Stream,
    limits: Limits,
    course: Course,
    time_s: f64,
    level_n: f64,
    levels: Vec<f64>,
    loadings: Vec<Loading>,
}

impl Course {
    /// Draws a course.
    #[must_use]
    pub fn draw(s: &mut Stream, limits: Limits, duration_s: f64) -> Self {
        let decks = (duration_s / 30.0).ceil().max(1.0) as usize;
        let mut scenes = Vec::new();
        for _ in 0..decks {
            let direction = s.sign();
            let mut deck = vec![
                Scene::LongDwell,
                Scene::MiddleDwell,
                Scene::ShortDwell,
                Scene::ShortDwell,
                Scene::LongSlide,
                Scene::MiddleSlide(direction),
                Scene::MiddleSlide(-direction),
                Scene::FastSlide,
                Scene::Crawl,
                Scene::ThroughZero,
                Scene::ReversingSine,
                Scene::OneWaySine,
                Scene::Reversals,
                Scene::TorqueSine,
                Scene::TorqueSteps,
            ];
            s.shuffle(&mut deck);
            scenes.extend(deck);
        }
        let lengths: Vec<f64> = scenes.iter().map(|scene| scene.length(s)).collect();
        let lead = 0.3;
        let stretch = (duration_s - lead) / lengths.iter().sum::<f64>();
        let level = limits.normal_n * s.uniform(0.25, 0.5);
        let course = Self {
            load: vec![(0.0, Shape::Hold(level))],
            motion: vec![(0.0, Motion::Speed(Shape::Hold(0.0), 100.0))],
            duration_s,
        };
        let mut writer = Writer {
            s,
            limits,
            course,
            time_s: lead,
            level_n: level,
            levels: Vec::new(),
            loadings: Vec::new(),
        };
        for (scene, length) in scenes.iter().zip(&lengths) {
            writer.scene(*scene, length * stretch);
        }
        writer.course
    }
}

impl Scene {
    fn length(self, s: &mut Stream) -> f64 {
        match self {
            Self::LongDwell => s.uniform(1.5, 2.3),
            Self::MiddleDwell => s.uniform(0.6, 1.1),
            Self::ShortDwell => s.uniform(0.12, 0.4),
            Self::LongSlide => s.uniform(3.2, 4.4),
            Self::MiddleSlide(_) | Self::FastSlide => s.uniform(0.9, 1.4),
            Self::Crawl => s.uniform(0.8, 1.2),
            Self::ThroughZero | Self::TorqueSine => s.uniform(1.0, 1.6),
            Self::ReversingSine => s.uniform(1.6, 2.4),
            Self::OneWaySine | Self::Reversals => s.uniform(1.1, 1.6),
            Self::TorqueSteps => s.uniform(0.7, 1.1),
        }
    }
}

impl Writer<'_> {
    /// A level from a stratified, shuffled supply: no two courses alike, none without light and full load.
    fn next_level(&mut self) -> f64 {
        if self.levels.is_empty() {
            self.levels = vec![0.1, 0.22, 0.36, 0.5, 0.65, 0.8, 0.97];
            self.s.shuffle(&mut self.levels);
        }
        let share = self.levels.pop().unwrap_or(0.5) + self.s.uniform(-0.03, 0.03);
        (share * self.limits.normal_n).max(4.0)
    }

    fn next_loading(&mut self) -> Loading {
        if self.loadings.is_empty() {
            self.loadings = vec![
                Loading::Step,
                Loading::Step,
                Loading::StairsUp,
                Loading::StairsDown,
                Loading::Ramp,
                Loading::Sine,
                Loading::Wiggle,
                Loading::Hat,
            ];
            self.s.shuffle(&mut self.loadings);
        }
        self.loadings.pop().unwrap_or(Loading::Step)
    }

    fn load(&mut self, after_s: f64, shape: Shape) {
        self.course.load.push((self.time_s + after_s, shape));
    }

    fn load_step(&mut self, after_s: f64, level: f64) {
        self.load(after_s, Shape::Hold(level));
        self.level_n = level;
    }

    fn motion(&mut self, after_s: f64, motion: Motion) {
        self.course.motion.push((self.time_s + after_s, motion));
    }

    fn speed(&mut self, shape: Shape) {
        let slew = self.s.log_uniform(30.0, 150.0);
        self.motion(0.0, Motion::Speed(shape, slew));
    }

    fn scene(&mut self, scene: Scene, length: f64) {
        let top = self.limits.speed_rad_s;
        match scene {
            Scene::LongDwell | Scene::MiddleDwell | Scene::ShortDwell => {
                self.speed(Shape::Hold(0.0));
                let level = self.next_level().max(0.3 * self.limits.normal_n);
                if scene == Scene::LongDwell {
                    self.load_step(0.15 * length, level);
                }
            }
            Scene::LongSlide => {
                let speed = self.s.signed(0.45, 0.75) * top;
                self.speed(Shape::Hold(speed));
                let level = self.limits.normal_n * self.s.uniform(0.8, 0.98);
                self.load_step(0.08 * length, level);
            }
            Scene::TorqueSine | Scene::TorqueSteps => self.torque_scene(scene, length),
            _ => {
                self.sliding(scene, length);
                self.loading(length);
            }
        }
        self.time_s += length;
    }

    fn sliding(&mut self, scene: Scene, length: f64) {
        let top = self.limits.speed_rad_s;
        let shape = match scene {
            Scene::MiddleSlide(direction) => {
                Shape::Hold(direction * self.s.log_uniform(0.08 * top, 0.4 * top))
            }
            Scene::FastSlide => Shape::Hold(self.s.signed(0.75, 1.0) * top),
            Scene::Crawl => Shape::Hold(self.s.signed(0.04, 0.09) * top),
            Scene::ThroughZero => {
                let end = self.s.signed(0.2, 0.6) * top;
                Shape::Ramp { from: -end, to: end * self.s.uniform(0.5, 1.0), over_s: length }
            }
            Scene::OneWaySine => {
                let mean = self.s.signed(0.25, 0.45) * top;
                let amplitude = mean * self.s.uniform(0.5, 0.85);
                Shape::Sine { mean, amplitude, hz: self.s.uniform(0.8, 2.0) }
            }
            Scene::Reversals => {
                Shape::Square { amplitude: self.s.signed(0.06, 0.3) * top, hz: self.s.uniform(1.5, 3.0) }
            }
            _ => Shape::Sine {
                mean: 0.0,
                amplitude: self.s.signed(0.12, 0.45) * top,
                hz: self.s.uniform(0.6, 1.6),
            },
        };
        self.speed(shape);
    }

    fn loading(&mut self, length: f64) {
        let from = self.level_n;
        let level = self.next_level();
        let full = self.limits.normal_n;
        match self.next_loading() {
            Loading::Step => {
                let after = self.s.uniform(0.35, 0.65) * length;
                self.load_step(after, level);
            }
            up_or_down @ (Loading::StairsUp | Loading::StairsDown) => {
                let (low, high) = (0.12 * full, 0.95 * full);
                let rising = matches!(up_or_down, Loading::StairsUp);
                let (start, end) = if rising { (low, high) } else { (high, low) };
                let steps = 3.0 + self.s.below(3) as f64;
                let stairs = Shape::Stairs { from: start, to: end, steps, over_s: 0.85 * length };
                self.load(0.1 * length, stairs);
                self.level_n = end;
            }
            Loading::Ramp => {
                self.load(0.2 * length, Shape::Ramp { from, to: level, over_s: 0.6 * length });
                self.level_n = level;
            }
            Loading::Sine => {
                let mean = full * self.s.uniform(0.4, 0.6);
                let amplitude = mean * self.s.uniform(0.35, 0.7);
                let hz = self.s.log_uniform(0.7, 4.0);
                self.load(0.15 * length, Shape::Sine { mean, amplitude, hz });
                self.load_step(0.95 * length, mean);
            }
            Loading::Wiggle => {
                let mean = full * self.s.uniform(0.35, 0.7);
                let amplitude = mean * self.s.uniform(0.08, 0.2);
                let hz = self.s.uniform(6.0, 14.0);
                self.load(0.2 * length, Shape::Sine { mean, amplitude, hz });
                self.load_step(0.8 * length, mean);
            }
            Loading::Hat => {
                let (low, high) = (0.15 * full, 0.9 * full);
                self.load(0.1 * length, Shape::Ramp { from, to: high, over_s: 0.4 * length });
                self.load(0.55 * length, Shape::Ramp { from: high, to: low, over_s: 0.35 * length });
                self.level_n = low;
            }
        }
    }

    fn torque_scene(&mut self, scene: Scene, length: f64) {
        // First stop and press, then push: less than what breaks away.
        let settle = 0.2_f64.min(0.3 * length);
        let level = self.limits.normal_n * self.s.uniform(0.75, 0.95);
        self.speed(Shape::Hold(0.0));
        let (from, over_s) = (self.level_n, 0.5 * settle);
        self.load(0.0, Shape::Ramp { from, to: level, over_s });
        self.level_n = level;
        let holding = self.limits.holding_nm_per_n * level;
        if scene == Scene::TorqueSine {
            let amplitude = holding * self.s.uniform(0.25, 0.55);
            let hz = self.s.log_uniform(0.6, 3.0);
            self.motion(settle, Motion::Torque(Shape::Sine { mean: 0.0, amplitude, hz }));
        } else {
            let first = holding * self.s.signed(0.25, 0.6);
            self.motion(settle, Motion::Torque(Shape::Hold(first)));
            let second = -first * self.s.uniform(0.0, 1.0);
            self.motion(0.5 * (settle + length), Motion::Torque(Shape::Hold(second)));
        }
    }
}

/// The paper's course: speed step at 3.5 s at low load, load step at 4 s; lasts 8 s.
#[must_use]
pub fn paper(speed_rpm: f64, low_n: f64, high_n: f64) -> Course {
    let speed = speed_rpm * TAU / 60.0;
    Course {
        load: vec![(0.0, Shape::Hold(low_n)), (4.0, Shape::Hold(high_n))],
        motion: vec![
            (0.0, Motion::Speed(Shape::Hold(0.0), 1e4)),
            (3.5, Motion::Speed(Shape::Hold(speed), 1e4)),
        ],
        duration_s: 8.0,
    }
}
