//! `crumple monitor`: follow a run that is being computed.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use clap::Args;
use crumple::descriptor;
use crumple::monitor::{self, Align, Calibration, Follow, Place, QUANTILE, Rule, Step, Tracker, Verdict, follow};
use crumple::project::Projector;
use crumple::run::Run;
use crumple::study::Loaded;
use crumple::target::Target;
use crumple::{Error, Watch};
use serde::Serialize;
use serde_json::json;

use super::Answer;
use crate::output::{Output, time};

#[derive(Args)]
#[command(
    about = "Follow a run that is being computed; exit code 1, or a stop request to the solver, once it leaves the path",
    after_help = "Each new state is compared with the descriptor's own run at the same time. Exit code: 0 the run came as far as the descriptor's and stayed with it, 1 it left the path, 2 bad input, or no new state for --timeout seconds.\n\nExample:\n  crumple monitor study mode-1 new/d3plot\n  crumple monitor study mode-1 new --stop --every 1"
)]
pub(crate) struct Monitor {
    /// Folder of the study
    study: PathBuf,
    /// What the run should become: a descriptor of the study by name, the path of its file, a mode, or a run
    descriptor: String,
    /// The root file that the solver writes, or its folder; it need not be there yet
    run: PathBuf,
    /// Seconds between two looks at the file
    #[arg(long, value_name = "SECONDS", default_value_t = 5.0, allow_negative_numbers = true)]
    every: f64,
    /// Give up when no new state has come for so many seconds
    #[arg(long, value_name = "SECONDS", default_value_t = 3600.0, allow_negative_numbers = true)]
    timeout: f64,
    /// Largest 1 − similarity that is still on the path, 0 to 2 [default: what 95 % of the runs of the descriptor's mode
    /// keep at each state]
    #[arg(long, value_name = "D", allow_negative_numbers = true)]
    tolerance: Option<f64>,
    /// States in a row off the path that decide [default: 2]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    states: Option<u16>,
    /// Judge nothing before the descriptor's own run has deformed by this share of what it will [default: 0.1]
    #[arg(long, value_name = "SHARE", allow_negative_numbers = true)]
    from: Option<f64>,
    /// What says how far a run has come: time, or intrusion, how far its surface has moved [default: time]
    #[arg(long, value_name = "WHAT")]
    align: Option<String>,
    /// Which of the descriptor's numbers: rotation or paper [default: what the descriptor was made for]
    #[arg(long, value_name = "KIND")]
    kind: Option<String>,
    /// Once it leaves the path, ask LS-DYNA to end it: a file d3kil with sw1 beside the result file
    #[arg(long)]
    stop: bool,
    /// Once it leaves the path, run this command (by the shell, in the current folder; CRUMPLE_RUN, CRUMPLE_STATE and
    /// CRUMPLE_TIME say of what)
    #[arg(long, value_name = "COMMAND")]
    stop_command: Option<String>,
}

impl Monitor {
    pub(crate) fn run(&self, output: &Output, watch: &dyn Watch) -> Result<Answer, Error> {
        let pace = Follow { every: seconds("--every", self.every)?, timeout: seconds("--timeout", self.timeout)? };
        let mut rule = self.rule()?;
        let align: Align = self.align.as_deref().map(str::parse).transpose()?.unwrap_or_default();
        let kind = self.kind.as_deref().map(str::parse).transpose()?;
        let loaded = Loaded::open(&self.study)?;
        let descriptor = descriptor::find(&loaded, &self.descriptor, None)?;
        let tracker = Tracker::new(&loaded, &descriptor, kind, align)?;
        let target = tracker.target(&descriptor)?;
        let calibration = match self.tolerance {
            Some(_) => None,
            None => Some(monitor::calibrate(&loaded, &tracker, &descriptor, &target, &rule)?),
        };
        if let Some(calibration) = &calibration {
            output.note(&band_words(calibration));
            rule = calibration.rule.clone();
        }
        let projector = Projector::new(&loaded.reference, &loaded.basis, &loaded.study.settings().fields);
        let mut judge = monitor::Monitor::new(target, rule);
        let mut seen: Vec<Seen> = Vec::new();
        let root = follow(&self.run, pace, watch, |run: &Run, state: usize| {
            let target = Target::projected(run.id(), state, projector.state(run, state)?);
            let Place { at, numbers, .. } = tracker.place(&target)?;
            let step = judge.step(at, &numbers);
            let now = Seen { state, time: target.time, step };
            if !output.json {
                output.line(&now.words());
            }
            seen.push(now);
            let over = step.verdict == Verdict::Diverged || judge.is_over();
            Ok(if over { ControlFlow::Break(run.path().to_owned()) } else { ControlFlow::Continue(()) })
        })?;
        let last =
            seen.last().ok_or_else(|| Error::Internal("a run was followed to its end without a state".into()))?;
        let diverged = last.step.verdict == Verdict::Diverged;
        let asked = if diverged { self.ask_to_stop(&root, last)? } else { Vec::new() };
        let facts = json!({ "descriptor": descriptor.name, "kind": tracker.kind(), "align": align, "run": root, "diverged": diverged, "calibration": calibration, "states": seen, "stop": asked });
        if output.json {
            output.print(&facts, String::new);
        } else if diverged {
            output.line(&format!("off the path of '{}' at time {}", descriptor.name, time(last.time)));
            asked.iter().for_each(|what| output.line(&format!("stop: {what}")));
        } else {
            output.line(&format!("on the path of '{}' to its end", descriptor.name));
        }
        Ok(if diverged { Answer::No } else { Answer::Done })
    }

