//! Random steps of every model, hashed: the same on the chip and on the PC to the last bit.
//!
//! The excitation comes from integers, so it is exact in f32. Each model gets its own stream of
//! sliding speeds (every size from creep to 3 m/s, both signs) and normal forces (lift-off
//! included). The hash is FNV-1a over the bits of every returned force.

use crate::friction::brush::BrushParameters;
use crate::friction::brush_patch::{BrushPatch, BrushPatchState};
use crate::friction::lugre::{Lugre, LugreParameters, LugreState, Scheme};
use crate::friction::lugre_patch::{
    LugrePatch, ModifiedLugrePatch, ModifiedPatchState, PatchParameters, PatchState,
};
use crate::friction::stribeck::StribeckParameters;
use crate::friction::{Contact, FrictionParameters, ModelKind};

/// Number of models checked: those of the registry, and others.
pub const MODELS: usize = ModelKind::ALL.len() + OTHERS.len();

/// What is checked beside the models of the registry.
const OTHERS: [&str; 4] = ["lugre_backward_euler", "lugre_patch", "modified_patch", "brush_patch"];

/// Names of the models checked, in the order of the hashes.
pub const NAMES: [&str; MODELS] = {
    let mut names = [""; MODELS];
    let mut k = 0;
    while k < MODELS {
        let elements = ModelKind::ALL.len();
        names[k] = if k < elements { ModelKind::ALL[k].name() } else { OTHERS[k - elements] };
        k += 1;
    }
    names
};

/// Random steps of each model that the acceptance asks for.
pub const STEPS: u32 = 10_000;

const STEP_S: f32 = 1e-4;

const BRISTLES: LugreParameters<f32> = LugreParameters {
    sigma0_n_per_m: 1.76e7,
    sigma1_n_s_per_m: 20.0,
    a2_s_per_m: 0.01,
    stribeck: StribeckParameters { a0: 0.5, a1: 0.7, v0_m_s: 0.5, delta: 0.5, theta: 1.0 },
};

/// 64-bit FNV-1a over the bits of f32 values.
struct Hash(u64);

impl Hash {
    const fn new() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }

    fn add(&mut self, value: f32) {
        for byte in value.to_bits().to_le_bytes() {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3);
        }
    }
}

/// xorshift32, whose upper bits become speeds and forces by exact operations.
struct Excitation(u32);

impl Excitation {
    fn bits(&mut self) -> u32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 17;
        self.0 ^= self.0 << 5;
        self.0
    }

    /// The next contact: speed 3·m·2^−k m/s with random sign and k in 0..16, force −8…120 N.
    #[allow(clippy::cast_precision_loss)]
    fn contact(&mut self) -> Contact<f32> {
        let a = self.bits();
        let mantissa = (a >> 16) as f32 * (3.0 / 65536.0);
        let scale = 1.0 / (1u32 << (a & 15)) as f32;
        let sign = if a & 16 == 0 { 1.0 } else { -1.0 };
        let force = (self.bits() >> 16) as f32 * (128.0 / 65536.0) - 8.0;
        Contact::new(sign * mantissa * scale, force)
    }
}

fn hash(steps: u32, seed: u32, mut step: impl FnMut(&Contact<f32>) -> f32) -> u64 {
    let mut excitation = Excitation(seed);
    let mut hash = Hash::new();
    let mut contact = Contact::new(0.0, 0.0);
    for k in 0..steps {
        // Held for eight steps: otherwise no model would ever settle.
        if k & 7 == 0 {
            contact = excitation.contact();
        }
        hash.add(step(&contact));
    }
    hash.0
}

fn element(kind: ModelKind, steps: u32, seed: u32) -> u64 {
    let typical = FrictionParameters::<f32>::typical(kind);
    // Damping and viscous friction, which the assumed rubber has not, are worth checking too.
    let parameters = typical.with("sigma1_n_s_per_m", 20.0).with("a2_s_per_m", 0.01);
    let Ok(model) = parameters.model(STEP_S) else { return 0 };
    let mut state = model.rest();
    hash(steps, seed, |contact| model.step(&mut state, contact).force_n)
}

/// One hash per model of [`NAMES`]; 0 stands for a model that could not be built.
pub fn run(steps: u32) -> [u64; MODELS] {
    core::array::from_fn(|model| run_model(model, steps))
}

/// The hash of one model of [`NAMES`] by its index, so that the chip can work in pieces; 0 stands for a
/// model that could not be built or is not there.
pub fn run_model(model: usize, steps: u32) -> u64 {
    let brush = BrushParameters { c_n_per_m: 3e4, mu_s: 1.2, mu_c: 0.8 };
    let seed = model as u32 + 1;
    if let Some(kind) = ModelKind::ALL.get(model) {
        return element(*kind, steps, seed);
    }
    match model - ModelKind::ALL.len() {
        0 => Lugre::new(&BRISTLES, STEP_S).map_or(0, |model| {
            let model = model.with_scheme(Scheme::BackwardEuler);
            let mut state = LugreState::default();
            hash(steps, seed, |contact| model.step(&mut state, contact).force_n)
        }),
        1 => {
            let patch = PatchParameters {
                sigma0_per_m: 2e3,
                a2_s_per_m: 0.01,
                stribeck: BRISTLES.stribeck,
                length_m: 0.01,
                largest_transport_speed_m_s: 3.0,
            };
            LugrePatch::<f32, 20>::new(&patch, STEP_S).map_or(0, |model| {
                let mut state = PatchState::default();
                hash(steps, seed, |contact| model.step(&mut state, contact, contact.sliding_speed_m_s))
            })
        }
        2 => ModifiedLugrePatch::<f32, 20>::new(&BRISTLES, 0.01, 3.0, STEP_S).map_or(0, |model| {
            let mut state = ModifiedPatchState::default();
            hash(steps, seed, |contact| model.step(&mut state, contact, contact.sliding_speed_m_s))
        }),
        3 => BrushPatch::<f32, 20>::new(&brush, 0.01, 3.0, STEP_S).map_or(0, |model| {
            let mut state = BrushPatchState::default();
            hash(steps, seed, |contact| model.step(&mut state, contact, contact.sliding_speed_m_s))
        }),
        _ => 0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_model_is_built_and_its_hash_depends_on_every_step() {
        let whole = run(STEPS);
        let short = run(STEPS - 1);
        for ((name, a), b) in NAMES.iter().zip(whole).zip(short) {
            assert!(a != 0 && a != b, "{name}");
        }
        assert_eq!(whole, run(STEPS));
    }
}
