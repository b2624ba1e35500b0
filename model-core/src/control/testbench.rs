//! A small rig for the tests of the core: enough of the mechanics to close the loops, in `f64`, with the core's
//! own series model as the contact. The real plant is host-sim's; this one shares no code with it.

use super::*;
use crate::friction::Contact;
use crate::friction::lugre::LugreParameters;
use crate::friction::series::{Series, SeriesParameters, SeriesState};
use crate::friction::stribeck::StribeckParameters;
use std::boxed::Box;
use std::f64::consts::TAU;
use std::vec::Vec;

const TICK_S: f64 = 1e-4;
const SUBSTEPS: usize = 5;
const DT: f64 = TICK_S / SUBSTEPS as f64;

/// Mechanics and sensors.
pub(super) struct Rig {
    pub(super) m1_torque_nm: f64,
    pub(super) m2_torque_nm: f64,
    commands_nm: [f64; 2],
    pub(super) speed_rad_s: f64,
    pub(super) angle_rad: f64,
    pub(super) force_n: f64,
    force_rate: f64,
    contact: Series<f64>,
    contact_state: SeriesState<f64>,
    pub(super) friction_nm: f64,
    amplifier_nm: f64,
    amplifier_n: f64,
    /// Torque that acts on the disc besides, against a positive speed.
    pub(super) load_nm: f64,
}

/// What a test changes in the samples.
pub(super) type Tamper = Box<dyn FnMut(&mut Samples)>;

/// The rig with the core in closed loop.
pub(super) struct Bench {
    pub(super) config: ControlConfig,
    pub(super) state: ControlState,
    pub(super) rig: Rig,
    pub(super) arm_switch: bool,
    /// The motors, their encoders and the friction bridge are wired the other way round.
    pub(super) mirrored: bool,
    pub(super) tamper: Option<Tamper>,
    /// True speed beside each record.
    pub(super) speeds_rad_s: Vec<f64>,
    pub(super) records: Vec<Record>,
    pub(super) events: Vec<Event>,
}

impl Rig {
    fn new() -> Self {
        let stribeck = StribeckParameters { a0: 0.5, a1: 0.7, v0_m_s: 0.5, delta: 0.5, theta: 1.0 };
        let bristles =
            LugreParameters { sigma0_n_per_m: 1.76e7, sigma1_n_s_per_m: 0.0, a2_s_per_m: 0.0, stribeck };
        let p = SeriesParameters { k_u_n_per_m: 3e4, c_u_n_s_per_m: 160.0, bristles };
        Self {
            m1_torque_nm: 0.0,
            m2_torque_nm: 0.0,
            commands_nm: [0.0; 2],
            speed_rad_s: 0.0,
            angle_rad: 0.0,
            force_n: 0.0,
            force_rate: 0.0,
            contact: Series::new(&p, DT).unwrap(),
            contact_state: SeriesState::default(),
            friction_nm: 0.0,
            amplifier_nm: 0.0,
            amplifier_n: 0.0,
            load_nm: 0.0,
        }
    }

    fn step(&mut self, outputs: &Outputs) {
        for _ in 0..SUBSTEPS {
            let keep = (-DT / 1e-3_f64).exp();
            self.m1_torque_nm = keep * self.m1_torque_nm + (1.0 - keep) * self.commands_nm[0];
            self.m2_torque_nm = keep * self.m2_torque_nm + (1.0 - keep) * self.commands_nm[1];
            let omega = TAU * 120.0;
            let target = 30.0 * self.m1_torque_nm - 8.0;
            self.force_rate += DT * (omega * omega * (target - self.force_n) - 0.5 * omega * self.force_rate);
            self.force_n += DT * self.force_rate;
            let contact = Contact::new(0.06 * self.speed_rad_s, self.force_n.max(0.0));
            self.friction_nm = 0.06 * self.contact.step(&mut self.contact_state, &contact).force_n;
            let driving = self.m2_torque_nm - self.friction_nm - self.load_nm - 0.005 * self.speed_rad_s;
            // Coulomb friction holds what it can.
            let free = self.speed_rad_s + DT * driving / 0.02;
            let coulomb = DT * 0.15 / 0.02;
            self.speed_rad_s = if free.abs() <= coulomb { 0.0 } else { free - coulomb.copysign(free) };
            self.angle_rad += DT * self.speed_rad_s;
            let amplifier = 1.0 - (-DT * TAU * 1000.0).exp();
            self.amplifier_nm += amplifier * (self.friction_nm - self.amplifier_nm);
            self.amplifier_n += amplifier * (self.force_n.max(0.0) - self.amplifier_n);
        }
        for (i, command) in self.commands_nm.iter_mut().enumerate() {
            *command =
                if outputs.drive_enable[i] { (f64::from(outputs.dac[i]) - 2048.0) / 256.0 } else { 0.0 };
        }
    }

    fn samples(&self, arm_switch: bool) -> Samples {
        let code = |value: f64, low: f64, high: f64| ((value - low) / (high - low) * 65536.0) as u16;
        let counts = |angle: f64| (angle * 480_000.0 / TAU).floor() as i64 as u32;
        Samples {
            m1_count: counts(self.force_n / 3000.0),
            m2_count: counts(self.angle_rad),
            adc: AdcScan {
                friction_bridge: code(self.amplifier_nm, -12.0, 12.0),
                normal_bridge: code(self.amplifier_n, -20.0, 220.0),
                m1_torque: code(self.m1_torque_nm, -10.0, 10.0),
                m2_torque: code(self.m2_torque_nm, -10.0, 10.0),
                supply: code(24.0, 0.0, 36.3),
            },
            adc_fresh: true,
            arm_switch,
            link_heard: true,
            ..Samples::default()
        }
    }
}

