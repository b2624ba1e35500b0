//! Runs a course on the contact rig and records what its sensors would read without noise.
//!
//! Step 25 µs; controllers every 250 µs; bridges stepped with the plant; samples by a [`schedule`]
//! of steps.
//!
//! [`schedule`]: crate::imperfections::Imperfections::schedule

use crate::contact_force::{Contact, Touch};
use crate::course::{Course, Motion, active};
use crate::curve::Curve;
use crate::drive::{Drive, DriveNumbers, SpeedLoop};
use crate::filters::BridgeFilter;
use crate::imperfections::Disturbance;
use crate::laws::measurement::Drifting;
use crate::laws::thermal::ThermalFade;
use crate::laws::{Laws, Slide, Units};
use crate::pressure::Pressure;
use crate::random::Stream;
use crate::rig::{Friction, Rig};
use crate::shadow::{Read, Residual, Shadow};

/// Steps per second.
pub const STEPS_PER_S: f64 = 40_000.0;
/// Steps per control period.
const STEPS_PER_CONTROL: usize = 10;
/// Speed at which torque mode gives up and brakes.
const RUNAWAY_RAD_S: f64 = 6.0;

/// One sample before noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// Time.
    pub time_s: f64,
    /// M1 torque commanded.
    pub m1_torque_ref_nm: f64,
    /// M1 torque reported.
    pub m1_torque_nm: f64,
    /// M1 angle.
    pub m1_angle_rad: f64,
    /// M2 torque commanded.
    pub m2_torque_ref_nm: f64,
    /// M2 torque reported.
    pub m2_torque_nm: f64,
    /// M2 angle.
    pub m2_angle_rad: f64,
    /// M2 speed.
    pub m2_speed_rad_s: f64,
    /// Normal force.
    pub normal_force_n: f64,
    /// Friction torque.
    pub friction_torque_nm: f64,
    /// Surface temperature.
    pub surface_temperature_c: f64,
}

/// A log before noise.
#[derive(Debug, Clone)]
pub struct CleanLog {
    /// Samples.
    pub samples: Vec<Sample>,
    /// What a baseline with the true numbers would leave.
    pub residual: Residual,
}

impl CleanLog {
    /// Whether the drive goes from limit to limit: for a tenth of the time it asks for all of its torque.
    #[must_use]
    pub fn hunts(&self, rated_torque_nm: f64) -> bool {
        let at_limit = |sample: &&Sample| sample.m2_torque_ref_nm.abs() > 0.99 * rated_torque_nm;
        10 * self.samples.iter().filter(at_limit).count() > self.samples.len()
    }
}

/// A rig with everything that decides its behaviour.
#[derive(Debug, Clone)]
pub struct World<'a> {
    /// Mechanics and electronics.
    pub rig: &'a Rig,
    /// Friction.
    pub friction: &'a Friction,
    /// Friction of the baseline: the true numbers, the kind a user would assume.
    pub baseline: &'a Friction,
    /// Effects as drawn, memories fresh.
    pub laws: &'a Laws,
    /// Bandwidth of M2's speed loop, rad/s.
    pub bandwidth_rad_s: f64,
}

