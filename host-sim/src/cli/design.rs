//! `rig design`: the experiment that separates candidate models best.

use std::path::PathBuf;
use std::sync::Mutex;

use serde::Serialize;

use super::common::{SetArgs, say};
use super::progress::Progress;
use crate::design::{Effort, Proposal, propose};
use crate::files::model_file::ModelFile;
use crate::files::output_dir::OutputDir;
use crate::files::rig_file::RigFile;
use crate::input_error::InputError;
use crate::report::{Block, Chart, Line, Page, Panel, Role, Table, Window};

/// Propose the rig experiment that best separates two or more candidate models
#[derive(clap::Args, Debug)]
#[command(after_long_help = "\
Example:
  rig design --rig rig.toml --model thermal.toml wear.toml --out target/next
  rig simulate --experiment target/next/experiment.toml --out target/next/run

Tries load staircases, speed staircases, reversals, dwells, slides with a rest, load steps, turns there and
back, and pressing before turning, within what both motors can do, then improves load, speed and holding
time of the best. Each is run in closed loop with the first model on the disc; all models are driven with its
motion and load. The separation of two models is the RMS of what the wrong one misses after its parameters
have moved as far as their uncertainty lets them ([intervals] of the model file; where there are none 10 %
is assumed, 50 % for an effect), over the noise of a sample. Below 1 a pair is hard to tell apart even with
many samples.

Writes experiment.toml (for rig simulate, rig run and cargo virtual-bench), design.json (all experiments
tried, with the separation of every pair) and report.html (what each model would show).")]
pub(super) struct Design {
    /// Rig file (TOML); the assumed rig where left out
    #[arg(long, value_name = "RIG.toml")]
    rig: Option<PathBuf>,
    /// Candidate models (TOML), two or more
    #[arg(long, value_name = "MODEL.toml", num_args = 1.., required = true)]
    model: Vec<PathBuf>,
    /// Folder for the results
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    #[command(flatten)]
    set: SetArgs,
}

#[derive(Serialize)]
struct Results<'a> {
    models: Vec<&'a str>,
    experiment: String,
    separation: f64,
    noise_nm: f64,
    tried: Vec<Tried>,
}

#[derive(Serialize)]
struct Tried {
    experiment: &'static str,
    load_n: f64,
    speed_rpm: f64,
    hold_s: f64,
    separation: f64,
    pairs: Vec<crate::design::Pair>,
}

impl Design {
    /// Runs the command.
    pub(super) fn run(self) -> Result<(), InputError> {
        let overrides = self.set.overrides()?;
        overrides.only(true, false, false)?;
        let rig = RigFile::read_or_assumed(self.rig.as_deref(), &overrides.rig)?;
        let models =
            self.model.iter().map(|path| ModelFile::read(path, &[])).collect::<Result<Vec<_>, _>>()?;
        if models.len() < 2 {
            return Err(InputError::new("one model has nothing to be told apart from")
                .key("--model")
                .allowed("two or more model files"));
        }
        let mut output = OutputDir::new(&self.out)?;
        let progress = Mutex::new(Progress::new("trying experiments", 1));
        let proposals = propose(&rig, &models, Effort::THOROUGH, |done, total| {
            if let Ok(mut progress) = progress.lock() {
                progress.of(total as u64);
                progress.set(done as u64);
            }
        })?;
        drop(progress);
        let Some(best) = proposals.first() else { return Ok(()) };
        let names: Vec<&str> = models.iter().map(|model| model.source.as_str()).collect();
        output.write("experiment.toml", &best.toml)?;
        output.write_json("design.json", &results(&names, &proposals))?;
        output.write("report.html", page(&names, &proposals).to_html())?;
        let folder = output.folder().to_path_buf();
        output.finish()?;
        say(&format!("{}.", best.sentence()));
        for pair in &best.pairs {
            let (truth, other) = pair.models;
            say(&format!(
                "if {} is true, {} misses by {:.1} times the noise",
                names[truth], names[other], pair.separation
            ));
        }
        say(&format!("experiment: {}", folder.join("experiment.toml").display()));
        Ok(())
    }
}

fn results<'a>(names: &[&'a str], proposals: &[Proposal]) -> Results<'a> {
    let best = &proposals[0];
    let tried = proposals.iter().map(|proposal| Tried {
        experiment: proposal.setting.family.words(),
        load_n: proposal.setting.load_n,
        speed_rpm: proposal.setting.speed_rpm,
        hold_s: proposal.setting.hold_s,
        separation: proposal.separation(),
        pairs: proposal.pairs.clone(),
    });
    Results {
        models: names.to_vec(),
        experiment: best.sentence(),
        separation: best.separation(),
        noise_nm: best.noise_nm,
        tried: tried.collect(),
    }
}

/// Colours of the models in the plot, in the order in which they were given.
const ROLES: [Role; 5] = [Role::Series, Role::Lugre, Role::Brush, Role::Measured, Role::Reference];

fn page(names: &[&str], proposals: &[Proposal]) -> Page {
    let best = &proposals[0];
    let end_s = best.time_s.last().copied().unwrap_or(0.0);
    let lines = names.iter().zip(&best.torque_nm).zip(ROLES.iter().cycle());
    let lines = lines.map(|((name, torque_nm), role)| Line {
        name: (*name).into(),
        role: *role,
        x: best.time_s.clone(),
        y: torque_nm.clone(),
        tolerance: best.noise_nm,
        fine_tolerance: 0.1 * best.noise_nm,
    });
    let chart = Chart {
        title: "What each model would show".into(),
        caption: "Friction torque on the same motion and load, as the models stand, before any refit.".into(),
        x_title: "time, s".into(),
        panels: vec![Panel { y_title: "friction torque, N m".into(), lines: lines.collect() }],
        windows: vec![Window { label: "whole run".into(), range: (0.0, end_s) }],
        ..Chart::default()
    };
    let head = ["experiment", "load", "speed", "hold", "separation of the nearest pair"];
    let rows = proposals.iter().take(12).map(|proposal| {
        let setting = &proposal.setting;
        vec![
            setting.family.words().into(),
            format!("{:.0} N", setting.load_n),
            format!("{:.0} rpm", setting.speed_rpm),
            format!("{:.2} s", setting.hold_s),
            format!("{:.2}", proposal.separation()),
        ]
    });
    Page {
        title: "The next experiment".into(),
        lead: format!("{}.", best.sentence()),
        blocks: vec![
            Block::Chart(chart),
            Block::Heading("Experiments tried, best first".into()),
            Block::Table(Table { head: head.map(String::from).to_vec(), rows: rows.collect() }),
            Block::Text(
                "Separation: RMS of what the wrong model misses after its parameters moved within their \
                 uncertainty, over the noise of one sample."
                    .into(),
            ),
        ],
    }
}
