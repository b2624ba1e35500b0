//! The rig behind the control core, in `f64`: drives, normal-load actuator, disc, rubber elements, sensors.
//!
//! One [`Plant::step`] covers one control period. The linear parts (drive lags, normal force, torque ring and
//! amplifiers) are discretised exactly once. Disc and elements are coupled by a velocity Verlet step: half a
//! kick, one step of the friction model at the speed of the middle, half a kick. That is second order in the
//! coupling and asks for one friction evaluation a sub-step. The fastest coupled motion of the assumed rig (block
//! against disc) is 73 rad/s, so one sub-step of 100 µs is enough where nothing happens; load steps, breaking
//! loose and sticking again get sixteen, and stiffer parts get more by themselves (`step`).
//!
//! What the controller sees ([`PlantOutput`]) is quantised and noisy; the truth stands beside it. The period of
//! delay between the controller's output and the drives belongs to the caller: drive the plant over a period
//! with the codes that were written before that period began.
//!
//! Signs: a positive speed of M2 slides the road forward under the elements, and the friction torque that
//! resists it is positive; the normal force presses where positive.

mod analogue;
mod bridge;
mod disc;
mod effects;
mod elements;
mod encoder;
mod from_files;
mod hands;
mod linear;
mod noise;
mod normal_load;
pub mod parameters;
mod step;
pub mod two_motor_file;
pub mod two_motors;

pub use analogue::PinVoltages;
pub use effects::left_out;
pub use elements::{ElementModel, ElementParameters, ElementState};
pub use encoder::Edge;
pub use hands::Hands;
pub use parameters::PlantParameters;

use analogue::{Analogue, Quantities};
use disc::Disc;
use encoder::{Encoder, Sweep};
use model_core::control::{AdcScan, DAC_ZERO};
use model_core::error::ParameterError;
use noise::Noise;
use step::{Activity, Grid, State};

/// The control period.
pub const PERIOD_S: f64 = 1e-4;
/// Control periods of a second.
pub const PERIODS_PER_S: usize = 10_000;
const _: () = assert!((PERIODS_PER_S as f64 * PERIOD_S - 1.0).abs() < 1e-12);

/// Time of a control period, s: dividing by a whole number gives the nearest f64 to the decimal time.
#[must_use]
pub fn time_s(period: usize) -> f64 {
    period as f64 / PERIODS_PER_S as f64
}

/// What drives the plant over one control period.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PlantInput {
    /// Torque references of M1 and M2 as 12 bit codes around mid-scale.
    pub dac: [u16; 2],
    /// Drive enables of M1 and M2; a disabled drive makes no torque.
    pub drive_enable: [bool; 2],
}

impl PlantInput {
    /// Both drives off.
    pub const OFF: Self = Self { dac: [DAC_ZERO; 2], drive_enable: [false; 2] };
}

/// What the controller can read at the end of the period, and the truth beside it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlantOutput {
    /// Quadrature counters of M1 and M2; they wrap.
    pub counts: [u32; 2],
    /// Voltages at the analogue inputs.
    pub pins: PinVoltages,
    /// The same as the converter gives them.
    pub codes: AdcScan,
    /// What really is.
    pub truth: Truth,
}

/// The true state of the rig at one instant.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Truth {
    /// Torque of M1.
    pub m1_torque_nm: f64,
    /// Angle of M1.
    pub m1_angle_rad: f64,
    /// Torque of M2.
    pub m2_torque_nm: f64,
    /// Angle of M2, where its encoder sits.
    pub m2_angle_rad: f64,
    /// Speed of M2.
    pub m2_speed_rad_s: f64,
    /// Angle of the disc; that of M2 where the shaft is rigid.
    pub disc_angle_rad: f64,
    /// Speed of the disc.
    pub disc_speed_rad_s: f64,
    /// Sliding speed of the elements' roots, mean over the last sub-step.
    pub sliding_speed_m_s: f64,
    /// Normal force of all elements.
    pub normal_force_n: f64,
    /// Friction torque of all elements.
    pub friction_torque_nm: f64,
    /// Torque of the bearing.
    pub bearing_torque_nm: f64,
    /// Deformation of the first element: of its block, or of its bristles where it has no block.
    pub deformation_m: f64,
}

/// The plant.
#[derive(Debug, Clone)]
pub struct Plant {
    radius_m: f64,
    nm_per_code: [f64; 2],
    disc: Disc,
    calm: Grid,
    busy: Grid,
    encoder: Encoder,
    analogue: Analogue,
    state: State,
    activity: Activity,
    sweeps: Option<Vec<[Sweep; 2]>>,
    noise: Noise,
    hands: Hands,
}

impl Plant {
    /// Builds the plant at rest, with the elements lifted off.
    ///
    /// # Errors
    /// The first parameter out of range.
    pub fn new(p: &PlantParameters, seed: u64) -> Result<Self, ParameterError> {
        p.check()?;
        let least = least_substeps(p);
        let calm = Grid::new(p, p.substeps.calm.max(least))?;
        Ok(Self {
            radius_m: p.geometry.friction_radius_m,
            nm_per_code: [p.m1.rated_torque_nm, p.m2.rated_torque_nm].map(|t| t / f64::from(DAC_ZERO)),
            disc: Disc::new(p.total_inertia_kg_m2(), &p.bearing, p.shaft),
            busy: Grid::new(p, p.substeps.busy.max(p.substeps.calm).max(least))?,
            encoder: Encoder::new(p.counts_per_rev),
            analogue: Analogue::new(&p.analogue, &p.noise),
            state: calm.rest(),
            calm,
            activity: Activity::default(),
            sweeps: None,
            noise: Noise::new(seed),
            hands: Hands::default(),
        })
    }