impl World<'_> {
    fn contact(&self, step_s: f64) -> Contact {
        let curve = Curve::new(self.friction, self.laws.bell_curve, self.laws.direction_asymmetry);
        let branches = self
            .laws
            .rubber_relaxation
            .as_ref()
            .map_or(Vec::new(), |law| law.beside(self.friction.k_u_n_per_m));
        Contact::new(self.friction, curve, step_s)
            .with_film(self.laws.viscous_film)
            .with_block(&branches, self.laws.element_compliance.unwrap_or_default())
    }

    /// Runs a course and samples it at these steps; `stream` draws what differs from log to log.
    #[must_use]
    pub fn run(
        &self,
        course: &Course,
        schedule: &[usize],
        mut disturbance: Disturbance,
        stream: &mut Stream,
    ) -> CleanLog {
        let rig = self.rig;
        let h = 1.0 / STEPS_PER_S;
        let period = h * STEPS_PER_CONTROL as f64;
        let steps = (course.duration_s * STEPS_PER_S).round() as usize;
        let mut laws = self.laws.clone();
        laws.begin_log(stream, course.duration_s);

        // Where the disc stands at the start is nothing the encoder knows.
        let start_angle = stream.phase();
        let m2_origin = if stream.chance(0.5) { None } else { Some(stream.uniform(-30.0, 30.0)) };
        let m1_origin = stream.uniform(-0.5, 0.5);
        let encoder = |angle: f64| laws.encoder_eccentricity.map_or(angle, |law| law.angle(angle));
        let origin = encoder(start_angle) - m2_origin.unwrap_or(0.0);
        let eccentricity = laws.encoder_eccentricity;

        let torque_for = |force: f64| (force + rig.preload_n) / rig.lever_gain_n_per_nm;
        let mut m1_command = torque_for(active(&course.load, 0.0).1.at(0.0));
        let mut pressure = Pressure::new(rig, h, m1_command);
        let numbers = DriveNumbers {
            inertia: rig.inertia_kg_m2,
            coulomb: rig.bearing_coulomb_nm,
            viscous: rig.bearing_viscous_nm_s,
            lag_s: rig.m2_lag_s,
            units: Units::ROTARY,
        };
        let mut drive = Drive::new(numbers, &laws, h, start_angle);
        let mut speed_loop =
            SpeedLoop::new(rig.inertia_kg_m2, self.bandwidth_rad_s, rig.rated_torque_nm, period);
        let mut contact = self.contact(h);
        let bridge = rig.friction_bridge.as_ref();
        let mut friction_bridge = match &laws.ring_resonance {
            Some(ring) => BridgeFilter::ringing(bridge, ring, h, 0.0),
            None => BridgeFilter::new(bridge, h, 0.0),
        };
        let mut normal_bridge = BridgeFilter::new(rig.normal_bridge.as_ref(), h, pressure.normal_n());
        let mut friction_delay = laws.friction_delay.map(|law| law.running(h, 0.0));
        let mut surface = laws.thermal_fade.clone().unwrap_or_else(ThermalFade::average);
        let mut shadow = Shadow::new(self, h, pressure.torque_nm());
        let ambient = stream.uniform(20.0, 26.0);

        let mut samples = Vec::with_capacity(schedule.len());
        let mut next_sample = schedule.iter().copied().peekable();
        let mut m2_command = 0.0;
        let mut ran_away = false;
        let mut segment = -1.0;
        for n in 0..=steps {
            let time = n as f64 * h;
            let read_speed =
                drive.motor_speed() * eccentricity.map_or(1.0, |law| law.rate(drive.motor_angle()));
            if n % STEPS_PER_CONTROL == 0 {
                let (start, load) = active(&course.load, time);
                m1_command = torque_for(load.at(time - start)).clamp(0.0, rig.rated_torque_nm);
                let (start, motion) = active(&course.motion, time);
                if start > segment {
                    segment = start;
                    ran_away = false;
                }
                m2_command = match motion {
                    Motion::Speed(shape, slew) => speed_loop.step(shape.at(time - start), slew, read_speed),
                    Motion::Torque(_) if ran_away => speed_loop.step(0.0, 150.0, read_speed),
                    Motion::Torque(shape) => {
                        ran_away = read_speed.abs() > RUNAWAY_RAD_S;
                        let torque = shape.at(time - start).clamp(-rig.rated_torque_nm, rig.rated_torque_nm);
                        speed_loop.follow(torque, read_speed);
                        torque
                    }
                };
            }
            if n % STEPS_PER_CONTROL == 0 {
                disturbance.push(pressure.normal_n(), drive.load_speed() * rig.friction_radius_m);
            }
            pressure.step(m1_command, &mut laws, drive.load_angle(), disturbance.kick_n());
            let slide = Slide {
                step_s: h,
                time_s: time,
                tip_speed_m_s: contact.tip_speed_m_s(),
                root_speed_m_s: drive.load_speed() * rig.friction_radius_m,
                normal_n: pressure.normal_n(),
                force_n: contact.force_n(),
                disc_angle_rad: drive.load_angle(),
            };
            let scale = laws.mu_factor(&slide);
            surface.heat(&slide);
            let touch = Touch { root_speed_m_s: slide.root_speed_m_s, normal_n: slide.normal_n, scale };
            let torque = rig.friction_radius_m * contact.step(&touch);
            shadow.scaled(torque, scale);
            drive.step(m2_command, torque, slide.normal_n);

            // Sensors, from the parts to the converter.
            let mut normal = slide.normal_n;
            if let Some(law) = &mut laws.bridge_creep {
                normal = law.read(normal, h);
            }
            let mut normal = normal_bridge.step(normal);
            let strain = torque + laws.bridge_crosstalk.as_ref().map_or(0.0, |law| law.at(slide.normal_n));
            let mut friction = friction_bridge.step(strain);
            if let Some(law) = &laws.bridge_drift {
                let drifted = law.at(time);
                match law.what() {
                    Drifting::FrictionZero => friction += drifted,
                    Drifting::FrictionGain => friction *= 1.0 + drifted,
                    Drifting::NormalZero => normal += drifted,
                    Drifting::NormalGain => normal *= 1.0 + drifted,
                }
            }
            if let Some(law) = &laws.loose_plug {
                friction *= law.factor(time);
            }
            if let Some(delay) = &mut friction_delay {
                friction = delay.step(friction);
            }
            if let Some(law) = &laws.mains_hum {
                friction += law.at(time);
            }
            let mut m1_torque = pressure.torque_nm();
            if let Some(gain) = laws.monitor_speed_gain {
                m1_torque *= 1.0 + gain * drive.motor_speed().abs();
            }
            let read_speed =
                drive.motor_speed() * eccentricity.map_or(1.0, |law| law.rate(drive.motor_angle()));
            let read = Read {
                m1_torque_nm: m1_torque,
                m2_torque_nm: drive.reported_torque(),
                speed_rad_s: read_speed,
                normal_n: normal,
                friction_nm: friction,
            };
            shadow.step(&read, &drive);
            if next_sample.next_if_eq(&n).is_some() {
                let (friction_hum, normal_hum) = disturbance.hum(time);
                let angle = eccentricity.map_or(drive.motor_angle(), |law| law.angle(drive.motor_angle()));
                samples.push(Sample {
                    time_s: n as f64 / STEPS_PER_S,
                    m1_torque_ref_nm: m1_command,
                    m1_torque_nm: m1_torque,
                    m1_angle_rad: pressure.angle_rad() + m1_origin,
                    m2_torque_ref_nm: m2_command,
                    m2_torque_nm: read.m2_torque_nm,
                    m2_angle_rad: angle - origin,
                    m2_speed_rad_s: read_speed,
                    normal_force_n: normal + normal_hum,
                    friction_torque_nm: friction + friction_hum,
                    surface_temperature_c: ambient + surface.surface_k(),
                });
                shadow.sample(&read);
            }
        }
        CleanLog { samples, residual: shadow.finish() }
    }
}
