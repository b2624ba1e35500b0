//! What lies where, what may be done there, and what is cached: the memory protection unit, ITCM, and the DMA's addresses.

use super::firmware;
use object::{Object, ObjectSymbol};
use rig_link::message::{Answer, Command, CrashKind, ResetCause};
use virtual_bench::bench;
use virtual_bench::campaign::listening_host::ListeningHost;
use virtual_bench::endpoint::Endpoint;
use virtual_bench::error::BenchError;
use virtual_bench::experiment::{Request, boot};
use virtual_bench::outside::Action;
use virtual_bench::probe;

/// ITCM; both TCMs, which DMA1 and DMA2 do not reach.
const ITCM: std::ops::Range<u64> = 0..0x1_0000;
const TCMS: [std::ops::Range<u64>; 2] = [ITCM, 0x2000_0000..0x2002_0000];

/// What the control tick calls in flash: commands, angles no law passes, the end.
const IN_FLASH: [&str; 3] = ["4tick4Tick9carry_out", "9rem_pio2f9rem_pio2f", "9panicking"];

#[test]
fn the_control_tick_lies_in_itcm_with_all_it_calls_each_time() {
    let elf = object::File::parse(firmware().bytes.as_slice()).unwrap();
    assert!(
        firmware().tick_handlers.iter().all(|handler| ITCM.contains(handler)),
        "the handlers lie in flash"
    );
    // The linker makes a veneer for each call that is too far for a branch.
    let far: Vec<&str> = elf
        .symbols()
        .filter(|symbol| ITCM.contains(&symbol.address()))
        .filter_map(|symbol| symbol.name().ok()?.strip_prefix("__Thumbv7ABSLongThunk_"))
        .collect();
    assert!(!far.is_empty(), "the linker names its veneers otherwise");
    let left: Vec<_> = far.iter().filter(|name| !IN_FLASH.iter().any(|cold| name.contains(cold))).collect();
    assert!(
        left.is_empty(),
        "the tick calls these in flash; name them in firmware/memory.x, or here and in itcm.rs if they are rare: {left:#?}"
    );
}

fn on_the_bench<T: Send>(operator: impl FnOnce(&mut Endpoint) -> Result<T, BenchError> + Send) -> T {
    let plant = Request::assumed("fig20").unwrap().plant().unwrap();
    bench::run(firmware(), Box::new(plant), |endpoint| {
        boot(endpoint)?;
        operator(endpoint)
    })
    .unwrap()
    .operator
}

#[test]
fn what_no_memory_is_for_traps() {
    for (what, action, address) in [
        ("a null pointer is read", Action::StrayRead(0x10), 0x10),
        ("a null pointer is written", Action::StrayWrite(0xFFC), 0xFFC),
        ("the tick's code is written", Action::StrayWrite(0x1400), 0x1400),
        ("the program in flash is written", Action::StrayWrite(0x0801_0000), 0x0801_0000),
        ("below the stack is written", Action::StrayWrite(0x1FFF_FFF0), 0x1FFF_FFF0),
        ("SRAM that nothing uses is read", Action::StrayRead(0x3000_0000), 0x3000_0000),
    ] {
        let (hello, record) = on_the_bench(|endpoint| {
            let mut listener = ListeningHost::new();
            endpoint.act(action)?;
            listener.listen(endpoint, endpoint.now_ns() + 200_000_000)?;
            Ok((listener.ask(endpoint, &Command::Hello)?, listener.ask(endpoint, &Command::CrashRecord)?))
        });
        assert!(
            matches!(&hello, Answer::Hello(hello) if hello.reset == ResetCause::Software),
            "{what}: {hello:?}"
        );
        let Answer::CrashRecord(Some(record)) = record else { panic!("{what}: {record:?}") };
        assert_eq!(record.kind, CrashKind::HardFault, "{what}");
        assert!(record.text.contains(&format!("mmfar {address:#010x}")), "{what}: {}", record.text);
    }
}

