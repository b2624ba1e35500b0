//! Every model's step on the target and on this computer: identical bits.

use super::firmware;
use host_sim::link::ask::Ask;
use host_sim::link::client::Client;
use model_core::selfcheck::{MODELS, NAMES, STEPS, run};
use rig_link::message::{Answer, Command};
use virtual_bench::bench;
use virtual_bench::endpoint_link::perform;
use virtual_bench::experiment::{Request, boot};

#[test]
fn ten_thousand_random_steps_of_every_model_give_the_bits_they_give_on_this_computer() {
    let plant = Request::assumed("fig18").unwrap().plant().unwrap();
    let cases =
        (0..MODELS).map(|case| Command::SelfCheck { case: u8::try_from(case).unwrap(), steps: STEPS });
    let cases: Vec<Command> = cases.collect();
    let outcome = bench::run(firmware(), Box::new(plant), |endpoint| {
        boot(endpoint)?;
        perform(endpoint, &mut Client::new(), &mut Ask::new(cases), |_, _, _| Ok(()))
    })
    .unwrap();
    let expected = run(STEPS);
    assert_eq!((outcome.operator.len(), STEPS), (MODELS, 10_000));
    for ((answer, expected), name) in outcome.operator.iter().zip(expected).zip(NAMES) {
        assert_eq!(*answer, Answer::SelfCheck { digest: expected }, "{name}");
    }
}