    fn rule(&self) -> Result<Rule, Error> {
        let within = |name: &'static str, value: f64, least: f64, most: f64| {
            let expected = format!("a number from {least} to {most}");
            let wrong = Error::Value { name, value: value.to_string(), expected };
            if (least..=most).contains(&value) { Ok(value) } else { Err(wrong) }
        };
        let mut rule = Rule::constant(1.0 - within("--tolerance", self.tolerance.unwrap_or(0.0), 0.0, 2.0)?);
        rule.from = within("--from", self.from.unwrap_or(rule.from), 0.0, 1.0)?;
        rule.consecutive = self.states.map_or(rule.consecutive, usize::from);
        Ok(rule)
    }

    /// Does what was asked for, and says what was done.
    fn ask_to_stop(&self, root: &Path, last: &Seen) -> Result<Vec<String>, Error> {
        let mut asked = Vec::new();
        if self.stop {
            asked.push(monitor::stop(root)?.display().to_string());
        }
        if let Some(words) = &self.stop_command {
            let (shell, flag) = if cfg!(windows) { ("cmd", "/C") } else { ("sh", "-c") };
            let mut command = Command::new(shell);
            command.args([flag, words]).env("CRUMPLE_RUN", root);
            command.env("CRUMPLE_STATE", last.state.to_string()).env("CRUMPLE_TIME", last.time.to_string());
            // What it prints is no result of ours.
            command.stdin(std::process::Stdio::null()).stdout(std::io::stderr());
            let failed = |value: String| Error::Value {
                name: "--stop-command",
                value,
                expected: format!("a command that succeeds; the run left the path at time {}", time(last.time)),
            };
            let status = command.status().map_err(|error| failed(format!("{words} ({error})")))?;
            if !status.success() {
                return Err(failed(format!("{words} ({status})")));
            }
            asked.push(words.clone());
        }
        Ok(asked)
    }
}

/// A state and the verdict on it.
#[derive(Serialize)]
struct Seen {
    state: usize,
    time: f64,
    #[serde(flatten)]
    step: Step,
}

impl Seen {
    fn words(&self) -> String {
        let Step { similarity, floor, verdict, .. } = self.step;
        let word = match verdict {
            Verdict::Early => "too early to tell",
            Verdict::Alike => "on the path",
            Verdict::Unlike => "off the path",
            Verdict::Diverged => "off the path: DIVERGED",
        };
        let compared = similarity.map_or(String::new(), |found| format!("  similarity {found:.4}, floor {floor:.4}"));
        format!("state {:>4}  time {:>10}{compared}  {word}", self.state, time(self.time))
    }
}

fn band_words(calibration: &Calibration) -> String {
    let Calibration { mode, members, members_stopped, others, others_stopped, others_stopped_at, .. } = calibration;
    let at =
        others_stopped_at.map_or(String::new(), |at| format!(", half of them before {:.0} % of the path", 100.0 * at));
    format!(
        "the floor is the {:.0} % quantile of {members} runs of {mode} at each state; by this rule {members_stopped} of them (each left out of its own floor) and {others_stopped} of {others} runs of other modes would be stopped{at}",
        100.0 * QUANTILE
    )
}

fn seconds(name: &'static str, value: f64) -> Result<Duration, Error> {
    Duration::try_from_secs_f64(value).ok().filter(|length| !length.is_zero()).ok_or_else(|| Error::Value {
        name,
        value: value.to_string(),
        expected: "seconds, above 0".into(),
    })
}
