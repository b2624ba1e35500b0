//! Friction torque from motion and load.
//!
//! Between two samples speed and load follow a cubic with the slopes of the parabolas through
//! neighbouring samples: a stick phase integrates the speed, and straight lines would let it drift.
//! An interval is cut into steps so short that over one of them neither g(v) nor the load changes by
//! more than a small part and that the block of a series element, c_u/k_u, is resolved. Over such a
//! step the model takes the mean speed and the load at the end. A bridge follows at the same steps.
//! Left out: how the sampled signals went between the samples.

use model_core::friction::stribeck::Stribeck;
use model_core::friction::{Contact, FrictionModel, FrictionState};

use super::bridge::BridgeModel;
use super::curve::Curve;
use super::extended;
use super::inputs::ContactInputs;
use crate::files::model_file::{ModelFile, SOME_STEP_S};
use crate::files::rig_file::{Bridge, RigFile};
use crate::input_error::InputError;

/// Largest change of g(v), relative, over a step.
const CHANGE_OF_G: f64 = 2e-3;
/// Largest change of the load, relative, over a step.
const CHANGE_OF_LOAD: f64 = 1e-2;
/// Longest step where a bridge follows: a tenth of the period of a mode of 400 Hz.
const LONGEST_BRIDGE_STEP_S: f64 = 250e-6;
/// After a turn the bristles of the modified model, stepped in first order, get so many steps for each
/// largest deflection that is slid, …
const STEPS_PER_REACH: f64 = 20.0;
/// … over so many of them: the exponential has then died to e⁻⁸.
const WINDING_REACHES: f64 = 8.0;
/// Most steps in an interval.
const MOST_STEPS: f64 = 512.0;

/// How finely an interval between samples is cut.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Accuracy {
    /// For fits, which run a model thousands of times: a few parts in a thousand.
    Fast,
    /// For one prediction: below one part in a thousand, as far as the samples allow.
    #[default]
    Fine,
}

impl Accuracy {
    /// How much finer than [`CHANGE_OF_G`] and the like.
    fn factor(self) -> f64 {
        match self {
            Self::Fast => 1.0,
            Self::Fine => 8.0,
        }
    }

    /// Steps in the time c_u/k_u of a series element's block, which is stepped in first order.
    fn steps_per_block_time(self) -> f64 {
        match self {
            Self::Fast => 25.0,
            Self::Fine => 800.0,
        }
    }
}

/// Motion and load cut into the steps of a model, ready for any number of runs.
#[derive(Debug, Clone, PartialEq)]
pub struct StepPlan {
    /// Steps in each interval between samples.
    pub(super) counts: Vec<u16>,
    pub(super) steps: Vec<Step>,
}

/// One step of the model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Step {
    pub(super) length_s: f64,
    /// Mean over the step.
    pub(super) speed_m_s: f64,
    /// At its end.
    pub(super) load_n: f64,
    /// Of the disc, at its end.
    pub(super) angle_rad: f64,
}

impl StepPlan {
    /// The plan for a model (or for all of its kind with similar parameters), a bridge and inputs.
    pub fn new(
        model: &FrictionModel<f64>,
        bridge: &Bridge,
        inputs: &ContactInputs,
        accuracy: Accuracy,
    ) -> Self {
        let counts = counts(model, bridge, inputs, accuracy);
        let mut steps = Vec::with_capacity(counts.iter().map(|count| usize::from(*count)).sum());
        let speed = Curve::new(&inputs.time_s, &inputs.sliding_speed_m_s);
        let load = Curve::new(&inputs.time_s, &inputs.normal_force_n);
        for (i, count) in counts.iter().enumerate() {
            let (parts, span_s) = (f64::from(*count), inputs.time_s[i + 1] - inputs.time_s[i]);
            let (speed, load) = (speed.piece(i), load.piece(i));
            let (angle, next) = (inputs.disc_angle_rad[i], inputs.disc_angle_rad[i + 1]);
            let mut covered = 0.0;
            for part in 1..=*count {
                let end = f64::from(part) / parts;
                let area = speed.area(end);
                steps.push(Step {
                    length_s: span_s / parts,
                    speed_m_s: (area - covered) * parts,
                    load_n: load.at(end),
                    angle_rad: angle + end * (next - angle),
                });
                covered = area;
            }
        }
        Self { counts, steps }
    }

    /// Steps in all.
    pub fn steps(&self) -> usize {
        self.steps.len()
    }
}

