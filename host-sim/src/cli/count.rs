//! Counts on the command line: how many motors, runs or seeds a study has.

use std::ffi::OsStr;
use std::ops::RangeInclusive;

use clap::builder::TypedValueParser;
use clap::error::ErrorKind;
use clap::{Arg, Command, Error};

/// A whole number within bounds, refused as a key of a scene is: by name, value and bounds.
#[derive(Clone, Debug)]
pub(super) struct Count(pub RangeInclusive<u64>);

impl TypedValueParser for Count {
    type Value = u64;

    fn parse_ref(&self, command: &Command, flag: Option<&Arg>, value: &OsStr) -> Result<u64, Error> {
        let text = value.to_string_lossy();
        let name = flag.and_then(Arg::get_long).unwrap_or_default();
        let bounds = format!("{} to {}", self.0.start(), self.0.end());
        let refused = |why: String| Error::raw(ErrorKind::ValueValidation, why).with_cmd(command);
        let number: i128 = text
            .parse()
            .map_err(|_| refused(format!("--{name} = {text} is not a whole number, bounds {bounds}")))?;
        let within = u64::try_from(number).ok().filter(|number| self.0.contains(number));
        within.ok_or_else(|| refused(format!("--{name} = {text} is outside its bounds {bounds}")))
    }
}
