//! `results`: the pages of results, each written whole from runs of today, or compared with what stands there.

mod effort;
mod filter_core;
mod tilting;

use std::io::Write as _;
use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use serde::Serialize;

use super::Format;
use super::beside::BesideArgs;
use super::microcontroller::count_instructions;
use super::publication::svg_files;
use crate::board::qemu::Board;
use crate::board::{BoardError, instructions, parts, size};
use crate::cli::CommandError;
use crate::report::OutputError;
use crate::report::files::{self, Output, OutputFolder};
use crate::report::page::{self, PlacedValue};
use crate::studies::beside::{BesideScene, FIRST};
use crate::studies::commissioning::{self, CommissioningTrials, CommissioningTrialsPlan};
use crate::studies::error_budget::{BudgetRotor, ErrorBudget};
use crate::studies::fault_campaign::{FaultCampaign, FaultCampaignPlan};
use crate::studies::identification::{self, Calibration, CalibrationPlan};
use crate::studies::instrument_grid::InstrumentGridPlan;
use crate::studies::positioning_trials::tolerances::ToleranceTrials;
use crate::studies::positioning_trials::{self, Strategy};
use crate::studies::rotor_models::RotorModelsPlan;
use crate::studies::shard::Shard;
use crate::studies::stator::page::StatorPage;
use crate::studies::stator::solver::Solver;
use crate::studies::{filter_costs, filter_errors, gyroscope_calibration, held_rates, latency, paper};
use effort::Effort;
use simulation::scene::Scene;

/// A page: one question, and what answers it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Page {
    /// Does the model reproduce the paper?
    Paper,
    /// What do finite elements say of the stator?
    Stator,
    /// Why does mode B turn so slowly?
    Tilt,
    /// What does a step cost, and how far is it off?
    Step,
    /// Which filter, and how far is it off?
    Filters,
    /// What is the twin's error made of?
    Budget,
    /// How exactly does the rotor reach an angle?
    Positioning,
    /// Which instruments does it work with?
    Instruments,
    /// What happens when something goes wrong?
    Faults,
    /// How well does it hold a rate?
    Rate,
    /// How well does it calibrate a gyroscope?
    Calibration,
    /// What do recordings tell of a motor?
    Identification,
    /// Does it fit a microcontroller?
    Microcontroller,
    /// How quick and how exact is the filter core?
    FilterCore,
}

/// Scenes of a rotor that tilts whose motors are commissioned.
const COMMISSIONED_TILTING: usize = 4;

/// What the page on faults sets beside the default scene: a rotor that tilts, and other instruments.
const FAULTY_BENCHES: [&str; 4] =
    ["set_f_plant", "camera.marks=3", "camera.frame_rate_hz=500", "ldv.noise_m_s=1e-3"];

/// Seeds before the first of the page on faults: by those that are left out the filters' rules were made.
const FAULTY_SEEDS_LEFT_OUT: u64 = 100_000;

impl Page {
    /// Name of its file, without the ending.
    fn name(self) -> String {
        self.to_possible_value().map_or_else(String::new, |value| value.get_name().to_owned())
    }