/// Steps in each interval.
fn counts(
    model: &FrictionModel<f64>,
    bridge: &Bridge,
    inputs: &ContactInputs,
    accuracy: Accuracy,
) -> Vec<u16> {
    let stribeck = model.stribeck();
    let bridge_s = if bridge.is_ideal() { f64::INFINITY } else { LONGEST_BRIDGE_STEP_S };
    let block_s = model.block_time_s().map_or(f64::INFINITY, |t| t / accuracy.steps_per_block_time());
    let longest_s = bridge_s.min(block_s);
    let coefficients: Vec<f64> = match stribeck {
        Some(stribeck) => inputs.sliding_speed_m_s.iter().map(|v| stribeck.coefficient(*v)).collect(),
        None => vec![1.0; inputs.len()],
    };
    let largest = stribeck.map_or(1.0, Stribeck::largest);
    let mut turned = SinceTurn::default();
    let counts = (1..inputs.len()).map(|i| {
        let step_s = inputs.time_s[i] - inputs.time_s[i - 1];
        let (v0, v1) = (inputs.sliding_speed_m_s[i - 1], inputs.sliding_speed_m_s[i]);
        let (g0, g1) = (coefficients[i - 1], coefficients[i]);
        // Through standstill g rises to its largest value on the way.
        let change = if v0 * v1 < 0.0 { 2.0 * largest - g0 - g1 } else { (g0 - g1).abs() };
        let (n0, n1) = (inputs.normal_force_n[i - 1], inputs.normal_force_n[i]);
        let load = if n0 > 0.0 && n1 > 0.0 { (n1 - n0).abs() / n0.min(n1) } else { 0.0 };
        let bristles = model.winding_reach_m(n1).map_or(0.0, |reach_m| turned.steps(v0, v1, step_s, reach_m));
        let finer = (change / (g0.min(g1) * CHANGE_OF_G)).max(load / CHANGE_OF_LOAD).max(bristles);
        (step_s / longest_s).max(finer * accuracy.factor()).ceil().clamp(1.0, MOST_STEPS) as u16
    });
    counts.collect()
}

/// Distance slid since the sliding direction changed.
#[derive(Default)]
struct SinceTurn {
    direction: f64,
    distance_m: f64,
}

impl SinceTurn {
    /// Steps that resolve how bristles of this reach are wound up after a turn.
    fn steps(&mut self, v0: f64, v1: f64, step_s: f64, reach_m: f64) -> f64 {
        let direction = if v1 == 0.0 { 0.0 } else { v1.signum() };
        if direction != self.direction || direction == 0.0 {
            *self = Self { direction, distance_m: 0.0 };
        }
        let slid_m = step_s * v0.abs().max(v1.abs());
        let winding = self.distance_m < WINDING_REACHES * reach_m;
        self.distance_m += slid_m;
        if winding && reach_m > 0.0 { slid_m / reach_m * STEPS_PER_REACH } else { 0.0 }
    }
}

/// Friction torque (N·m) as the rig's friction bridge shows it, at each sample of the inputs, with the
/// effects that extend the model.
pub fn simulate_friction(
    model: &ModelFile,
    rig: &RigFile,
    inputs: &ContactInputs,
) -> Result<Vec<f64>, InputError> {
    simulate_friction_as(model, rig, inputs, Accuracy::Fine)
}

/// As [`simulate_friction`], as fine as asked for.
pub fn simulate_friction_as(
    model: &ModelFile,
    rig: &RigFile,
    inputs: &ContactInputs,
    accuracy: Accuracy,
) -> Result<Vec<f64>, InputError> {
    let element = model.friction_model(SOME_STEP_S)?;
    let plan = StepPlan::new(&element, &rig.friction_bridge, inputs, accuracy);
    if extended::acts_on_friction(model) {
        extended::simulate(model, rig, inputs, &plan)
    } else {
        simulate_planned(model, rig, inputs, &plan)
    }
}

/// As [`simulate_friction`], without effects, with a plan made before: for many runs with changing
/// parameters, and so that the result is smooth in them.
pub fn simulate_planned(
    model: &ModelFile,
    rig: &RigFile,
    inputs: &ContactInputs,
    plan: &StepPlan,
) -> Result<Vec<f64>, InputError> {
    let mut element = model.friction_model(SOME_STEP_S)?;
    let mut state = start(&element, inputs);
    let mut last_step_s = 0.0;
    let mut torques_nm = drive_contact(inputs, plan, &rig.friction_bridge, |step_s, contact| {
        if step_s != last_step_s {
            element.set_step_s(step_s);
            last_step_s = step_s;
        }
        element.step(&mut state, contact).force_n
    });
    torques_nm.iter_mut().for_each(|force_n| *force_n *= rig.friction_radius_m);
    Ok(torques_nm)
}

/// The state that carries the first measured friction, as far as the model can carry it.
fn start(element: &FrictionModel<f64>, inputs: &ContactInputs) -> FrictionState<f64> {
    match (inputs.sliding_speed_m_s.first(), inputs.normal_force_n.first()) {
        (Some(v), Some(n)) => element.holding(inputs.initial_friction_n, &Contact::new(*v, *n)),
        _ => element.rest(),
    }
}

/// Friction force (N) behind a bridge at each sample, by any law: `law(step_s, contact)` moves on by one
/// step and returns the force at its end. The first sample shows the initial friction.
pub fn drive_contact(
    inputs: &ContactInputs,
    plan: &StepPlan,
    bridge: &Bridge,
    mut law: impl FnMut(f64, &Contact<f64>) -> f64,
) -> Vec<f64> {
    let mut bridge_model = BridgeModel::new(bridge, inputs.initial_friction_n);
    let ideal = bridge.is_ideal();
    let mut forces_n = Vec::with_capacity(inputs.len());
    if !inputs.is_empty() {
        forces_n.push(inputs.initial_friction_n);
    }
    let mut steps = plan.steps.iter();
    for count in &plan.counts {
        let mut shown = 0.0;
        for step in steps.by_ref().take(usize::from(*count)) {
            let force_n = law(step.length_s, &Contact::new(step.speed_m_s, step.load_n));
            shown = if ideal { force_n } else { bridge_model.step(step.length_s, force_n) };
        }
        forces_n.push(shown);
    }
    forces_n
}
