//! The link survives what a serial line does to it: any message comes through whole, and no damaged
//! frame comes through as a message.

use heapless::{String, Vec};
use proptest::prelude::*;
use rig_link::frame::{FrameError, MAX_FRAME, Receiver, encode};
use rig_link::message::{Answer, Command, Hello, Message, Rejection, Request, ResetCause};
use rig_link::program::{ProgramMode, ProgramSegment, ProgramShape};
use rig_link::telemetry::{Health, TelemetryRow};

fn frame_of<M: serde::Serialize>(message: &M) -> std::vec::Vec<u8> {
    let mut out = [0; MAX_FRAME];
    let length = encode(message, &mut out).expect("every message fits a frame");
    out[..length].to_vec()
}

fn receive<M: serde::de::DeserializeOwned>(bytes: &[u8]) -> std::vec::Vec<Result<M, FrameError>> {
    let mut receiver = Receiver::new();
    bytes.iter().filter_map(|byte| receiver.push(*byte)).collect()
}

prop_compose! {
    fn row()(
        numbers in any::<[f32; 11]>(),
        counts in any::<[i64; 2]>(),
        tick in any::<u64>(),
        words in any::<[u32; 3]>(),
        small in any::<[u8; 3]>(),
        limits in any::<u16>(),
    ) -> TelemetryRow {
        // A NaN is not equal to itself; NaN payloads are checked in their own test.
        let n = numbers.map(|x| if x.is_nan() { 0.0 } else { x });
        TelemetryRow {
            sequence: words[0], tick,
            m1_torque_ref_nm: n[0], m1_torque_nm: n[1], m1_count: counts[0],
            m2_torque_ref_nm: n[2], m2_torque_nm: n[3], m2_count: counts[1],
            m2_speed_ref_rad_s: n[4], m2_speed_rad_s: n[5], normal_force_n: n[6], friction_torque_nm: n[7],
            predicted_friction_torque_nm: n[8], supply_v: n[9],
            mode: small[0], fault: small[1], limits, sequencer: small[2], experiment_tick: words[1], cycles: words[2],
            residual_mean_square_nm2: n[10],
        }
    }
}

fn message() -> impl Strategy<Value = Message> {
    prop_oneof![
        row().prop_map(Message::Telemetry),
        (any::<u16>(), any::<u32>(), prop::collection::vec(any::<u8>(), 0..=480)).prop_map(
            |(id, offset, bytes)| {
                let bytes = Vec::from_slice(&bytes).unwrap_or_default();
                Message::Answer { id, answer: Answer::CaptureBytes { offset, bytes } }
            }
        ),
        (any::<u16>(), "[a-z ]{0,80}").prop_map(|(id, why)| {
            let why = String::try_from(why.as_str()).unwrap_or_default();
            Message::Answer { id, answer: Answer::Rejected(Rejection::ImpossibleProgram { why }) }
        }),
    ]
}

fn request() -> impl Strategy<Value = Request> {
    let command = prop_oneof![
        Just(Command::Hello),
        Just(Command::Arm),
        any::<u16>().prop_map(|every_ticks| Command::Telemetry { every_ticks }),
        (any::<u16>(), -1e9f32..1e9).prop_map(|(key, value)| Command::SettingSet { key, value }),
        (any::<u32>(), -1e3f32..1e3, -1e3f32..1e3, any::<u32>()).prop_map(|(start_tick, from, to, ticks)| {
            let (mode, shape) = (ProgramMode::M2Speed, ProgramShape::Ramp { from, to, ticks });
            Command::ProgramSegment(ProgramSegment { start_tick, mode, shape })
        }),
    ];
    (any::<u16>(), command).prop_map(|(id, command)| Request { id, command })
}

proptest! {
    #[test]
    fn any_message_comes_through_whole(message in message()) {
        prop_assert_eq!(receive(&frame_of(&message)), [Ok(message)]);
    }

    #[test]
    fn any_request_comes_through_whole(request in request()) {
        prop_assert_eq!(receive(&frame_of(&request)), [Ok(request)]);
    }

    /// A CRC-32 finds every burst of up to 32 bits; COBS can spread a flipped bit, so this tries it.
    #[test]
    fn a_frame_with_flipped_bits_is_never_taken(request in request(), at in any::<prop::sample::Index>(), mask in 1u8..) {
        let mut bytes = frame_of(&request);
        let last = bytes.len() - 1;
        bytes[at.index(last)] ^= mask;
        for received in receive::<Request>(&bytes) {
            prop_assert!(received.is_err(), "took {received:?} for {request:?}");
        }
    }

    #[test]
    fn a_frame_with_a_lost_byte_is_never_taken(request in request(), at in any::<prop::sample::Index>()) {
        let mut bytes = frame_of(&request);
        let last = bytes.len() - 1;
        bytes.remove(at.index(last));
        for received in receive::<Request>(&bytes) {
            prop_assert!(received.is_err(), "took {received:?} for {request:?}");
        }
    }

    #[test]
    fn noise_is_no_message_and_the_frame_after_it_is(noise in prop::collection::vec(any::<u8>(), 0..2000), request in request()) {
        let mut receiver = Receiver::new();
        for byte in noise.into_iter().chain([0]) {
            if let Some(received) = receiver.push::<Request>(byte) {
                prop_assert!(received.is_err());
            }
        }
        let received: std::vec::Vec<_> = frame_of(&request).iter().filter_map(|byte| receiver.push(*byte)).collect();
        prop_assert_eq!(received, [Ok(request)]);
    }
}

