//! Records into an MCAP file: chunks without compression, an index, and the scene beside the messages.
//!
//! | part | content |
//! |---|---|
//! | header | profile `host-sim` |
//! | metadata `host-sim` | version of the format and of the program, command, seed, filter, ticks |
//! | attachment `scene.toml` | the effective scene: what was set, from wherever |
//! | chunks | messages of [`CHANNELS`] |
//! | attachment `result.json` | what the run gave, if it ended |
//! | metadata `end` | how it ended |

use std::collections::BTreeMap;
use std::io;
use std::path::PathBuf;

use estimator::{Health, LdvSample};
use motor_model::{Angle, DriveCommand, Time, math};

use super::channels::{self, CHANNELS, Described};
use super::error::LogError;
use super::held_file::{HeldFile, refusal};
use super::mcap_file::McapFile;
use super::options::LogOptions;
use super::{RecordWriter, Stated};
use simulation::runs::record::{Impact, RunRecord, Task, health_level, mode_word, verdict_word};

/// Version of the channels and of what they mean.
pub(super) const FORMAT: &str = "1";

/// Bytes of a chunk, about.
const CHUNK_BYTES: usize = 1 << 20;
/// The messages of one tick and the heads of a chunk, at most.
const TICK_BYTES: u64 = 1 << 14;
/// What the end of the file takes: the summary, without the places of the chunks.
const END_BYTES: u64 = 1 << 16;
/// The place of a chunk in the summary: offsets of its channels.
const CHUNK_PLACE_BYTES: u64 = 512;

/// The writer.
pub(super) struct McapLog {
    file: McapFile<HeldFile>,
    path: PathBuf,
    chunk_bytes: usize,
    chunks: u64,
    health: Option<Health>,
    phase: String,
    drive: Option<(DriveCommand, DriveCommand)>,
    until: Time,
}

impl McapLog {
    /// Begins the log of a run.
    ///
    /// # Errors
    /// When there is no room, or the system refuses it.
    pub(super) fn create(mut file: HeldFile, stated: &Stated, options: LogOptions) -> Result<Self, LogError> {
        let path = file.destination().to_owned();
        let first_bytes = CHUNK_BYTES as u64 + TICK_BYTES + 2 * END_BYTES + stated.scene.len() as u64;
        let begun = || {
            file.hold(first_bytes)?;
            let mut file =
                McapFile::create(file, "host-sim", concat!("host-sim ", env!("CARGO_PKG_VERSION")))?;
            file.metadata("host-sim", stated.facts(options))?;
            file.attachment("scene.toml", "application/toml", &stated.scene)?;
            for channel in &CHANNELS {
                file.channel(channel.topic, &channel.schema_name(), &channel.schema())?;
            }
            Ok(file)
        };
        Ok(Self {
            file: begun().map_err(|source| refusal(&path, source))?,
            path,
            chunk_bytes: 0,
            chunks: 0,
            health: None,
            phase: String::new(),
            drive: None,
            until: Time::ZERO,
        })
    }

    fn refused(&self, source: io::Error) -> LogError {
        refusal(&self.path, source)
    }

    fn message<M: Described>(&mut self, at: Time, message: &M) -> Result<(), LogError> {
        let bytes = self.file.message(M::PLACE, at, message).map_err(|source| self.refused(source))?;
        self.chunk_bytes += bytes;
        Ok(())
    }

    /// Ends a chunk that is full, once there is room for the next one.
    fn end_chunk(&mut self) -> Result<(), LogError> {
        self.chunks += 1;
        self.chunk_bytes = 0;
        let bytes = CHUNK_BYTES as u64 + TICK_BYTES + END_BYTES + CHUNK_PLACE_BYTES * (self.chunks + 1);
        let written = self.file.end_chunk().and_then(|()| self.file.file().hold(bytes));
        written.map_err(|source| self.refused(source))
    }

    fn impacts_and_samples(
        &mut self,
        at: Time,
        impacts: &[Impact],
        samples: &[LdvSample],
    ) -> Result<(), LogError> {
        for impact in impacts {
            let [velocity_before_m_s, velocity_after_m_s] = impact.velocity_m_s;
            let [rate_before_rad_s, rate_after_rad_s] = impact.rate_rad_s;
            self.message(
                impact.at,
                &channels::Impact {
                    velocity_before_m_s,
                    velocity_after_m_s,
                    rate_before_rad_s,
                    rate_after_rad_s,
                },
            )?;
        }
        for sample in samples {
            let arrived_after_ns = nanos_between(sample.taken_at, at);
            self.message(
                sample.taken_at,
                &channels::VibrometerSample { velocity_m_s: sample.velocity_m_s, arrived_after_ns },
            )?;
        }
        Ok(())
    }

