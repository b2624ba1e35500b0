//! What the firmware asked of the chip that the emulator could not stand in for.
//!
//! Such an access reads a reset value or is lost, and the run would go on as if nothing were wrong. So a run
//! with one fails. The one exception is checked here instead: the limits of the clocks in voltage scale 0.

use crate::board::RigBoard;
use crate::interference;
use crate::part::Part;
use rigless::mcu::Operate;
use rigless::session::Session;
use rigless::soc::stm32h743::generated::syscfg;
use rigless::soc::stm32h743::peripherals::rcc::{Apb, Rcc};

/// The emulator's clock controller knows the limits up to voltage scale 1, and says so at 480 MHz. The part is
/// in scale 0, which the emulator leaves out, if `ODEN` is set (RM0433 section 6.6.2); then these limits hold
/// (DS12110 table 112, revision V).
const BEYOND_SCALE_1: &str = "for the voltage scale in use";
const SCALE_0_CPU_HZ: u64 = 480_000_000;
const SCALE_0_AHB_HZ: u64 = 240_000_000;
const SCALE_0_APB_HZ: u64 = 120_000_000;

/// One line for each gap.
pub fn found(session: &Session<RigBoard>) -> Vec<String> {
    let mut lines = Vec::new();
    let within_scale_0 = within_scale_0(&session.board().part);
    // What the bench itself sends the core to.
    for access in session.unmapped().into_iter().filter(|access| access.address != interference::NOTHING) {
        lines.push(format!(
            "nothing answers at {:#010x} (pc {:#010x})",
            access.address, access.program_counter
        ));
    }
    for (address, fault) in session.refused() {
        lines.push(format!("refused at {address:#010x}: {fault}"));
    }
    for (address, access) in session.unimplemented() {
        lines.push(format!(
            "{}.{} at {address:#010x} has no model: {} reads, {} writes{} (pc {:#010x})",
            access.instance,
            access.register,
            access.reads,
            access.writes,
            access.written.map(|value| format!(", the last {value:#x}")).unwrap_or_default(),
            access.program_counter
        ));
    }
    for (address, access) in session.undefined() {
        lines.push(format!(
            "{} has no register at {address:#010x}: {} reads, {} writes (pc {:#010x})",
            access.instance, access.reads, access.writes, access.program_counter
        ));
    }
    for told in session.told() {
        if !(within_scale_0 && told.reason.ends_with(BEYOND_SCALE_1)) {
            lines.push(format!("{}.{} at {} ns: {}", told.instance, told.register, told.at.0, told.reason));
        }
    }
    for (instance, interrupt) in session.unrouted() {
        lines.push(format!("interrupt {interrupt} of {instance} reaches no line of the core"));
    }
    lines
}

/// Whether the part is in voltage scale 0 with its clocks within that scale's limits.
fn within_scale_0(part: &Part) -> bool {
    let (Some(clocks), Some(system)) = (part.registers("RCC"), part.registers("SYSCFG")) else {
        return false;
    };
    let rcc: &Rcc = &part.soc.rcc;
    let apb = [Apb::One, Apb::Two, Apb::Three, Apb::Four];
    system.get(syscfg::Register::Pwrcr) & 1 != 0
        && rcc.cpu_clock(clocks) <= SCALE_0_CPU_HZ
        && rcc.hclk(clocks) <= SCALE_0_AHB_HZ
        && apb.into_iter().all(|bus| rcc.pclk(clocks, bus) <= SCALE_0_APB_HZ)
}
