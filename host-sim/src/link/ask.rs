//! Requests one after the other, each with its answer.

use std::collections::VecDeque;

use rig_link::message::{Answer, Command, Hello, Message, PROTOCOL_VERSION, Request};

use super::client::Client;
use super::procedure::{Procedure, patience};
use super::words;
use crate::input_error::{InputError, Kind};

/// A list of requests on its way.
#[derive(Debug)]
pub struct Ask {
    waiting: VecDeque<Command>,
    asked: Option<Asked>,
    answers: Vec<Answer>,
    /// Messages that answer nothing: telemetry, events.
    others: Vec<Message>,
    done: bool,
}

#[derive(Debug)]
struct Asked {
    request: Request,
    since_s: f64,
}

impl Ask {
    /// Asks these, in this order.
    pub fn new(commands: impl IntoIterator<Item = Command>) -> Self {
        Self {
            waiting: commands.into_iter().collect(),
            asked: None,
            answers: Vec::new(),
            others: Vec::new(),
            done: false,
        }
    }

    /// Adds a request at the end.
    pub fn push(&mut self, command: Command) {
        self.waiting.push_back(command);
        self.done = false;
    }

    /// Forgets the requests that are not on their way yet.
    pub fn forget_waiting(&mut self) {
        self.waiting.clear();
    }

    /// Forgets every request; nobody waits for an answer any more.
    pub fn forget_all(&mut self) {
        self.waiting.clear();
        self.asked = None;
    }

    /// Whether every request has its answer.
    #[must_use]
    pub fn is_idle(&self) -> bool {
        self.waiting.is_empty() && self.asked.is_none()
    }

    /// The answers so far, in the order of the requests, taken out.
    pub fn take_answers(&mut self) -> Vec<Answer> {
        std::mem::take(&mut self.answers)
    }

    /// Messages that answer nothing, taken out.
    pub fn take_others(&mut self) -> Vec<Message> {
        std::mem::take(&mut self.others)
    }
}

impl Procedure for Ask {
    type Outcome = Vec<Answer>;

    fn step(&mut self, now_s: f64, client: &mut Client) -> Result<(), InputError> {
        while let Some(message) = client.next_message() {
            match message {
                Message::Answer { id, answer } => {
                    // An answer to a sign of life, or to a request given up long ago, is nobody's.
                    if self.asked.as_ref().is_some_and(|asked| asked.request.id == id) {
                        self.asked = None;
                        self.answers.push(answer);
                    }
                }
                other => self.others.push(other),
            }
        }
        if self.asked.is_none()
            && let Some(command) = self.waiting.pop_front()
        {
            let id = client.request(command.clone());
            self.asked = Some(Asked { request: Request { id, command }, since_s: now_s });
        }
        if let Some(Asked { request, since_s }) = &self.asked
            && now_s - since_s > patience(&request.command).as_secs_f64()
        {
            return Err(InputError::new(format!(
                "no answer to {}; is this the rig's port, and does its firmware run?",
                words::command(&request.command)
            ))
            .of_kind(Kind::Rig));
        }
        self.done = self.is_idle();
        Ok(())
    }

    fn outcome(&mut self) -> Option<Vec<Answer>> {
        std::mem::take(&mut self.done).then(|| self.take_answers())
    }
}

/// Whether the firmware speaks this tool's language.
///
/// # Errors
/// It does not, or the answer is none to a hello.
pub fn check_hello(answer: &Answer) -> Result<Hello, InputError> {
    let Answer::Hello(hello) = answer else { return Err(words::unexpected(answer)) };
    if hello.protocol != PROTOCOL_VERSION {
        return Err(InputError::new("the firmware speaks another version of the protocol")
            .of_kind(Kind::Run)
            .key("protocol")
            .value(hello.protocol)
            .allowed(PROTOCOL_VERSION.to_string()));
    }
    Ok(hello.clone())
}
