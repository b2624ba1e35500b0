//! What a run leaves: the core's record of every tick, and the truth at the same instant.

use crate::files::log::Log;
use crate::files::number::{angle_rad, widen};
use crate::files::signal::Signal;
use crate::plant::{Truth, time_s};
use model_core::control::{Fault, LimitSet, Record};
use rig_link::telemetry::CHANNELS;

/// One tick of an experiment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    /// What the core reported.
    pub record: Record,
    /// What really was at the sampling instant.
    pub truth: Truth,
}

/// A run of an experiment at the full control rate; frame `k` belongs to the time `k · 100 µs`.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Recording {
    /// All ticks while the experiment ran.
    pub frames: Vec<Frame>,
    /// The fault that ended the run early.
    pub fault: Option<Fault>,
    /// Limits that acted at least once.
    pub limits: LimitSet,
    /// Ticks from power-on to the end, start-up included.
    pub control_ticks: u64,
    /// Ticks that ended late, as the core counted them.
    pub deadline_misses: u64,
}

impl Recording {
    /// Time of a frame since the start of the experiment.
    #[must_use]
    pub fn time_s(&self, frame: usize) -> f64 {
        time_s(frame)
    }

    /// One signal over all frames.
    pub fn column(&self, signal: impl Fn(&Frame) -> f64) -> Vec<f64> {
        self.frames.iter().map(signal).collect()
    }

    /// The log as the host tool writes it from telemetry: each `every`-th tick. Angles come from exact counts;
    /// numbers of single precision are written with the digits they have.
    #[must_use]
    pub fn log(&self, every: usize, counts_per_rev: u32) -> Log {
        let picked = || self.frames.iter().step_by(every.max(1));
        let single = |f: fn(&Record) -> f32| picked().map(|x| widen(f(&x.record))).collect::<Vec<_>>();
        let angle =
            |f: fn(&Record) -> i64| picked().map(|x| angle_rad(f(&x.record), counts_per_rev)).collect();
        let mut log = Log::default();
        let times = (0..self.frames.len()).step_by(every.max(1)).map(|k| self.time_s(k));
        log.set_signal(Signal::Time, times.collect());
        log.set_signal(Signal::M1TorqueRef, single(|r| r.m1_torque_ref_nm));
        log.set_signal(Signal::M1Torque, single(|r| r.m1_torque_nm));
        log.set_signal(Signal::M1Angle, angle(|r| r.m1_count));
        log.set_signal(Signal::M2TorqueRef, single(|r| r.m2_torque_ref_nm));
        log.set_signal(Signal::M2Torque, single(|r| r.m2_torque_nm));
        log.set_signal(Signal::M2Angle, angle(|r| r.m2_count));
        log.set_signal(Signal::M2Speed, single(|r| r.m2_speed_rad_s));
        log.set_signal(Signal::NormalForce, single(|r| r.normal_force_n));
        log.set_signal(Signal::FrictionTorque, single(|r| r.friction_torque_nm));
        for channel in CHANNELS {
            log.set_numbers(channel.column, single(channel.of_record));
        }
        log
    }

    /// All ticks of what the figures of an experiment are taken from: motion, normal force, friction. Unlike [`Self::log`]
    /// not prepared for being written.
    #[must_use]
    pub fn signals(&self, counts_per_rev: u32) -> Log {
        let single = |f: fn(&Record) -> f32| self.column(|x| f64::from(f(&x.record)));
        let mut log = Log::default();
        log.set_signal(Signal::Time, (0..self.frames.len()).map(|k| self.time_s(k)).collect());
        log.set_signal(Signal::M2Angle, self.column(|x| angle_rad(x.record.m2_count, counts_per_rev)));
        log.set_signal(Signal::M2Speed, single(|r| r.m2_speed_rad_s));
        log.set_signal(Signal::NormalForce, single(|r| r.normal_force_n));
        log.set_signal(Signal::FrictionTorque, single(|r| r.friction_torque_nm));
        log
    }
}