    fn frame(&mut self, record: &RunRecord) -> Result<(), LogError> {
        let Some(frame) = record.camera_frame else { return Ok(()) };
        let arrived_after_ns = nanos_between(frame.exposed_at, record.at);
        self.message(
            frame.exposed_at,
            &channels::CameraFrame {
                angle_deg: frame.angle.degrees(),
                angle_units: frame.angle.units(),
                marks_used: frame.marks_used.into(),
                arrived_after_ns,
                residual_steps: frame.residual.into(),
            },
        )?;
        if let Some(marked) = record.marked {
            let [shift_x_m, shift_y_m] = marked.shift_m;
            self.message(
                frame.exposed_at,
                &channels::Marks {
                    angle_deg: marked.angle.degrees(),
                    angle_sd_deg: marked.angle_sd_rad.to_degrees(),
                    shift_x_m,
                    shift_y_m,
                    residual_m: marked.residual_m,
                    marks_used: marked.marks_used.into(),
                },
            )?;
        }
        let Some(innovation) = record.innovation else { return Ok(()) };
        self.message(
            innovation.taken_at,
            &channels::Innovation {
                innovation_rad: innovation.innovation_rad,
                variance_rad2: innovation.variance_rad2,
                normalised_squared: innovation.normalised_squared().unwrap_or(f32::NAN),
                verdict: verdict_word(&innovation).into_owned(),
                used: !record.is_refused(),
                arrived_after_ns: nanos_between(innovation.taken_at, record.at),
            },
        )
    }

    fn truth_and_estimate(&mut self, record: &RunRecord) -> Result<(), LogError> {
        let at = record.at;
        if let Some(truth) = record.truth {
            self.message(
                at,
                &channels::Truth {
                    angle_deg: truth.angle.degrees(),
                    angle_units: truth.angle.units(),
                    own_axis_angle_deg: truth.own_axis_angle.degrees(),
                    rate_rad_s: truth.rate_rad_s,
                    height_m: truth.height_m,
                    velocity_m_s: truth.velocity_m_s,
                },
            )?;
            if let Some(tilt) = truth.tilt {
                let ([slope_x, slope_y], [shift_x_m, shift_y_m]) = (tilt.pose.slope, tilt.pose.shift_m);
                let tilt_mrad = 1e3 * tilt.pose.tilt_rad();
                self.message(at, &channels::Tilt { slope_x, slope_y, shift_x_m, shift_y_m, tilt_mrad })?;
            }
        }
        if let Some(estimate) = record.estimate {
            let sd_rad = math::sqrt(f64::from(estimate.angle_rad2));
            self.message(
                at,
                &channels::Estimate {
                    angle_deg: estimate.angle.degrees(),
                    angle_units: estimate.angle.units(),
                    rate_rad_s: estimate.rate_rad_s,
                    angle_rad2: estimate.angle_rad2,
                    angle_rate_rad2_s: estimate.angle_rate_rad2_s,
                    rate_rad2_s2: estimate.rate_rad2_s2,
                    resting: estimate.resting,
                    angle_sd_mdeg: 1e3 * sd_rad.to_degrees(),
                    error_mdeg: record.error_mdeg().unwrap_or(f64::NAN),
                    age_ns: nanos_between(estimate.at, at),
                },
            )?;
        }
        if let Task::Rate { wanted_rad_s, reference, .. } = record.task {
            let angle_deg = reference.map_or(f64::NAN, Angle::degrees);
            self.message(at, &channels::Reference { wanted_rad_s, angle_deg })?;
        }
        Ok(())
    }

    fn changes(&mut self, record: &RunRecord) -> Result<(), LogError> {
        let at = record.at;
        if self.health != Some(record.health) {
            self.health = Some(record.health);
            let health = format!("{:?}", record.health);
            self.message(at, &channels::Health { health, level: health_level(record.health).into() })?;
        }
        let phase = record.task.word();
        if self.phase != phase {
            self.phase = phase.into_owned();
            self.message(at, &channels::Task { phase: self.phase.clone() })?;
        }
        let drive = (record.applied, record.asked);
        if self.drive != Some(drive) {
            self.drive = Some(drive);
            let (applied, asked) = drive;
            self.message(
                at,
                &channels::Drive {
                    mode: mode_word(applied).to_owned(),
                    amplitude: applied.amplitude(),
                    frequency_offset_hz: applied.frequency_offset_hz(),
                    asked_mode: mode_word(asked).to_owned(),
                    asked_amplitude: asked.amplitude(),
                },
            )?;
        }
        Ok(())
    }
}

impl RecordWriter for McapLog {
    fn write_samples(&mut self, at: Time, impacts: &[Impact], samples: &[LdvSample]) -> Result<(), LogError> {
        if self.chunk_bytes >= CHUNK_BYTES {
            self.end_chunk()?;
        }
        self.until = at;
        self.impacts_and_samples(at, impacts, samples)
    }

    fn write_tick(&mut self, record: &RunRecord, logged: bool) -> Result<(), LogError> {
        self.frame(record)?;
        if logged {
            self.truth_and_estimate(record)?;
        }
        self.changes(record)
    }

    /// There is room for it already.
    fn last_block(&mut self) -> Result<(), LogError> {
        Ok(())
    }

    fn until(&self) -> Time {
        self.until
    }

    fn close(self: Box<Self>, ended: &str, result: Option<&str>) -> Result<HeldFile, LogError> {
        let Self { mut file, path, .. } = *self;
        let ended = || {
            if let Some(result) = result {
                file.attachment("result.json", "application/json", result)?;
            }
            file.metadata("end", BTreeMap::from([("ended".to_owned(), ended.to_owned())]))?;
            file.finish()
        };
        ended().map_err(|source| refusal(&path, source))
    }
}

/// From one instant to another in ns; negative if the second is earlier.
fn nanos_between(from: Time, to: Time) -> i64 {
    to.nanos().wrapping_sub(from.nanos()).cast_signed()
}