impl Bench {
    pub(super) fn new() -> Self {
        Self::with(&ControlSettings::default())
    }

    pub(super) fn with(settings: &ControlSettings) -> Self {
        let config = settings.build().unwrap();
        let state = ControlState::new(&config);
        Self {
            config,
            state,
            rig: Rig::new(),
            arm_switch: false,
            mirrored: false,
            tamper: None,
            speeds_rad_s: Vec::new(),
            records: Vec::new(),
            events: Vec::new(),
        }
    }

    /// Codes of noise, where frozen inputs are watched for: this rig's sensors are else as quiet as frozen ones.
    fn add_noise(&self, scan: &mut AdcScan) {
        let noise = (self.records.len() % 3) as u16;
        for code in [
            &mut scan.friction_bridge,
            &mut scan.normal_bridge,
            &mut scan.m1_torque,
            &mut scan.m2_torque,
            &mut scan.supply,
        ] {
            *code += noise;
        }
    }

    /// Runs for a time and gives the last outputs.
    pub(super) fn run(&mut self, seconds: f64) -> Outputs {
        let mut last = None;
        for _ in 0..(seconds / TICK_S).round() as usize {
            last = Some(self.tick());
        }
        last.unwrap()
    }

    pub(super) fn tick(&mut self) -> Outputs {
        let mut samples = self.rig.samples(self.arm_switch);
        if self.mirrored {
            samples.m1_count = samples.m1_count.wrapping_neg();
            samples.m2_count = samples.m2_count.wrapping_neg();
            for code in
                [&mut samples.adc.m1_torque, &mut samples.adc.m2_torque, &mut samples.adc.friction_bridge]
            {
                *code = 0_u16.wrapping_sub(*code);
            }
        }
        if self.config.settings.timing.adc_frozen_ticks > 0 {
            self.add_noise(&mut samples.adc);
        }
        if let Some(tamper) = &mut self.tamper {
            tamper(&mut samples);
        }
        let outputs = step(&self.config, &mut self.state, &samples);
        let mut wired = outputs;
        if self.mirrored {
            wired.dac = outputs.dac.map(|code| 4096 - code);
        }
        self.speeds_rad_s.push(self.rig.speed_rad_s);
        self.records.push(outputs.record);
        self.rig.step(&wired);
        while let Some(event) = self.state.pop_event() {
            self.events.push(event);
        }
        outputs
    }

    pub(super) fn apply(&mut self, command: Command<'_>) -> Result<(), Refused> {
        apply(&mut self.config, &mut self.state, command)
    }

    /// Through the self-check to `Armed`.
    pub(super) fn armed(mut self) -> Self {
        self.run(0.11);
        self.arm_switch = true;
        self.run(0.01);
        self.apply(Command::Arm).unwrap();
        self.tick();
        assert_eq!(self.state.mode(), Mode::Armed);
        self
    }

    /// To `Running` with this experiment.
    pub(super) fn running(self, experiment: &Experiment) -> Self {
        let mut bench = self.armed();
        let prepared = experiment.prepare(&bench.config).unwrap();
        bench.apply(Command::LoadExperiment(&prepared)).unwrap();
        bench.apply(Command::Start).unwrap();
        bench.records.clear();
        bench.speeds_rad_s.clear();
        bench
    }
}

/// An experiment from lists of (start in seconds, mode, shape).
pub(super) fn experiment(m1: &[(f64, Shape)], m2: &[(f64, M2Mode, Shape)], seconds: f64) -> Experiment {
    let tick = |s: f64| (s / TICK_S).round() as u32;
    Experiment {
        m1: m1
            .iter()
            .map(|&(s, shape)| Segment { start_tick: tick(s), mode: M1Mode::Torque, shape })
            .collect(),
        m2: m2.iter().map(|&(s, mode, shape)| Segment { start_tick: tick(s), mode, shape }).collect(),
        duration_ticks: tick(seconds),
    }
}

/// M1 at a torque, M2 at a speed or a torque, both from the start.
pub(super) fn steady(m1_nm: f64, mode: M2Mode, m2: f64, seconds: f64) -> Experiment {
    experiment(&[(0.0, hold(m1_nm))], &[(0.0, mode, hold(m2))], seconds)
}

/// A constant.
pub(super) fn hold(value: f64) -> Shape {
    Shape::Constant { value: value as f32 }
}

/// Figs. 18–21: 5.5 % of the rated torque, speed step at 3.5 s, 40 % at 4 s; here with all times less 3 s.
pub(super) fn friction_step(rpm: f64) -> Experiment {
    let m1 = [(0.0, hold(0.055 * 8.0)), (1.0, hold(0.4 * 8.0))];
    let m2 = [(0.0, M2Mode::Speed, hold(0.0)), (0.5, M2Mode::Speed, hold(rpm * TAU / 60.0))];
    experiment(&m1, &m2, 2.5)
}