    /// Its prose.
    fn template(self) -> &'static str {
        match self {
            Self::Paper => include_str!("results/paper.md"),
            Self::Stator => include_str!("results/stator.md"),
            Self::Tilt => include_str!("results/tilt.md"),
            Self::Step => include_str!("results/step.md"),
            Self::Filters => include_str!("results/filters.md"),
            Self::Budget => include_str!("results/budget.md"),
            Self::Positioning => include_str!("results/positioning.md"),
            Self::Instruments => include_str!("results/instruments.md"),
            Self::Faults => include_str!("results/faults.md"),
            Self::Rate => include_str!("results/rate.md"),
            Self::Calibration => include_str!("results/calibration.md"),
            Self::Identification => include_str!("results/identification.md"),
            Self::Microcontroller => include_str!("results/microcontroller.md"),
            Self::FilterCore => include_str!("results/filter-core.md"),
        }
    }

    /// Its figures and its pictures; `faulty` are tables of runs with faults, which are made if there are none.
    fn content(self, effort: &Effort, faulty: &[PathBuf]) -> Result<Content, CommandError> {
        let scene = &effort.scene()?;
        Ok(match self {
            Self::Paper => paper::PaperPlan::new(effort.paper_seeds)?.run(&|_| ())?.page_values().into(),
            Self::Stator => {
                let stator =
                    StatorPage::run(effort.stator, &Solver::default()).map_err(CommandError::from)?;
                Content { values: stator.page_values(), pictures: svg_files(&stator.pictures())? }
            }
            Self::Tilt => {
                let plan = RotorModelsPlan::new(effort.rotor_seeds, effort.rotors_drawn);
                let rotors = plan.with_changes(effort.rotor_changes).run(&|| ())?;
                Content { values: rotors.page_values(), pictures: svg_files(&rotors.pictures())? }
            }
            Self::Step => (effort.step_accuracy)().run()?.page_values().into(),
            Self::Filters => filter_values(effort, scene)?.into(),
            Self::Budget => {
                let budget = ErrorBudget::of(&budget_rotors(effort, scene)?)?;
                Content { values: budget.page_values(), pictures: svg_files(&budget.pictures())? }
            }
            Self::Positioning => positioning_values(effort, scene)?.into(),
            Self::Instruments => {
                let Effort { grid_motors, grid_benches, .. } = *effort;
                let plan = InstrumentGridPlan::new(scene, grid_motors, grid_benches, Shard::ALL);
                plan.run(&|| ())?.page_values().into()
            }
            Self::Faults if !faulty.is_empty() => FaultCampaign::merged(faulty)?.page_values().into(),
            Self::Faults => {
                let scene = &scene.of_run(FAULTY_SEEDS_LEFT_OUT)?;
                let asked = BesideScene { name: FIRST.to_owned(), scene: scene.clone() };
                let beside = BesideArgs::of(&FAULTY_BENCHES).scenes("faults", scene, Ok)?;
                let scenes = std::iter::once(asked).chain(beside).collect();
                let plan = FaultCampaignPlan::new(scenes, effort.faulty_runs, Shard::ALL);
                plan.run(&|| ())?.page_values().into()
            }
            Self::Rate => {
                let beside = tilting::of_one_motor(scene, effort.tilting_scenes)?;
                let mut values = held_rates::run(scene, &beside)?.page_values(tilting::HEIGHT_ONLY);
                let own = tilting::to_commission(scene, effort.tilting_scenes)?;
                values.extend(held_rates::OwnMapRates::run(&own)?.page_values());
                values.into()
            }
            Self::Calibration => calibration_values(effort, scene)?.into(),
            Self::Identification => identification_values(effort)?.into(),
            Self::Microcontroller => microcontroller_values(effort, scene)?.into(),
            Self::FilterCore => filter_core::values()?.into(),
        })
    }
}

/// What fills a page.
struct Content {
    values: Vec<PlacedValue>,
    /// Names of the files, and the SVG.
    pictures: Vec<(String, String)>,
}

impl From<Vec<PlacedValue>> for Content {
    /// A page without pictures.
    fn from(values: Vec<PlacedValue>) -> Self {
        Self { values, pictures: Vec::new() }
    }
}

/// Motors that the gyroscopes are spread over: they do not act back on the rotor.
const GYROSCOPE_MOTORS: u64 = 10;

/// Scenes of a rotor that tilts on which gyroscopes are calibrated for as long as is needed.
const NEEDED_TILTING: usize = 4;

