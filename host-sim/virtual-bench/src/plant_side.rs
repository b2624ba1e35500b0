//! host-sim's plant behind the chip's pins.

use crate::driver::PERIOD;
use crate::outside::{DriveInputs, Hand, Motion, PlantSide, Sensors};
use crate::part::Motor;
use crate::part::encoder_timer::Edge;
use host_sim::input_error::InputError;
use host_sim::plant::{self, PinVoltages, Plant, PlantInput, PlantParameters};
use rigless::time::VirtualNanos;

/// What a floating torque reference reads as: the amplifier's input drifts to one end. The worst is assumed,
/// so a drive that is enabled in that state gives its full torque and the run shows it.
const FLOATING: u16 = 4095;

/// The plant with room for a period's edges.
#[derive(Debug, Clone)]
pub struct HostPlant {
    plant: Plant,
    edges: Vec<plant::Edge>,
}

impl HostPlant {
    /// The plant at rest.
    ///
    /// # Errors
    /// The first parameter out of range.
    pub fn new(parameters: &PlantParameters, seed: u64) -> Result<Self, InputError> {
        Ok(Self { plant: Plant::new(parameters, seed)?.with_edges(), edges: Vec::new() })
    }
}

/// The voltages in the order of the scan.
fn sensors(pins: &PinVoltages) -> Sensors {
    let volts =
        [pins.friction_bridge_v, pins.normal_bridge_v, pins.m1_torque_v, pins.m2_torque_v, pins.supply_v];
    // The cast saturates: a negative voltage reads as zero, as the converter's input does.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    Sensors { microvolt: volts.map(|volt| (volt * 1e6).round() as u32) }
}

impl PlantSide for HostPlant {
    fn sensors(&mut self) -> Sensors {
        sensors(&self.plant.sample().pins)
    }

    fn step(&mut self, at: VirtualNanos, inputs: &DriveInputs, edge: &mut dyn FnMut(Motor, Edge)) -> Sensors {
        let input =
            PlantInput { dac: inputs.dac.map(|code| code.unwrap_or(FLOATING)), drive_enable: inputs.enabled };
        let output = self.plant.step(&input);
        for motor in Motor::ALL {
            self.plant.edges(motor as usize, &mut self.edges);
            for plant::Edge { offset_s, count } in self.edges.drain(..) {
                #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
                let offset = ((offset_s * 1e9) as u64).min(PERIOD - 1);
                edge(motor, Edge { at: VirtualNanos(at.0 + offset), count });
            }
        }
        sensors(&output.pins)
    }

    fn touch(&mut self, hand: Hand) {
        match hand {
            Hand::TurnDisc(turns) => self.plant.turn_by_hand(turns * std::f64::consts::TAU),
            Hand::PressM1(torque_nm) => self.plant.hands().m1_nm = torque_nm,
            Hand::LoadFriction(torque_nm) => self.plant.hands().friction_load_nm = torque_nm,
            Hand::LoadNormal(force_n) => self.plant.hands().normal_load_n = force_n,
        }
    }

    fn motion(&self) -> Motion {
        let truth = self.plant.truth();
        Motion {
            torque_nm: [truth.m1_torque_nm, truth.m2_torque_nm],
            disc_angle_rad: truth.disc_angle_rad,
            disc_speed_rad_s: truth.disc_speed_rad_s,
            normal_force_n: truth.normal_force_n,
        }
    }

    fn duplicate(&self) -> Box<dyn PlantSide> {
        Box::new(self.clone())
    }
}
