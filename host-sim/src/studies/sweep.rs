//! Any run or study at many points, given by ranges and lists of keys: `host-sim sweep`.
//!
//! A point is a value for every key of the sweep. A row is one run at a point: point `p` with repeat `r` is row
//! `p R + r` of `R` repeats, and its seed is `r` after the scene's. So all points share their seeds, and differences
//! between points are those of the keys. A sweep over other seeds has the key `seed` among its own.
//!
//! | module | what it is |
//! |---|---|
//! | this one | the plan: point, scene and seed of a row, from its number |
//! | `axis` | one key and its values |
//! | `points` | grid, random numbers, Sobol sequence |
//! | `swept` | the commands, each a function from a scene to the JSON that it prints |
//! | `figure` | figures of merit by their paths in that JSON |
//! | `row` | one row: its figures, or why it has none |
//! | `ordered` | rows made on all threads, given out in the order of their numbers |
//! | `folder` | the files of a sweep: lock, journal, tables, manifest |
//! | `journal` | rows that are done, so that an interrupted sweep goes on |
//! | `tables` | rows as Parquet files |
//! | `indices` | which key decides: Sobol's indices of variance |
//! | `cost` | what it costs, by measured rows, on how many machines |
//! | `merge` | the parts of a sweep put together |
//! | `responses` | how figures follow keys: means over slices of their values |
//! | `summary`, `picture` | what is printed and drawn |
//!
//! # Memory
//!
//! Points follow from their numbers, rows go to the journal in their order, and tables are written in row groups. Only
//! rows that wait for an earlier one are held, at most `WAITING_MAX` of `ordered`.

mod axis;
mod cost;
mod error;
mod figure;
mod folder;
mod indices;
mod journal;
mod merge;
mod ordered;
mod picture;
mod points;
mod responses;
mod row;
mod summary;
mod swept;
mod tables;

use serde::Serialize;
use serde_json::{Map, Value, json};

pub use axis::{Axis, AxisValues};
pub use cost::SweepCost;
pub use error::SweepError;
pub use folder::{Existing, LockedFolder, SweepFolder};
pub use indices::{Index, KeyIndices};
pub use merge::merge;
pub use ordered::run as rows_in_order;
pub use points::Sampling;
use points::{Places, SOBOL_DIMENSIONS};
pub use responses::{Response, Slice};
pub use row::{Row, RowOutcome, makes_a_row};
use simulation::scene::{Admission, Scene};
pub use summary::SweepSummary;
pub use swept::SweptCommand;

/// What is swept, over which values, and what is kept of each run.
#[derive(Clone, Debug)]
pub struct SweepPlan {
    scene: Scene,
    /// Keys that the command reads.
    reads: fn(SweptCommand, &str) -> bool,
    /// The command that runs at each point.
    pub command: SweptCommand,
    /// Motors, or gyroscopes, of a study at each point.
    sample: u64,
    axes: Vec<Axis>,
    sampling: Sampling,
    places: Option<Places>,
    points: u64,
    repeats: u64,
    figures: Vec<String>,
}

/// What a plan is made of.
#[derive(Clone, Debug)]
pub struct SweepRequest {
    /// The command that runs at each point.
    pub command: SweptCommand,
    /// Motors, or gyroscopes, of a study at each point.
    pub sample: u64,
    /// Axes as text.
    pub over: Vec<String>,
    /// Where the points lie.
    pub sampling: Sampling,
    /// Runs of each point.
    pub repeats: u64,
    /// Paths of the figures of merit.
    pub figures: Vec<String>,
}

impl SweepPlan {
    /// The plan of `request` around `scene`; `reads` says whether the command reads a key, and `admit` why not.
    ///
    /// # Errors
    /// When an axis or a figure is refused, or axes and sampling do not go together.
    pub fn new(
        scene: &Scene,
        request: SweepRequest,
        reads: fn(SweptCommand, &str) -> bool,
        admit: Admission,
    ) -> Result<Self, SweepError> {
        let SweepRequest { command, sample, over, sampling, repeats, figures } = request;
        let axes: Vec<Axis> = over.iter().map(|text| Axis::parse(text, admit)).collect::<Result<_, _>>()?;
        let plan = |why: String, hint| SweepError::Plan { why, hint };
        if axes.is_empty() {
            return Err(plan("a sweep is over one key at least".to_owned(), "--over KEY=MIN..MAX names one"));
        }
        if let Some(twice) = axes
            .iter()
            .enumerate()
            .find(|(place, axis)| axes[..*place].iter().any(|other| other.key == axis.key))
        {
            return Err(plan(format!("{} is swept twice", twice.1.key), "name each key once"));
        }
        if repeats > 1 && axes.iter().any(|axis| axis.key == "seed") {
            return Err(plan(
                "the seed is swept, and --repeats sets it too".to_owned(),
                "leave one of the two out",
            ));
        }
        figures.iter().try_for_each(|path| figure::admit(path))?;
        let (points, places) = match sampling {
            Sampling::Grid => {
                let mut points = 1_u64;
                for axis in &axes {
                    let levels = axis.levels().ok_or_else(|| {
                        plan(
                            format!("a grid needs a count of values of {}", axis.key),
                            "--over KEY=MIN..MAX:COUNT gives one; --random N and --sobol N draw from ranges",
                        )
                    })?;
                    points = points.checked_mul(levels).ok_or_else(too_many)?;
                }
                (points, None)
            }
            Sampling::Random(points) => (points, Some(Places::random(scene.seed()))),
            Sampling::Sobol(points) if axes.len() <= SOBOL_DIMENSIONS => {
                (points, Some(Places::sobol(scene.seed(), axes.len())))
            }
            Sampling::Indices(base) if 2 * axes.len() <= SOBOL_DIMENSIONS => {
                let points = base.checked_mul(axes.len() as u64 + 2).ok_or_else(too_many)?;
                (points, Some(Places::sobol(scene.seed(), 2 * axes.len())))
            }
            Sampling::Indices(_) => {
                return Err(plan(
                    format!("indices here have {} keys at most", SOBOL_DIMENSIONS / 2),
                    "fix the keys that matter least",
                ));
            }
            Sampling::Sobol(_) => {
                return Err(plan(
                    format!("a Sobol sequence here has {SOBOL_DIMENSIONS} keys at most"),
                    "--random N has no such bound",
                ));
            }
        };
        points.checked_mul(repeats).ok_or_else(too_many)?;
        Ok(Self {
            scene: scene.clone(),
            reads,
            command,
            sample,
            axes,
            sampling,
            places,
            points,
            repeats,
            figures,
        })
    }