fn filter_values(effort: &Effort, scene: &Scene) -> Result<Vec<PlacedValue>, CommandError> {
    let errors = filter_errors::FilterErrorsPlan::new(scene, effort.error_motors)?.run(&|_| ())?;
    let mut beside = vec![tilting::with_one_mark(scene)?];
    beside.extend(tilting::of_many_motors(scene, effort.tilting_scenes)?);
    let beside = BesideScene::run_each(&beside, |scene| {
        let drawn = scene.choice("plant.parameters") == "around_plant" && scene.integer("camera.marks") == 2;
        let motors = if drawn { effort.drawn_error_motors } else { effort.tilting_error_motors };
        filter_errors::FilterErrorsPlan::new(scene, motors)?.run(&|_| ())
    })?;
    let mut values = errors.with_beside(beside).page_values(tilting::HEIGHT_ONLY);
    let counts = count_instructions(None, Board::M4)?;
    let costs = filter_costs::FilterCostsPlan::new(scene, effort.cost_motors, filter_costs::ROUNDS)?;
    values.extend(costs.run(Some(&counts), &|| ())?.page_values());
    Ok(values)
}

/// The rotor of the paper, and one that tilts.
fn budget_rotors(effort: &Effort, scene: &Scene) -> Result<Vec<BudgetRotor>, CommandError> {
    let [motors, tilting_motors] = effort.budget_motors;
    let tilting = tilting::of_many_motors(scene, 1)?.into_iter().map(|of| BudgetRotor {
        name: "tilting (set F)",
        scene: of.scene,
        motors: tilting_motors,
    });
    let height_only = BudgetRotor { name: tilting::HEIGHT_ONLY, scene: scene.clone(), motors };
    Ok(std::iter::once(height_only).chain(tilting).collect())
}

fn positioning_values(effort: &Effort, scene: &Scene) -> Result<Vec<PlacedValue>, CommandError> {
    let trials = positioning_trials::PositioningTrialsPlan::new(scene, Strategy::Planned, effort.trials)?
        .run(&|_| ())?;
    let others = positioning_trials::PositioningTrialsPlan::others(scene, effort.compared_trials)?;
    let others: Result<Vec<_>, _> = others.iter().map(|plan| plan.run(&|_| ())).collect();
    let tilting = tilting::of_many_motors(scene, effort.tilting_scenes)?;
    let beside = BesideScene::run_each(&tilting, |scene| {
        let plan =
            positioning_trials::PositioningTrialsPlan::new(scene, Strategy::Planned, effort.tilting_trials);
        plan?.run(&|_| ())
    })?;
    let height_only = BesideScene { name: tilting::HEIGHT_ONLY.to_owned(), scene: scene.clone() };
    let set_f = tilting::of_many_motors(scene, 1)?;
    let scenes = std::iter::once(height_only).chain(set_f);
    let asked = scenes.zip(effort.tolerance_trials.map(u64::from));
    let at_tolerances: Vec<_> = asked.filter(|(_, trials)| *trials > 0).collect();
    let tolerances = ToleranceTrials::run(&at_tolerances)?;
    let alone = positioning_trials::PositioningTrials::alone(scene, trials);
    let found = positioning_trials::PositioningTrials { others: others?, beside, ..alone };
    let mut values = found.page_values(tilting::HEIGHT_ONLY);
    values.push(tolerances.page_value());
    values.push(commissioned_value(effort, scene)?);
    Ok(values)
}

/// Moves of motors that were commissioned first.
fn commissioned_value(effort: &Effort, scene: &Scene) -> Result<PlacedValue, CommandError> {
    let [height_only, tilting] = effort.commissioned_motors;
    let first = BesideScene { name: tilting::HEIGHT_ONLY.to_owned(), scene: scene.clone() };
    let of = |scene: &Scene, motors| {
        let plan = CommissioningTrialsPlan { motors, moves: 1, part: Shard::ALL };
        CommissioningTrials::run(scene, plan, &|| ())
    };
    let mut found = BesideScene::run_each(&[first], |scene| of(scene, height_only))?;
    if tilting > 0 {
        let scenes = tilting::of_many_motors(scene, COMMISSIONED_TILTING)?;
        found.extend(BesideScene::run_each(&scenes, |scene| of(scene, tilting))?);
    }
    Ok(commissioning::page_value(&found))
}

