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
use std::path::{Path, PathBuf};

use estimator::Health;
use mcap::records::MessageHeader;
use mcap::{McapError, WriteOptions, Writer};
use motor_model::{Angle, DriveCommand, Time, math};

use super::channels::{self, CHANNELS, Described};
use super::error::LogError;
use super::held_file::{HeldFile, SharedFile, refusal};
use super::recorder::LogOptions;
use super::{RecordWriter, Stated};
use crate::runs::record::{RunRecord, Task, health_level, mode_word, verdict_word};

/// Version of the channels and of what they mean.
pub(super) const FORMAT: &str = "1";

/// Bytes of a chunk, about.
const CHUNK_BYTES: u64 = 1 << 20;
/// The messages of one tick and the heads of a chunk, at most.
const TICK_BYTES: u64 = 1 << 14;
/// What a message takes beside its content: its record, and its place in the index.
const MESSAGE_BYTES: u64 = 31 + 16;
/// What the end of the file takes: the summary, without the places of the chunks.
const END_BYTES: u64 = 1 << 16;
/// The place of a chunk in the summary: offsets of its channels.
const CHUNK_PLACE_BYTES: u64 = 512;

/// The writer.
pub(super) struct McapLog {
    writer: Writer<SharedFile>,
    file: SharedFile,
    path: PathBuf,
    channel_ids: [u16; CHANNELS.len()],
    sequence: u32,
    content: Vec<u8>,
    chunk_bytes: u64,
    chunks: u64,
    every: u64,
    ticks: u64,
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
        let first_bytes = CHUNK_BYTES + TICK_BYTES + 2 * END_BYTES + stated.scene.len() as u64;
        file.hold(first_bytes).map_err(|source| refusal(&path, source))?;
        let file = SharedFile::new(file);
        let refused = |error| of_mcap(&path, error);
        let mut writer = WriteOptions::new()
            .profile("host-sim")
            .library(concat!("host-sim ", env!("CARGO_PKG_VERSION")))
            .compression(None)
            // Chunks are ended here, where there is room for the next one.
            .chunk_size(None)
            .disable_seeking(true)
            .calculate_data_section_crc(false)
            .create(file.clone())
            .map_err(refused)?;
        let facts = stated.facts(options);
        let metadata = mcap::records::Metadata { name: "host-sim".to_owned(), metadata: facts };
        writer.write_metadata(&metadata).map_err(refused)?;
        attach(&mut writer, "scene.toml", "application/toml", &stated.scene).map_err(refused)?;
        let mut channel_ids = [0; CHANNELS.len()];
        for (channel, id) in CHANNELS.iter().zip(&mut channel_ids) {
            let schema = writer.add_schema(&channel.schema_name(), "protobuf", &channel.schema());
            let schema = schema.map_err(refused)?;
            *id = writer.add_channel(schema, channel.topic, "protobuf", &BTreeMap::new()).map_err(refused)?;
        }
        Ok(Self {
            writer,
            file,
            path,
            channel_ids,
            sequence: 0,
            content: Vec::with_capacity(256),
            chunk_bytes: 0,
            chunks: 0,
            every: options.every,
            ticks: 0,
            health: None,
            phase: String::new(),
            drive: None,
            until: Time::ZERO,
        })
    }

    fn message<M: Described>(&mut self, at: Time, message: &M) -> Result<(), LogError> {
        self.content.clear();
        // A vector takes every message.
        message.encode(&mut self.content).map_err(|error| LogError::Format(error.to_string()))?;
        self.chunk_bytes += MESSAGE_BYTES + self.content.len() as u64;
        self.sequence = self.sequence.wrapping_add(1);
        let header = MessageHeader {
            channel_id: self.channel_ids.get(M::PLACE).copied().unwrap_or_default(),
            sequence: self.sequence,
            log_time: at.nanos(),
            publish_time: at.nanos(),
        };
        self.writer.write_to_known_channel(&header, &self.content).map_err(|error| of_mcap(&self.path, error))
    }

    /// Ends a chunk that is full, once there is room for the next one.
    fn end_chunk(&mut self) -> Result<(), LogError> {
        self.writer.flush().map_err(|error| of_mcap(&self.path, error))?;
        self.chunks += 1;
        self.chunk_bytes = 0;
        let bytes = CHUNK_BYTES + TICK_BYTES + END_BYTES + CHUNK_PLACE_BYTES * (self.chunks + 1);
        self.file.lock().hold(bytes).map_err(|source| refusal(&self.path, source))
    }

    fn measurements(&mut self, record: &RunRecord) -> Result<(), LogError> {
        for impact in record.impacts {
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
        for sample in record.ldv_samples {
            let arrived_after_ns = nanos_between(sample.taken_at, record.at);
            self.message(
                sample.taken_at,
                &channels::VibrometerSample { velocity_m_s: sample.velocity_m_s, arrived_after_ns },
            )?;
        }
        let Some(frame) = record.camera_frame else { return Ok(()) };
        let arrived_after_ns = nanos_between(frame.exposed_at, record.at);
        self.message(
            frame.exposed_at,
            &channels::CameraFrame {
                angle_deg: frame.angle.degrees(),
                angle_units: frame.angle.units(),
                marks_used: frame.marks_used.into(),
                arrived_after_ns,
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
        if let Task::Rate { wanted_rad_s, reference } = record.task {
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
    fn write(&mut self, record: &RunRecord) -> Result<(), LogError> {
        self.measurements(record)?;
        if self.ticks.is_multiple_of(self.every) {
            self.truth_and_estimate(record)?;
        }
        self.ticks += 1;
        self.changes(record)?;
        self.until = record.at;
        if self.chunk_bytes >= CHUNK_BYTES { self.end_chunk() } else { Ok(()) }
    }

    /// There is room for it already.
    fn last_block(&mut self) -> Result<(), LogError> {
        Ok(())
    }

    fn until(&self) -> Time {
        self.until
    }

    fn close(self: Box<Self>, ended: &str, result: Option<&str>) -> Result<HeldFile, LogError> {
        let Self { mut writer, file, path, .. } = *self;
        let refused = |error| of_mcap(&path, error);
        if let Some(result) = result {
            attach(&mut writer, "result.json", "application/json", result).map_err(refused)?;
        }
        let metadata = BTreeMap::from([("ended".to_owned(), ended.to_owned())]);
        let metadata = mcap::records::Metadata { name: "end".to_owned(), metadata };
        writer.write_metadata(&metadata).map_err(refused)?;
        writer.finish().map_err(refused)?;
        drop(writer.into_inner());
        file.into_inner()
    }
}

fn attach(
    writer: &mut Writer<SharedFile>,
    name: &str,
    media_type: &str,
    text: &str,
) -> Result<(), McapError> {
    writer.attach(&mcap::Attachment {
        log_time: 0,
        create_time: 0,
        name: name.to_owned(),
        media_type: media_type.to_owned(),
        data: text.as_bytes().into(),
    })
}

fn of_mcap(path: &Path, error: McapError) -> LogError {
    match error {
        McapError::Io(source) => refusal(path, source),
        other => LogError::Format(other.to_string()),
    }
}

/// From one instant to another in ns; negative if the second is earlier.
fn nanos_between(from: Time, to: Time) -> i64 {
    to.nanos().wrapping_sub(from.nanos()).cast_signed()
}