    /// Keeps the motion inside each period, for [`Self::edges`].
    #[must_use]
    pub fn with_edges(mut self) -> Self {
        self.sweeps = Some(Vec::with_capacity(self.busy.substeps as usize));
        self
    }

    /// What a person does by hand.
    pub fn hands(&mut self) -> &mut Hands {
        &mut self.hands
    }

    /// A hand turns the disc by an angle from now on, and lets go.
    pub fn turn_by_hand(&mut self, by_rad: f64) {
        self.hands.turn(self.state.disc.angle_rad, by_rad);
    }

    /// Advances the plant by one control period and samples it at its end.
    pub fn step(&mut self, input: &PlantInput) -> PlantOutput {
        let [m1_nm, m2_nm] = core::array::from_fn(|k| {
            let codes = f64::from(input.dac[k]) - f64::from(DAC_ZERO);
            if input.drive_enable[k] { codes * self.nm_per_code[k] } else { 0.0 }
        });
        self.advance(m1_nm, m2_nm);
        self.sample()
    }

    /// Advances the plant by one control period with torque commands in N·m, without sampling it.
    pub fn advance(&mut self, m1_command_nm: f64, m2_command_nm: f64) {
        let commands = [m1_command_nm, m2_command_nm];
        let disc_nm = self.hands.disc_nm(self.state.disc.angle_rad, self.state.disc.speed_rad_s);
        // By reference: a grid holds two prepared models, and copying it each period costs more than a calm step.
        let busy = self.activity.is_busy(&self.state, commands);
        let substeps = if busy { self.busy.substeps } else { self.calm.substeps };
        if let Some(sweeps) = &mut self.sweeps {
            sweeps.clear();
        }
        for k in 0..substeps {
            let from = self.sweeps.is_some().then(|| self.positions());
            let grid = if busy { &self.busy } else { &self.calm };
            grid.advance(&self.disc, self.radius_m, &mut self.state, commands, (&self.hands, disc_nm));
            if let Some(from) = from {
                let to = self.positions();
                let start_s = f64::from(k) * grid.step_s;
                let sweep = core::array::from_fn(|i| Sweep {
                    start_s,
                    duration_s: grid.step_s,
                    angle_rad: from[i].0,
                    speed_rad_s: from[i].1,
                    end_angle_rad: to[i].0,
                });
                self.sweeps.iter_mut().for_each(|s| s.push(sweep));
            }
        }
    }

    /// Samples all inputs of the controller now. Each call draws new noise.
    pub fn sample(&mut self) -> PlantOutput {
        let s = &self.state;
        let pins = self.analogue.pins(
            &Quantities {
                friction_nm: s.bridges[0].shown(),
                normal_n: s.bridges[1].shown(),
                m1_torque_nm: s.normal_load.torque_nm(),
                m2_torque_nm: s.m2_torque_nm,
            },
            &mut self.noise,
        );
        let counts = self.positions().map(|(angle, _)| wrap(self.encoder.count(angle)));
        PlantOutput { counts, pins, codes: self.analogue.codes(&pins), truth: self.truth() }
    }

    /// The true state now.
    #[must_use]
    pub fn truth(&self) -> Truth {
        let s = &self.state;
        Truth {
            m1_torque_nm: s.normal_load.torque_nm(),
            m1_angle_rad: self.calm.normal_load.angle_rad(&s.normal_load),
            m2_torque_nm: s.m2_torque_nm,
            m2_angle_rad: s.disc.motor_angle_rad,
            m2_speed_rad_s: s.disc.motor_speed_rad_s,
            disc_angle_rad: s.disc.angle_rad,
            disc_speed_rad_s: s.disc.speed_rad_s,
            sliding_speed_m_s: s.sliding_speed_m_s,
            normal_force_n: s.normal_load.normal_force_n(),
            friction_torque_nm: s.friction_torque_nm,
            bearing_torque_nm: self.disc.bearing().torque_and_slope(s.disc.speed_rad_s).0,
            deformation_m: s.elements.deformation_m(),
        }
    }

    /// Edges of the encoder of M1 (0) or M2 (1) in the last period, in order of time. The plant must have been
    /// built [`Self::with_edges`], else there are none.
    pub fn edges(&self, motor: usize, into: &mut Vec<Edge>) {
        into.clear();
        for sweep in self.sweeps.iter().flatten() {
            self.encoder.edges(&sweep[motor], into);
        }
    }

    fn positions(&self) -> [(f64, f64); 2] {
        let s = &self.state;
        [
            (
                self.calm.normal_load.angle_rad(&s.normal_load),
                self.calm.normal_load.speed_rad_s(&s.normal_load),
            ),
            (s.disc.motor_angle_rad, s.disc.motor_speed_rad_s),
        ]
    }
}

/// A hardware counter of 32 bits.
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
fn wrap(count: i64) -> u32 {
    count as u32
}

/// Sub-steps for which the fastest coupled oscillation keeps below 0.2 rad a sub-step: Verlet is stable to 2, and
/// at 0.2 its period is right to 0.2 %.
fn least_substeps(p: &PlantParameters) -> u32 {
    let radius = p.geometry.friction_radius_m;
    let disc = p.total_inertia_kg_m2() - p.shaft.map_or(0.0, |s| s.motor_inertia_kg_m2);
    let stick = p.elements.sticking_stiffness_n_per_m() * radius * radius / disc;
    let shaft = p.shaft.map_or(0.0, |s| s.stiffness_nm_per_rad * (1.0 / s.motor_inertia_kg_m2 + 1.0 / disc));
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    let needed = ((stick + shaft).sqrt() * PERIOD_S / 0.2).ceil() as u32;
    needed.max(1)
}
