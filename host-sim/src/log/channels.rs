//! The channels of an MCAP log, each with a message type in protobuf.
//!
//! A type is written down once, here: the macro makes of it the struct that is encoded and the description by which
//! Foxglove, `PlotJuggler` and Python's readers decode it. Names end in their unit. An angle stands twice: in degrees
//! for people, in units of 2^-32 turn to the last bit.
//!
//! Every field is written, also where it is zero: a field left out stands for zero, and the sign of a zero would be
//! lost.
//!
//! A message has the time of what it shows: a frame that of the middle of its exposure, a sample that at which it was
//! taken. When the loop took it in says `arrived_after_ns`, counted from that time. The messages of a log stand in the
//! order in which the loop took them in, tick by tick, those of a tick in the order of [`CHANNELS`].

use motor_model::{DriveCommand, DriveMode};
use prost::Message;
use prost_types::field_descriptor_proto::{Label, Type};
use prost_types::{DescriptorProto, FieldDescriptorProto, FileDescriptorProto, FileDescriptorSet};

/// Name, number and type of a field.
pub(super) type Field = (&'static str, &'static str, Type);

/// A message type that describes itself.
pub(super) trait Described: Message + Default {
    /// Name without package.
    const NAME: &'static str;
    /// Place of its channel among [`CHANNELS`], which have the order of the messages.
    const PLACE: usize;
    /// Fields.
    const FIELDS: &'static [Field];
}

macro_rules! rust_type {
    (double) => {
        f64
    };
    (float) => {
        f32
    };
    (sfixed64) => {
        i64
    };
    (sint64) => {
        i64
    };
    (uint32) => {
        u32
    };
    (bool) => {
        bool
    };
    (string) => {
        String
    };
}

macro_rules! wire_type {
    (double) => {
        Type::Double
    };
    (float) => {
        Type::Float
    };
    (sfixed64) => {
        Type::Sfixed64
    };
    (sint64) => {
        Type::Sint64
    };
    (uint32) => {
        Type::Uint32
    };
    (bool) => {
        Type::Bool
    };
    (string) => {
        Type::String
    };
}