/// A region of the memory protection unit, by its registers RBAR and RASR (ARMv7-M B3.5.8, B3.5.9).
struct Region {
    base: u64,
    attributes: u64,
}

impl Region {
    fn holds(&self, address: u64) -> bool {
        let size = 2 << (self.attributes >> 1 & 0x1F);
        // Firmware without subregions, so that this is all.
        assert_eq!(self.attributes >> 8 & 0xFF, 0, "subregions");
        self.attributes & 1 != 0 && (self.base & !0x1F..(self.base & !0x1F) + size).contains(&address)
    }

    /// `TEX`, `C` and `B` say normal memory that a cache may hold.
    fn is_cached(&self) -> bool {
        let (tex, cached) = (self.attributes >> 19 & 0b111, self.attributes >> 17 & 1);
        cached != 0 || tex & 0b100 != 0
    }

    fn may_be_written(&self) -> bool {
        matches!(self.attributes >> 24 & 0b111, 0b001..=0b011)
    }

    fn may_run(&self) -> bool {
        self.attributes >> 28 & 1 == 0
    }
}

#[test]
fn nothing_that_a_dma_or_the_core_writes_is_cached_and_nothing_written_runs() {
    /// `S0CR` of DMA1 and DMA2, and the distance of two streams (RM0433 15.5).
    const CONTROLLERS: [(&str, u64); 2] = [("DMA1", 0x4002_0010), ("DMA2", 0x4002_0410)];
    const STREAM: u64 = 0x18;
    let (words, addresses) = on_the_bench(|endpoint| {
        let mut listener = ListeningHost::new();
        // So that the link's sender has sent.
        listener.ask(endpoint, &Command::Hello)?;
        let mut addresses = Vec::new();
        for (name, first) in CONTROLLERS {
            for stream in 0..8 {
                let address = endpoint.register(first + STREAM * stream + 0x0C)?;
                if address != 0 {
                    addresses.push((format!("{name} stream {stream}"), address));
                }
            }
        }
        endpoint.act(Action::ReadMap)?;
        listener.listen(endpoint, endpoint.now_ns() + 1_000_000)?;
        Ok((endpoint.memory(probe::FOUND, 8 * (probe::REGIONS + 1))?, addresses))
    });
    let words: Vec<u64> =
        words.as_chunks::<4>().0.iter().map(|word| u64::from(u32::from_le_bytes(*word))).collect();
    let [regions @ .., control, ccr] = words.as_slice() else { panic!("{words:x?}") };
    let regions: Vec<Region> = regions
        .as_chunks::<2>()
        .0
        .iter()
        .map(|[base, attributes]| Region { base: *base, attributes: *attributes })
        .filter(|region| region.attributes & 1 != 0)
        .collect();
    // ENABLE and HFNMIENA, and no map behind the regions; both caches in CCR.
    assert_eq!(control & 0b111, 0b011, "MPU_CTRL");
    assert_eq!(ccr >> 16 & 0b11, 0b11, "caches in CCR");
    for region in &regions {
        let what = format!("{:#010x}: {:#010x}", region.base, region.attributes);
        assert!(!(region.is_cached() && region.may_be_written()), "cached, and written: {what}");
        assert!(!(region.may_run() && region.may_be_written()), "runs, and is written: {what}");
    }
    assert!(regions.iter().any(Region::is_cached), "nothing is cached");
    // The streams of scan, encoders and link.
    assert!(addresses.len() >= 5, "{addresses:x?}");
    for (stream, address) in addresses {
        assert!(TCMS.iter().all(|tcm| !tcm.contains(&address)), "{stream} cannot reach {address:#x}");
        let region = regions.iter().rfind(|region| region.holds(address));
        let region = region.unwrap_or_else(|| panic!("{stream}: {address:#x} is in no region"));
        assert!(!region.is_cached() && region.may_be_written(), "{stream}: {address:#x} is cached");
    }
}
