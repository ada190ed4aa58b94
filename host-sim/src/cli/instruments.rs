//! `instruments`: moves under many cameras and vibrometers.

use std::ffi::OsStr;
use std::path::PathBuf;

use clap::builder::TypedValueParser;
use clap::error::ErrorKind;
use clap::{Arg, Args, Command, Error};

use super::count::Count;
use super::publication::{Findings, PublicationArgs};
use super::{SceneArgs, progress};
use crate::cli::CommandError;
use crate::report::OutputError;
use crate::studies::instrument_grid::{InstrumentGrid, InstrumentGridPlan, Shard};

/// A shard as `I/N`, counted from 1.
#[derive(Clone, Debug)]
struct ShardParser;

impl TypedValueParser for ShardParser {
    type Value = Shard;

    fn parse_ref(&self, command: &Command, _: Option<&Arg>, value: &OsStr) -> Result<Shard, Error> {
        let text = value.to_string_lossy();
        let parts =
            text.split_once('/').and_then(|(i, n)| Some((i.parse::<u64>().ok()?, n.parse::<u64>().ok()?)));
        match parts {
            Some((i, n)) if 1 <= i && i <= n => Ok(Shard { index: i - 1, count: n }),
            _ => {
                let why = format!("--shard = {text} is not I/N with I from 1 to N");
                Err(Error::raw(ErrorKind::ValueValidation, why).with_cmd(command))
            }
        }
    }
}

#[derive(Debug, Args)]
pub(super) struct InstrumentsArgs {
    /// Motors drawn within the tolerances, each tried on every bench
    #[arg(long, value_name = "N", default_value = "20")]
    #[arg(value_parser = Count(1..=10_000), allow_negative_numbers = true)]
    motors: u64,
    /// Only benches whose name contains this
    #[arg(long, value_name = "TEXT", default_value = "")]
    only: String,
    /// Make only the I-th of N parts of the moves; --merge puts the parts together
    #[arg(long, value_name = "I/N", default_value = "1/1", value_parser = ShardParser)]
    shard: Shard,
    /// Make no moves: put together the moves.csv of the parts
    #[arg(long, value_name = "FILE.csv", num_args = 1..)]
    merge: Vec<PathBuf>,
    /// Folder for instruments.svg and moves.csv
    #[arg(long, value_name = "DIR", default_value = "out/instruments")]
    out: PathBuf,
    #[command(flatten)]
    publication: PublicationArgs,
    #[command(flatten)]
    scene: SceneArgs,
}

impl InstrumentsArgs {
    pub(super) fn execute(&self) -> Result<(), CommandError> {
        let scene = self.scene.load("instruments", &[])?;
        let publication = self.publication.open(&self.out)?;
        let grid = if self.merge.is_empty() {
            let plan = InstrumentGridPlan::new(&scene, self.motors, &self.only, self.shard);
            let bar = progress::bar(plan.work());
            let grid = plan.run(&|| bar.inc(1))?;
            bar.finish_and_clear();
            grid
        } else {
            let parts: Result<Vec<InstrumentGrid>, OutputError> =
                self.merge.iter().map(|path| InstrumentGrid::read(path)).collect();
            InstrumentGrid::merged(parts?)
        };
        Ok(publication.publish(Findings {
            files: vec![
                ("instruments.svg".to_owned(), grid.picture()?),
                ("moves.csv".to_owned(), grid.csv()?),
            ],
            text: grid.document().text(),
            json: grid.json(),
        })?)
    }
}
