//! What the instruments of a recording delivered.

use std::ops::ControlFlow;

use motor_model::{Angle, Time};

use simulation::runs::RunError;
use simulation::runs::record::RunRecord;
use simulation::runs::recording::{DriveCourse, run_course};
use simulation::scene::Scene;

/// A camera frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Middle of its exposure.
    pub at_s: f64,
    /// Angle since the first frame, clockwise positive, over all turns.
    pub angle_rad: f64,
    /// Shift of the face and root of the mean square of the residuals, of several marks.
    pub marks_m: Option<([f64; 2], f64)>,
}

/// What the instruments delivered.
#[derive(Clone, Debug, Default)]
pub struct Measured {
    /// Instants of the vibrometer samples.
    pub at_s: Vec<f64>,
    /// The samples.
    pub velocity_m_s: Vec<f64>,
    /// The frames, in the order of their exposures.
    pub frames: Vec<Frame>,
    last: Option<Angle>,
}

fn seconds(at: Time) -> f64 {
    at.seconds_since(Time::ZERO)
}

impl Measured {
    /// Takes a sample of the vibrometer.
    pub fn sample(&mut self, at: Time, velocity_m_s: f32) {
        self.at_s.push(seconds(at));
        self.velocity_m_s.push(velocity_m_s.into());
    }

    /// Takes a frame; one that is exposed before the last one, or twice, is left out.
    pub fn frame(&mut self, at: Time, angle: Angle) {
        let before = self.frames.last().map_or((f64::NEG_INFINITY, 0.0), |last| (last.at_s, last.angle_rad));
        let at_s = seconds(at);
        if at_s <= before.0 {
            return;
        }
        // A code is an angle within the turn: a rotor turns less than half a turn from one frame to the next.
        let turned = self.last.map_or(0.0, |last| angle.minus(last).degrees());
        let turned = turned - 360.0 * (turned / 360.0).round();
        self.frames.push(Frame { at_s, angle_rad: before.1 + turned.to_radians(), marks_m: None });
        self.last = Some(angle);
    }

    /// Takes shift and residual of the marks of the frame that was exposed at `at`, if it is the last one.
    pub fn marks(&mut self, at: Time, shift_m: [f64; 2], residual_m: f64) {
        let last = self.frames.last_mut().filter(|last| last.at_s.to_bits() == seconds(at).to_bits());
        if let Some(last) = last {
            last.marks_m = Some((shift_m, residual_m));
        }
    }

    fn add(&mut self, record: &RunRecord) {
        for sample in record.ldv_samples {
            self.sample(sample.taken_at, sample.velocity_m_s);
        }
        if let Some(frame) = record.camera_frame {
            self.frame(frame.exposed_at, frame.angle);
            if let Some(marked) = record.marked {
                self.marks(frame.exposed_at, marked.shift_m, marked.residual_m);
            }
        }
    }

    /// What the instruments of `scene` deliver of its motor under `course`.
    ///
    /// # Errors
    /// When the scene is refused.
    pub fn of_motor(scene: &Scene, course: &DriveCourse) -> Result<Self, RunError> {
        let mut measured = Self::default();
        // Nothing ends it early.
        let _whole = run_course(scene, course, &mut |record| {
            measured.add(record);
            ControlFlow::Continue(())
        })?;
        Ok(measured)
    }
}