#[test]
fn the_bits_of_a_number_that_is_no_number_come_through() {
    let odd = f32::from_bits(0x7FC0_1234);
    let sent = Message::Telemetry(TelemetryRow { normal_force_n: odd, ..TelemetryRow::default() });
    let received = receive::<Message>(&frame_of(&sent));
    let [Ok(Message::Telemetry(row))] = received.as_slice() else { panic!("one row expected: {received:?}") };
    assert_eq!(row.normal_force_n.to_bits(), odd.to_bits());
}

#[test]
fn what_was_thrown_away_is_counted() {
    let mut receiver = Receiver::new();
    let mut bytes = frame_of(&Request { id: 1, command: Command::Arm });
    bytes[2] ^= 1;
    assert!(
        bytes.iter().filter_map(|byte| receiver.push::<Request>(*byte)).all(|received| received.is_err())
    );
    assert_eq!(receiver.rejected(), 1);
    let _ = receiver.push::<Request>(7);
    receiver.discard();
    assert_eq!(receiver.rejected(), 2);
    let too_long = [1; MAX_FRAME + 10];
    assert!(too_long.iter().all(|byte| receiver.push::<Request>(*byte).is_none()));
    assert_eq!(receiver.push::<Request>(0), Some(Err(FrameError::TooLong)));
    assert_eq!(receiver.rejected(), 3);
}

#[test]
fn a_message_with_more_bytes_than_it_needs_is_refused() {
    // The same body with a byte behind it: intact by its CRC, and still no message of this protocol.
    let received = receive::<Request>(&frame_of(&(Request { id: 1, command: Command::Arm }, 0u8)));
    assert_eq!(received, [Err(FrameError::Message)]);
}

#[test]
fn a_telemetry_row_at_1_khz_uses_less_than_two_thirds_of_the_line() {
    // Counts and ticks of a long run take their largest usual size: an hour of ticks, a thousand revolutions.
    let row = TelemetryRow {
        sequence: 3_600_000,
        tick: 36_000_000,
        m1_count: 480_000,
        m2_count: 480_000_000,
        experiment_tick: 100_000,
        cycles: 20_000,
        limits: 0xFFFF,
        ..TelemetryRow::default()
    };
    let bytes_per_s = 1000 * frame_of(&Message::Telemetry(row)).len();
    let line_bytes_per_s = rig_link::BAUD as usize / 10;
    assert!(3 * bytes_per_s < 2 * line_bytes_per_s, "{bytes_per_s} of {line_bytes_per_s} bytes/s");
}

/// The wire format is the order and the types of the members: who changes them raises `PROTOCOL_VERSION` and
/// writes the new bytes here.
#[test]
fn the_bytes_of_version_5_stay_as_they_are() {
    use rig_link::message::PROTOCOL_VERSION;
    assert_eq!(PROTOCOL_VERSION, 5);
    let hex = |bytes: std::vec::Vec<u8>| {
        bytes.iter().map(|byte| format!("{byte:02x}")).collect::<std::string::String>()
    };
    let request = |command| hex(frame_of(&Request { id: 300, command }));
    assert_eq!(request(Command::Hello), "03ac0205941f151d00");
    assert_eq!(request(Command::SettingSet { key: 200, value: 32790.5 }), "08ac020cc80180160347fc038dbc00");
    assert_eq!(request(Command::Restart), "08ac021954b77e7900");
    let hello = Hello {
        protocol: PROTOCOL_VERSION,
        settings_schema: 3,
        version: "0.1.0".try_into().unwrap(),
        tick_hz: 10_000,
        counts_per_rev: 480_000,
        reset: ResetCause::Watchdog,
        crystal: true,
        reference_mv: 3_290,
        ..Hello::default()
    };
    let answer = Message::Answer { id: 300, answer: Answer::Hello(hello) };
    assert_eq!(
        hex(frame_of(&answer)),
        "010cac0201050305302e312e300101010101010101010101010101010101010108904e80a61d030107da194a0bc18400"
    );
    let row = TelemetryRow {
        sequence: 7,
        tick: 70_000,
        m1_torque_ref_nm: 3.2,
        m2_count: -480_000,
        friction_torque_nm: 6.25,
        mode: 3,
        limits: 5,
        sequencer: 2,
        experiment_tick: 71,
        cycles: 20_000,
        residual_mean_square_nm2: 0.5,
        ..TelemetryRow::default()
    };
    assert_eq!(
        hex(frame_of(&Message::Telemetry(row))),
        "0a0107f0a204cdcc4c4001010101010101010101010104ffcb3a0101010101010101010101010103c84001010101010101020307050247a09c010101063fd3afa1fd00"
    );
    let mut health = Health { tick: 70_000, cycles_max: 3_516, stack: (38_310, 57_344), ..Health::default() };
    [1_000, 2_642, 2_642, 40_000].into_iter().for_each(|cycles| health.cycles.add(cycles));
    health.starts.add(640);
    assert_eq!(
        hex(frame_of(&Message::Health(health))),
        "0502f0a20401010101010103bc1b010101010102010102020101010101010201010101010101010101010201010101010101010ba6ab0280c0032fbafdaa00"
    );
}
