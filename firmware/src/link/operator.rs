//! Carries out what the host asks: commands go to the control tick, settings to flash, captures come out of RAM.
//!
//! One request at a time, so what is prepared here and lent to the tick has one owner at any moment.

use crate::handover::Handover;
use crate::settings::{Refused as NotStored, Settings};
use crate::tick::{Carried, Order};
use crate::{capture, restart, tick};
use embassy_time::{Duration, Instant, Timer};
use heapless::spsc::{Consumer, Producer};
use heapless::{String, Vec};
use model_core::control::{Command as Core, ControlConfig, Mode, ObserverModel, PreparedExperiment, Refusal};
use model_core::error::ParameterError;
use model_core::selfcheck;
use rig_link::inputs::Inputs;
use rig_link::message::{
    Answer, CAPTURE_CHUNK, Command, CrashRecord, Hello, PROTOCOL_VERSION, Rejection, ResetCause,
};
use rig_link::model::ModelRecord;
use rig_link::program::{ProgramHeader, Upload};
use rig_link::settings::{SCHEMA_VERSION, by_key};

static PROGRAM: Handover<PreparedExperiment> = Handover::new();
static MODEL: Handover<ObserverModel> = Handover::new();
static CONFIG: Handover<ControlConfig> = Handover::new();

/// Longest wait for the tick's answer to an order: it answers within a period.
const TICK_PATIENCE: Duration = Duration::from_millis(20);

/// What is known about this start.
pub struct Identity {
    /// Why the chip started.
    pub reset: ResetCause,
    /// The clock comes from the 8 MHz of the ST-LINK.
    pub crystal: bool,
    /// VREF+ at the start, mV.
    pub reference_mv: u16,
    /// The crash record from before.
    pub crash_record: Option<CrashRecord>,
}

/// The one who carries out requests.
pub struct Operator {
    identity: Identity,
    settings: Settings,
    config: ControlConfig,
    upload: Upload,
    orders: Producer<'static, Order>,
    answers: Consumer<'static, Carried>,
    inputs: Consumer<'static, Inputs>,
}

/// Why an order to the tick was not carried out.
enum Undone {
    Refused(model_core::control::Refused),
    NoTick,
}

impl From<Undone> for Answer {
    fn from(undone: Undone) -> Self {
        match undone {
            Undone::Refused(refused) if refused.reason == Refusal::NotDisabled => {
                Self::Rejected(Rejection::NotDisabled)
            }
            Undone::Refused(refused) => refused.into(),
            Undone::NoTick => Self::Rejected(Rejection::NoTick),
        }
    }
}

impl Operator {
    /// An operator for this start, with the configuration the tick runs.
    #[must_use]
    pub fn new(
        identity: Identity,
        settings: Settings,
        config: ControlConfig,
        orders: Producer<'static, Order>,
        answers: Consumer<'static, Carried>,
        inputs: Consumer<'static, Inputs>,
    ) -> Self {
        Self { identity, settings, config, upload: Upload::default(), orders, answers, inputs }
    }

    /// Carries out one request.
    pub async fn carry_out(&mut self, command: Command) -> Answer {
        match command {
            Command::Hello => Answer::Hello(self.hello()),
            Command::KeepAlive => Answer::Done,
            Command::Arm => self.core(Core::Arm).await,
            Command::Disarm => self.core(Core::Disarm).await,
            Command::Start => self.core(Core::Start).await,
            Command::Stop => self.core(Core::Stop).await,
            Command::ClearFault => self.core(Core::ClearFault).await,
            Command::Tare => self.core(Core::Tare).await,
            Command::ProgramBegin(header) => self.begin(header),
            Command::ProgramSegment(segment) => match self.upload.push(&segment) {
                Ok(()) => Answer::Done,
                Err(_) => Answer::Rejected(Rejection::IncompleteProgram),
            },
            Command::ProgramCommit => self.load_program().await,
            Command::SettingGet { key } => match by_key(key) {
                Some(info) => Answer::Setting(self.settings.state(info)),
                None => Answer::Rejected(Rejection::UnknownSetting),
            },
            Command::SettingSet { key, value } => self.set_value(key, Some(value)).await,
            Command::SettingForget { key } => self.set_value(key, None).await,
            Command::SettingsErase => self.erase().await,
            Command::ModelGet => self.model(),
            Command::ModelSet(model) => self.set_model(Some(model)).await,
            Command::ModelForget => self.set_model(None).await,
            Command::Telemetry { every_ticks } => self.order(Order::Telemetry(every_ticks)).await,
            Command::CaptureArm(trigger) => self.order(Order::CaptureArm(trigger)).await,
            Command::CaptureTrigger => self.order(Order::CaptureTrigger).await,
            Command::CaptureStatus => Answer::Capture(capture::info()),
            Command::CaptureRead { offset } => read_capture(offset),
            Command::CrashRecord => Answer::CrashRecord(self.identity.crash_record.clone()),
            Command::SelfCheck { case, steps } => self_check(case, steps),
            Command::Restart if !drives_off() => Answer::Rejected(Rejection::NotDisabled),
            Command::Restart => restart::by_command(),
            Command::Inputs => self.raw_inputs().await,
        }
    }