    /// The scene around which it is.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Rows in all.
    pub fn rows(&self) -> u64 {
        self.points * self.repeats
    }

    /// The keys that are swept, in order.
    pub fn keys(&self) -> impl Iterator<Item = &'static str> {
        self.axes.iter().map(|axis| axis.key)
    }

    /// The axes, in order.
    pub fn axes(&self) -> &[Axis] {
        &self.axes
    }

    /// Paths of the figures, in order.
    pub fn figures(&self) -> &[String] {
        &self.figures
    }

    /// Point and repeat of a row.
    pub(super) fn place_of(&self, row: u64) -> (u64, u64) {
        (row / self.repeats, row % self.repeats)
    }

    /// Values of a point as text, in the order of the axes.
    pub fn values(&self, point: u64) -> Vec<String> {
        if let Some(places) = &self.places {
            let place = match self.sampling {
                Sampling::Indices(_) => self.place_for_indices(places, point),
                _ => places.of(point, self.axes.len()),
            };
            return self.axes.iter().zip(place).map(|(axis, part)| axis.at(part)).collect();
        }
        // The last axis varies fastest.
        let mut rest = point;
        let mut values: Vec<String> = Vec::with_capacity(self.axes.len());
        for axis in self.axes.iter().rev() {
            let levels = axis.levels().unwrap_or(1);
            values.push(axis.level(rest % levels));
            rest /= levels;
        }
        values.reverse();
        values
    }

    /// Of each base point: `a`, `b`, and `a` with each coordinate of `b` in its turn.
    fn place_for_indices(&self, places: &Places, point: u64) -> Vec<f64> {
        let keys = self.axes.len();
        let of_base = keys as u64 + 2;
        let mut a = places.of(point / of_base, 2 * keys);
        let b = a.split_off(keys);
        match point % of_base {
            0 => a,
            1 => b,
            turn => {
                let key = usize::try_from(turn - 2).unwrap_or(0);
                a[key] = b[key];
                a
            }
        }
    }

    /// The scene of a point and a repeat.
    ///
    /// # Errors
    /// When a value is refused.
    pub fn scene_of(&self, values: &[String], repeat: u64) -> Result<Scene, SweepError> {
        let mut scene = self.scene.clone();
        for (axis, value) in self.axes.iter().zip(values) {
            scene.set(axis.key, value)?;
        }
        Ok(if repeat > 0 { scene.of_run(repeat)? } else { scene })
    }

    /// What two sweeps have in common that are parts of one: everything but the part.
    pub fn described(&self) -> Value {
        let swept: Vec<&str> = self.keys().collect();
        let scene: Map<String, Value> = simulation::scene::registry()
            .filter(|setting| (self.reads)(self.command, setting.key) && !swept.contains(&setting.key))
            .map(|setting| (setting.key.to_owned(), self.scene.value_json(setting.key)))
            .collect();
        json!({
            "version": env!("CARGO_PKG_VERSION"),
            "command": self.command,
            "sample": self.sample,
            "seed": self.scene.seed(),
            "over": self.axes,
            "sampling": self.sampling,
            "points": self.points,
            "repeats": self.repeats,
            "rows": self.rows(),
            "figures": self.figures,
            "scene": scene,
        })
    }
}

fn too_many() -> SweepError {
    SweepError::Plan {
        why: "these are more rows than can be counted".to_owned(),
        hint: "--random N and --sobol N make N points, however many keys there are",
    }
}

/// How many rows have failed, by why.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct FailureCounts {
    /// Scenes that were refused.
    pub refused: u64,
    /// Runs with a number that was not finite.
    pub diverged: u64,
    /// Slips in the program.
    pub panicked: u64,
    /// Results without one of the figures.
    pub no_figure: u64,
}
