//! How large an effect is in a log: what a baseline with the true numbers, driven by the noise-free
//! readings, leaves of each subsystem. A fit can make it smaller; it cannot be made without the log.

use serde::Serialize;

use crate::contact_force::{Contact, Touch};
use crate::contact_log::World;
use crate::curve::Curve;
use crate::drive::Drive;
use crate::filters::{BridgeFilter, Mode};

/// Window over which the drive's balance of torques is taken.
const WINDOW_S: f64 = 0.01;

/// Noise-free readings at one step.
#[derive(Debug, Clone, Copy)]
pub struct Read {
    /// M1 torque.
    pub m1_torque_nm: f64,
    /// M2 torque.
    pub m2_torque_nm: f64,
    /// M2 speed.
    pub speed_rad_s: f64,
    /// Normal force.
    pub normal_n: f64,
    /// Friction torque.
    pub friction_nm: f64,
}

/// RMS of what is left, and of the signal.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Residual {
    /// Friction torque left, at the samples.
    pub friction_nm: f64,
    /// Normal force left, at the samples.
    pub normal_n: f64,
    /// Balance of M2's torques left, over windows of 10 ms.
    pub drive_nm: f64,
    /// RMS friction torque.
    pub friction_signal_nm: f64,
    /// RMS normal force.
    pub normal_signal_n: f64,
    /// RMS torque of M2.
    pub drive_signal_nm: f64,
    /// RMS of what the factor on µ takes from the friction torque or adds to it: unlike what is left open
    /// loop, it does not count where a slip merely comes at another moment.
    pub factor_nm: f64,
}

/// The baseline beside the rig.
#[derive(Debug)]
pub struct Shadow {
    radius: f64,
    gain: f64,
    preload: f64,
    inertia: f64,
    contact: Contact,
    friction_bridge: BridgeFilter,
    mode: Mode,
    normal_bridge: BridgeFilter,
    friction: f64,
    normal: f64,
    squares: [f64; 4],
    samples: f64,
    per_window: usize,
    in_window: usize,
    balance: f64,
    torque: f64,
    speed: f64,
    drive_squares: [f64; 2],
    windows: f64,
    factor: [f64; 2],
}

impl Shadow {
    /// A baseline at rest under M1's torque.
    #[must_use]
    pub fn new(world: &World<'_>, step_s: f64, m1_torque_nm: f64) -> Self {
        let rig = world.rig;
        let start = rig.lever_gain_n_per_nm * m1_torque_nm - rig.preload_n;
        let curve = Curve::new(world.baseline, None, None);
        Self {
            radius: rig.friction_radius_m,
            gain: rig.lever_gain_n_per_nm,
            preload: rig.preload_n,
            inertia: rig.inertia_kg_m2,
            contact: Contact::new(world.baseline, curve, step_s),
            friction_bridge: BridgeFilter::new(rig.friction_bridge.as_ref(), step_s, 0.0),
            mode: Mode::new(rig.pressure_mode_hz, rig.pressure_damping, step_s, start),
            normal_bridge: BridgeFilter::new(rig.normal_bridge.as_ref(), step_s, start.max(0.0)),
            friction: 0.0,
            normal: 0.0,
            squares: [0.0; 4],
            samples: 0.0,
            per_window: (WINDOW_S / step_s).round() as usize,
            in_window: 0,
            balance: 0.0,
            torque: 0.0,
            speed: 0.0,
            drive_squares: [0.0; 2],
            windows: 0.0,
            factor: [0.0; 2],
        }
    }

    /// Notes the true friction torque of a step and the factor on µ in it.
    pub fn scaled(&mut self, torque_nm: f64, factor: f64) {
        self.factor[0] += (torque_nm * (1.0 - 1.0 / factor)).powi(2);
        self.factor[1] += 1.0;
    }

    /// Follows the rig by one step.
    pub fn step(&mut self, read: &Read, drive: &Drive) {
        let touch = Touch {
            root_speed_m_s: read.speed_rad_s * self.radius,
            normal_n: read.normal_n.max(0.0),
            scale: 1.0,
        };
        let torque = self.radius * self.contact.step(&touch);
        self.friction = self.friction_bridge.step(torque);
        let force = self.mode.step(self.gain * read.m1_torque_nm - self.preload);
        self.normal = self.normal_bridge.step(force.max(0.0));
        self.balance += read.m2_torque_nm - read.friction_nm - drive.plain_drag(read.speed_rad_s);
        self.torque += read.m2_torque_nm;
        self.in_window += 1;
        if self.in_window == self.per_window {
            let count = self.per_window as f64;
            let left = self.balance / count - self.inertia * (read.speed_rad_s - self.speed) / WINDOW_S;
            self.drive_squares[0] += left * left;
            self.drive_squares[1] += (self.torque / count).powi(2);
            self.windows += 1.0;
            (self.in_window, self.balance, self.torque) = (0, 0.0, 0.0);
            self.speed = read.speed_rad_s;
        }
    }

    /// Compares at a sample.
    pub fn sample(&mut self, read: &Read) {
        self.squares[0] += (read.friction_nm - self.friction).powi(2);
        self.squares[1] += (read.normal_n - self.normal).powi(2);
        self.squares[2] += read.friction_nm.powi(2);
        self.squares[3] += read.normal_n.powi(2);
        self.samples += 1.0;
    }

    /// RMS of everything.
    #[must_use]
    pub fn finish(self) -> Residual {
        let rms = |sum: f64, count: f64| (sum / count.max(1.0)).sqrt();
        Residual {
            friction_nm: rms(self.squares[0], self.samples),
            normal_n: rms(self.squares[1], self.samples),
            drive_nm: rms(self.drive_squares[0], self.windows),
            friction_signal_nm: rms(self.squares[2], self.samples),
            normal_signal_n: rms(self.squares[3], self.samples),
            drive_signal_nm: rms(self.drive_squares[1], self.windows),
            factor_nm: rms(self.factor[0], self.factor[1]),
        }
    }
}