    fn hello(&self) -> Hello {
        Hello {
            protocol: PROTOCOL_VERSION,
            settings_schema: SCHEMA_VERSION,
            version: String::try_from(env!("CARGO_PKG_VERSION")).unwrap_or_default(),
            build_id: crate::memory::build_id(),
            tick_hz: crate::board::TICK_HZ,
            counts_per_rev: self.settings.counts_per_rev(),
            reset: self.identity.reset,
            crystal: self.identity.crystal,
            reference_mv: self.identity.reference_mv,
            crash_record: self.identity.crash_record.is_some(),
        }
    }

    /// Sends an order to the tick and waits for what came of it.
    async fn ask(&mut self, order: Order) -> Result<(), Undone> {
        // An answer that came too late for the request before belongs to nobody.
        while self.answers.dequeue().is_some() {}
        self.orders.enqueue(order).map_err(|_| Undone::NoTick)?;
        let begun = Instant::now();
        loop {
            if let Some(carried) = self.answers.dequeue() {
                return carried.map_err(Undone::Refused);
            }
            if begun.elapsed() > TICK_PATIENCE {
                return Err(Undone::NoTick);
            }
            Timer::after_micros(100).await;
        }
    }

    async fn order(&mut self, order: Order) -> Answer {
        match self.ask(order).await {
            Ok(()) => Answer::Done,
            Err(undone) => undone.into(),
        }
    }

    async fn raw_inputs(&mut self) -> Answer {
        while self.inputs.dequeue().is_some() {}
        match self.ask(Order::Inputs).await {
            Ok(()) => self.inputs.dequeue().map_or(Answer::Rejected(Rejection::NoTick), Answer::Inputs),
            Err(undone) => undone.into(),
        }
    }

    async fn core(&mut self, command: Core<'static>) -> Answer {
        self.order(Order::Core(command)).await
    }

    fn begin(&mut self, header: ProgramHeader) -> Answer {
        self.upload.begin(header);
        Answer::Done
    }

    async fn load_program(&mut self) -> Answer {
        let Ok(experiment) = self.upload.complete() else {
            return Answer::Rejected(Rejection::IncompleteProgram);
        };
        let lent = match experiment.prepare(&self.config) {
            Ok(prepared) => PROGRAM.lend(prepared),
            Err(error) => return Answer::Rejected(Rejection::ImpossibleProgram { why: words(&error) }),
        };
        let Some(lent) = lent else { return Answer::Rejected(Rejection::NoTick) };
        let carried = self.ask(Order::Core(Core::LoadExperiment(lent))).await;
        give_back(&PROGRAM, &carried);
        carried.map_or_else(Answer::from, |()| Answer::Done)
    }

    /// Puts a configuration in force; possible only while the rig is disabled.
    async fn change(&mut self, config: &ControlConfig) -> Result<(), Answer> {
        let lent = CONFIG.lend(*config).ok_or(Answer::Rejected(Rejection::NoTick))?;
        let carried = self.ask(Order::Core(Core::SetConfig(lent))).await;
        give_back(&CONFIG, &carried);
        carried?;
        self.config = *config;
        Ok(())
    }

    async fn set_value(&mut self, key: u16, value: Option<f32>) -> Answer {
        let Some(info) = by_key(key) else { return Answer::Rejected(Rejection::UnknownSetting) };
        let (stored, config) = match self.settings.with_value(info, value) {
            Ok(new) => new,
            Err(error) => return out_of_range(&error),
        };
        if let Err(answer) = self.change(&config).await {
            return answer;
        }
        match self.settings.keep_value(info, value, stored).await {
            Ok(()) => Answer::Setting(self.settings.state(info)),
            Err(refused) => self.restore(refused).await,
        }
    }