fn calibration_values(effort: &Effort, scene: &Scene) -> Result<Vec<PlacedValue>, CommandError> {
    let of = |scene: &Scene, runs, motors| {
        gyroscope_calibration::CalibrationPlan::new(scene, runs, motors)?.run(&|| ())
    };
    let mut calibrations = of(scene, effort.calibrations, GYROSCOPE_MOTORS)?;
    let tilting = tilting::of_many_motors(scene, effort.tilting_scenes)?;
    calibrations.beside = BesideScene::run_each(&tilting, |scene| {
        of(scene, effort.tilting_calibrations, effort.tilting_gyroscope_motors)
    })?;
    let mut values = calibrations.page_values(tilting::HEIGHT_ONLY);
    let Effort { needed_longest_s, needed_calibrations: [runs, motors], .. } = *effort;
    let mut needed = scene.clone();
    needed.set("calibrate.duration_s", &needed_longest_s.to_string())?;
    needed.set("calibrate.within_ppm", "10")?;
    let needed = tilting::of_many_motors(&needed, effort.tilting_scenes.min(NEEDED_TILTING))?;
    let needed = BesideScene::run_each(&needed, |scene| of(scene, runs, motors))?;
    values.push(gyroscope_calibration::page_value(&needed, needed_longest_s));
    values.push(("needed_longest_s", needed_longest_s.to_string()));
    Ok(values)
}

fn identification_values(effort: &Effort) -> Result<Vec<PlacedValue>, CommandError> {
    let of = |rotor: &str| -> Result<Calibration, CommandError> {
        let mut scene = Scene::default();
        scene.set("plant.rotor", rotor)?;
        let learning =
            identification::Effort { motors: effort.learnt_from, ..identification::Effort::default() };
        Ok(CalibrationPlan::new(&scene, effort.identified, learning)?.run(&|| ())?)
    };
    Ok(identification::page_values(&of("height_only")?, &of("tilting")?))
}

fn microcontroller_values(effort: &Effort, scene: &Scene) -> Result<Vec<PlacedValue>, CommandError> {
    let mut listing = count_instructions(None, Board::M4)?;
    let peers = instructions::program::build("peers")?;
    listing.counts.extend(count_instructions(Some(&peers), Board::M4)?.counts);
    let report = instructions::CountReport::new(Board::M4, listing).map_err(BoardError::from)?;
    let estimates = instructions::cycles::estimate(Board::M4)?;
    let mut values = instructions::page_values::page_values(&report, &estimates);
    let sizes = size::SizeReport::measure()?;
    values.extend(sizes.page_values());
    values.extend(parts::PartsReport::new(&report, sizes).map_err(BoardError::from)?.page_values());
    values.extend(latency_rates(effort, scene)?);
    values.extend(part_moves(effort, scene)?);
    Ok(values)
}

/// Rates held for a few seconds at each latency.
fn latency_rates(effort: &Effort, scene: &Scene) -> Result<[PlacedValue; 1], CommandError> {
    let mut scene = scene.clone();
    scene.set("rate.duration_s", if effort.latency_motors > 1 { "3" } else { "0.5" })?;
    Ok(latency::page_values(&scene, effort.latency_motors)?)
}

