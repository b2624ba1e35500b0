//! A channel that runs out of range (`adc_saturation`), x its signal, L its limit. The amplifier clips and the
//! noise comes after it, so that clipped samples are not equal; the converter's own clipping is the exception.
//!
//! - rails: clamp(x, −L, L) in the amplifier (W. Kester, *The Data Conversion Handbook*, 2005);
//! - converter: the same after the noise, so that clipped samples are equal (ibid.);
//! - one rail: only the side that is used more, as a zero that is not in the middle does;
//! - soft: x/(1 + |x/L|^2p)^(1/2p), p from 5 to 10 (C. Rapp, Proc. 2nd European Conf. on Satellite Communications,
//!   1991);
//! - reserved, recovery: rails, and the amplifier leaves them late: what clipping held back decays over some
//!   milliseconds (overdrive recovery, Kester 2005).

use serde::Serialize;

use crate::laws::family::LawFamily;
use crate::random::Stream;

/// Channel that clips.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Clipped {
    /// Friction torque, both signs.
    Friction,
    /// Normal force, from above.
    Normal,
}

/// How it clips.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(tag = "law", rename_all = "snake_case")]
pub enum Edge {
    /// Amplifier, both sides.
    Rails,
    /// After the noise, both sides.
    Converter,
    /// Amplifier, one side.
    OneRail,
    /// Amplifier that bends.
    Soft {
        /// p.
        power: f64,
    },
    /// Amplifier that leaves its rails late.
    Recovery {
        /// Time.
        time_s: f64,
    },
}

/// A channel that is out of range above the level which this share of the samples stays below.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Saturation {
    /// Channel.
    pub channel: Clipped,
    /// How.
    #[serde(flatten)]
    pub edge: Edge,
    /// Share of the samples, by size, that are read right.
    pub unclipped_share: f64,
}

impl Saturation {
    /// Draws one.
    pub fn draw(s: &mut Stream, family: LawFamily) -> Self {
        let channel = s.pick(&[Clipped::Friction, Clipped::Friction, Clipped::Normal]);
        let unclipped_share = s.uniform(0.68, 0.9);
        let edge = match family.pick(s, &[0, 1, 2, 3], 4) {
            0 => Edge::Rails,
            1 => Edge::Converter,
            2 => Edge::OneRail,
            3 => Edge::Soft { power: s.uniform(5.0, 10.0) },
            _ => Edge::Recovery { time_s: s.uniform(2e-3, 6e-3) },
        };
        Self { channel, edge, unclipped_share }
    }
}