macro_rules! messages {
    ($($(#[doc = $about:tt])+ $name:ident {
        $($(#[doc = $meaning:tt])+ $kind:ident $field:ident = $number:tt;)+
    })+) => {
        /// The messages in order.
        #[derive(Clone, Copy)]
        enum Place { $($name,)+ }

        $(
            $(#[doc = $about])+
            #[derive(Clone, PartialEq, Message)]
            #[allow(clippy::struct_field_names, reason = "a field is named as in the log, with its unit")]
            pub struct $name {
                $($(#[doc = $meaning])+ #[prost($kind, required, tag = $number)] pub $field: rust_type!($kind),)+
            }

            impl Described for $name {
                const NAME: &'static str = stringify!($name);
                const PLACE: usize = Place::$name as usize;
                const FIELDS: &'static [Field] =
                    &[$((stringify!($field), $number, wire_type!($kind)),)+];
            }
        )+
    };
}

messages! {
    /// An impact of the rotor, which only the simulation knows.
    Impact {
        /// Vertical velocity before.
        double velocity_before_m_s = "1";
        /// Vertical velocity after.
        double velocity_after_m_s = "2";
        /// Rate before.
        double rate_before_rad_s = "3";
        /// Rate after.
        double rate_after_rad_s = "4";
    }
    /// A vibrometer sample.
    VibrometerSample {
        /// Vertical velocity, upwards positive.
        float velocity_m_s = "1";
        /// From the sample to the end of the tick that took it in.
        sint64 arrived_after_ns = "2";
    }
    /// A camera frame.
    CameraFrame {
        /// Angle within the turn, clockwise positive.
        double angle_deg = "1";
        /// The same in units of 2^-32 turn.
        sfixed64 angle_units = "2";
        /// Marks used; 0 stands for all.
        uint32 marks_used = "3";
        /// From the middle of its exposure to the end of the tick that took it in.
        sint64 arrived_after_ns = "4";
        /// Root of the mean square of the marks' residuals, in steps of 0.1 um; 0 if the camera does not tell.
        uint32 residual_steps = "5";
    }
    /// What the marks of a frame showed.
    Marks {
        /// Angle within the turn.
        double angle_deg = "1";
        /// Its standard deviation.
        double angle_sd_deg = "2";
        /// Shift of the rotor's face along x.
        double shift_x_m = "3";
        /// Shift along y.
        double shift_y_m = "4";
        /// Root of the mean square of the residuals.
        double residual_m = "5";
        /// Marks used.
        uint32 marks_used = "6";
    }
    /// What became of a frame.
    Innovation {
        /// Measurement less prediction; 0 when nothing was predicted.
        float innovation_rad = "1";
        /// Variance predicted for it; 0 when nothing was predicted.
        float variance_rad2 = "2";
        /// Innovation squared over its variance; NaN when nothing was predicted.
        float normalised_squared = "3";
        /// Used, Restarted, or Rejected with the reason.
        string verdict = "4";
        /// Whether the frame was used.
        bool used = "5";
        /// From the middle of its exposure to the end of the tick that took it in.
        sint64 arrived_after_ns = "6";
    }
    /// The rotor as it truly is.
    Truth {
        /// Angle as seen from above, clockwise positive.
        double angle_deg = "1";
        /// The same in units of 2^-32 turn.
        sfixed64 angle_units = "2";
        /// Angle that a gyroscope on the rotor turns by.
        double own_axis_angle_deg = "3";
        /// Rate.
        double rate_rad_s = "4";
        /// Height above that of a rotor at rest.
        double height_m = "5";
        /// Vertical velocity, upwards positive.
        double velocity_m_s = "6";
    }
    /// Tilt and shift of a rotor that tilts.
    Tilt {
        /// Slope along x.
        double slope_x = "1";
        /// Slope along y.
        double slope_y = "2";
        /// Shift of the mass centre along x.
        double shift_x_m = "3";
        /// Shift along y.
        double shift_y_m = "4";
        /// Angle of the rotor's axis from the vertical.
        double tilt_mrad = "5";
    }
    /// The estimate with its covariance.
    Estimate {
        /// Angle, clockwise positive.
        double angle_deg = "1";
        /// The same in units of 2^-32 turn.
        sfixed64 angle_units = "2";
        /// Rate.
        float rate_rad_s = "3";
        /// Variance of the angle.
        float angle_rad2 = "4";
        /// Covariance of angle and rate.
        float angle_rate_rad2_s = "5";
        /// Variance of the rate.
        float rate_rad2_s2 = "6";
        /// Whether the rotor lies still.
        bool resting = "7";
        /// Standard deviation of the angle.
        double angle_sd_mdeg = "8";
        /// Estimated less true angle; NaN where the truth is not known.
        double error_mdeg = "9";
        /// From the instant that the estimate is of to the end of the tick.
        sint64 age_ns = "10";
    }
    /// The rate asked for.
    Reference {
        /// Rate asked for.
        float wanted_rad_s = "1";
        /// Angle that the rotor should have; NaN before the first usable estimate.
        double angle_deg = "2";
    }
    /// The health of the estimate, when it changes.
    Health {
        /// Good, Waiting, or Degraded or Unusable with the reason.
        string health = "1";
        /// 0 good, 1 degraded, 2 unusable, 3 waiting.
        uint32 level = "2";
    }
    /// What the controller does, when it changes.
    Task {
        /// Phase of a move, `Rate` of a held rate, `Stopped` with the reason of either, `None` without a controller.
        string phase = "1";
    }
    /// The drive, when it changes: it holds from then on.
    Drive {
        /// Mode applied: off, B or C.
        string mode = "1";
        /// Amplitude applied, of full drive.
        float amplitude = "2";
        /// Offset from the frequency of the mode.
        float frequency_offset_hz = "3";
        /// Mode that the controller asked for.
        string asked_mode = "4";
        /// Amplitude that it asked for.
        float asked_amplitude = "5";
    }
}

impl Drive {
    /// The command; `None` if there is no such command.
    pub fn command(&self) -> Option<DriveCommand> {
        let mode = match self.mode.as_str() {
            "off" => return Some(DriveCommand::OFF),
            "B" => DriveMode::B,
            "C" => DriveMode::C,
            _ => return None,
        };
        DriveCommand::try_new(mode, self.amplitude).ok()?.with_frequency_offset(self.frequency_offset_hz).ok()
    }
}

/// A channel.
#[derive(Clone, Copy, Debug)]
pub struct Channel {
    /// Its topic.
    pub topic: &'static str,
    /// Name of its message type, without package.
    pub message: &'static str,
    fields: &'static [Field],
}

/// The package of the message types.
const PACKAGE: &str = "micromotor";

const fn channel<M: Described>(topic: &'static str) -> Channel {
    Channel { topic, message: M::NAME, fields: M::FIELDS }
}

/// All channels.
pub const CHANNELS: [Channel; 12] = [
    channel::<Impact>("/truth/impact"),
    channel::<VibrometerSample>("/vibrometer"),
    channel::<CameraFrame>("/camera"),
    channel::<Marks>("/camera/marks"),
    channel::<Innovation>("/innovation"),
    channel::<Truth>("/truth"),
    channel::<Tilt>("/truth/tilt"),
    channel::<Estimate>("/estimate"),
    channel::<Reference>("/reference"),
    channel::<Health>("/health"),
    channel::<Task>("/phase"),
    channel::<Drive>("/drive"),
];

impl Channel {
    /// Name of its message type, with package.
    pub fn schema_name(&self) -> String {
        format!("{PACKAGE}.{}", self.message)
    }

    /// The description of its message type: an encoded `FileDescriptorSet`.
    pub fn schema(&self) -> Vec<u8> {
        let field = |&(name, number, kind): &Field| FieldDescriptorProto {
            name: Some(name.to_owned()),
            json_name: Some(name.to_owned()),
            number: number.parse().ok(),
            label: Some(Label::Optional.into()),
            r#type: Some(kind.into()),
            ..FieldDescriptorProto::default()
        };
        let message = DescriptorProto {
            name: Some(self.message.to_owned()),
            field: self.fields.iter().map(field).collect(),
            ..DescriptorProto::default()
        };
        let file = FileDescriptorProto {
            name: Some(format!("{PACKAGE}/{}.proto", self.message)),
            package: Some(PACKAGE.to_owned()),
            syntax: Some("proto3".to_owned()),
            message_type: vec![message],
            ..FileDescriptorProto::default()
        };
        FileDescriptorSet { file: vec![file] }.encode_to_vec()
    }
}