/// Moves by what each part has time for, beside those of a processor without bounds; then the same of a rotor that
/// tilts.
fn part_moves(effort: &Effort, scene: &Scene) -> Result<[PlacedValue; 2], CommandError> {
    let parts = parts::PARTS.map(|part| part.scene);
    let tilting = parts.map(|part| format!("set_f_plant,{part}"));
    let texts: Vec<&str> =
        parts.into_iter().chain(["set_f_plant"]).chain(tilting.iter().map(String::as_str)).collect();
    let beside = BesideArgs::of(&texts).scenes("positioning-trials", scene, Ok)?;
    let trials = |scene: &Scene, trials| {
        positioning_trials::PositioningTrialsPlan::new(scene, Strategy::Planned, trials)?.run(&|_| ())
    };
    let first = trials(scene, effort.part_trials)?;
    let beside = BesideScene::run_each(&beside, |scene| {
        let tilts = scene.choice("plant.rotor") != "height_only";
        trials(scene, if tilts { effort.tilting_trials } else { effort.part_trials })
    })?;
    let alone = positioning_trials::PositioningTrials::alone(scene, first);
    Ok(positioning_trials::PositioningTrials { beside, ..alone }.scene_values(tilting::HEIGHT_ONLY))
}

/// The flags of `results`.
#[derive(Debug, Args)]
pub(super) struct ResultsArgs {
    /// Pages to write; all of them unless some are named
    #[arg(value_enum)]
    pages: Vec<Page>,
    /// For the page faults: tables of its runs, made in parts by `faults --shard I/N` on the benches that the page
    /// names. Without them the runs are made
    #[arg(long, value_name = "FILE.csv", num_args = 1..)]
    faulty_runs: Vec<PathBuf>,
    /// Compare the pages with what the command would write, and write nothing; times on one machine are left out
    #[arg(long)]
    check: bool,
    /// Seconds instead of minutes: every place filled, no figure sharp; to try the prose of a page
    #[arg(long)]
    quick: bool,
    /// Folder of the pages
    #[arg(long, value_name = "DIR", default_value = "docs/results")]
    out: PathBuf,
    /// Folder of their pictures
    #[arg(long, value_name = "DIR", default_value = "docs/images")]
    images: PathBuf,
    /// How to print the result
    #[arg(long, value_enum, default_value = "text")]
    format: Format,
}

/// A page in JSON.
#[derive(Serialize)]
struct PageDone {
    page: String,
    path: PathBuf,
    result: &'static str,
}

impl ResultsArgs {
    pub(super) fn execute(&self) -> Result<(), CommandError> {
        let all = Page::value_variants();
        let effort = if self.quick { &Effort::QUICK } else { &Effort::FULL };
        let mut done = Vec::new();
        for &page in if self.pages.is_empty() { all } else { &self.pages } {
            let path = self.out.join(format!("{}.md", page.name()));
            let result = if self.check {
                check(page, &path, effort, &self.faulty_runs)?;
                "as written"
            } else {
                write(page, &path, &self.images, effort, &self.faulty_runs)?;
                "written"
            };
            if self.format == Format::Text {
                files::print(&format!("{result:<18} {}\n", path.display()))?;
            }
            done.push(PageDone { page: page.name(), path, result });
        }
        match self.format {
            Format::Text => Ok(()),
            Format::Json => Ok(files::print(&files::json_lines(&done))?),
        }
    }
}

/// Writes a page and its pictures.
fn write(
    page: Page,
    path: &Path,
    images: &Path,
    effort: &Effort,
    faulty: &[PathBuf],
) -> Result<(), CommandError> {
    let mut file = Output::create(path)?;
    let Content { values, pictures } = page.content(effort, faulty)?;
    let text = page::filled(page.template(), &values)?;
    if !pictures.is_empty() {
        OutputFolder::create(images)?.publish(&pictures)?;
    }
    file.write_all(text.as_bytes()).map_err(|source| file.unwritable(source))?;
    Ok(file.publish()?)
}

/// Compares a page with what would be written.
fn check(page: Page, path: &Path, effort: &Effort, faulty: &[PathBuf]) -> Result<(), CommandError> {
    let written = String::from_utf8_lossy(&files::read(path)?).into_owned();
    let fresh = page::filled(page.template(), &page.content(effort, faulty)?.values)?;
    match page::first_difference(&written, &fresh) {
        Some(line) => Err(OutputError::Outdated { path: path.to_owned(), line }.into()),
        None => Ok(()),
    }
}