    /// Storing may erase a sector, which takes up to 4 s (DS12110, flash memory programming), and no request is heard
    /// meanwhile: only with the drives off.
    async fn set_model(&mut self, model: Option<ModelRecord>) -> Answer {
        if !drives_off() {
            return Answer::Rejected(Rejection::NotDisabled);
        }
        let prepared = match self.settings.with_model(model.as_ref()) {
            Ok(prepared) => prepared,
            Err(error) => return out_of_range(&error),
        };
        if let Err(refused) = self.settings.keep_model(model).await {
            return not_stored(&refused);
        }
        self.config.set_model(&prepared);
        // The model alone: a swap of the whole configuration would forget the tare.
        let Some(lent) = MODEL.lend(prepared) else { return Answer::Rejected(Rejection::NoTick) };
        let carried = self.ask(Order::Core(Core::SetModel(lent))).await;
        give_back(&MODEL, &carried);
        carried.map_or_else(Answer::from, |()| self.model())
    }

    /// What could not be stored is not used either.
    async fn restore(&mut self, refused: NotStored) -> Answer {
        if let Ok(config) = self.settings.config()
            && let Err(answer) = self.change(&config).await
        {
            return answer;
        }
        not_stored(&refused)
    }

    fn model(&self) -> Answer {
        Answer::Model(self.settings.model().cloned())
    }

    async fn erase(&mut self) -> Answer {
        if !drives_off() {
            return Answer::Rejected(Rejection::NotDisabled);
        }
        if let Err(refused) = self.settings.erase().await {
            return not_stored(&refused);
        }
        match self.settings.config() {
            Ok(config) => self.change(&config).await.map_or_else(|answer| answer, |()| Answer::Done),
            Err(error) => out_of_range(&error),
        }
    }
}

/// The mode cannot change to one with the drives on meanwhile: that takes a command, and commands come here.
fn drives_off() -> bool {
    [Mode::Disabled, Mode::Fault].iter().any(|mode| mode.number() == tick::mode())
}

fn give_back<T: 'static>(cell: &'static Handover<T>, carried: &Result<(), Undone>) {
    if !matches!(carried, Err(Undone::NoTick)) {
        // SAFETY: the tick answered, so `apply` has returned and holds the reference no longer. Without an
        // answer the cell stays lent for good.
        unsafe { cell.reclaim() };
    }
}

fn read_capture(offset: u32) -> Answer {
    let mut bytes: Vec<u8, CAPTURE_CHUNK> = Vec::new();
    if bytes.resize(CAPTURE_CHUNK, 0).is_err() {
        return Answer::Rejected(Rejection::NoCapture);
    }
    match capture::read(offset, &mut bytes) {
        Some(length) => {
            bytes.truncate(length);
            Answer::CaptureBytes { offset, bytes }
        }
        None => Answer::Rejected(Rejection::NoCapture),
    }
}

fn not_stored(refused: &NotStored) -> Answer {
    match refused {
        NotStored::OutOfRange(error) => out_of_range(error),
        NotStored::Storage(error) => {
            defmt::warn!("settings: {}", error);
            Answer::Rejected(Rejection::Storage)
        }
        NotStored::Damaged | NotStored::TooLong => Answer::Rejected(Rejection::Storage),
    }
}

fn out_of_range(error: &ParameterError) -> Answer {
    Answer::Rejected(Rejection::OutOfRange {
        name: words(&error.name),
        value: error.value as f32,
        allowed: words(&error.allowed),
    })
}

/// The most steps of a self-check: the control tick goes on, but the link waits meanwhile.
const MOST_STEPS: u32 = 20_000;

fn self_check(case: u8, steps: u32) -> Answer {
    if !drives_off() {
        return Answer::Rejected(Rejection::NotDisabled);
    }
    let case = usize::from(case);
    if case >= selfcheck::MODELS || steps > MOST_STEPS {
        return Answer::Rejected(Rejection::UnknownCase);
    }
    Answer::SelfCheck { digest: selfcheck::run_model(case, steps) }
}

/// Text of something, cut where it gets too long.
fn words<const N: usize>(what: &impl core::fmt::Display) -> String<N> {
    struct Cut<const N: usize>(String<N>);
    impl<const N: usize> core::fmt::Write for Cut<N> {
        fn write_str(&mut self, text: &str) -> core::fmt::Result {
            text.chars().try_for_each(|character| self.0.push(character).map_err(|_| core::fmt::Error))
        }
    }
    let mut cut = Cut(String::new());
    let _ = core::fmt::Write::write_fmt(&mut cut, format_args!("{what}"));
    cut.0
}
