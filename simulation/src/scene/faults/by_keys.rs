//! The faults of a scene: those that keys set, one of each kind, then those that words set.

use motor_model::{DriveMode, Time};

use super::{CameraFault, DriveFault, Fault, FaultKind, MarkFault, VibrometerFault};
use crate::scene::Scene;

impl Scene {
    /// The faults of the scene. Of two that concern the same thing at the same time the first counts, unless their
    /// effects add up, as those of the drive do.
    pub fn faults(&self) -> Vec<Fault> {
        let mut faults = Vec::new();
        self.camera_faults(&mut faults);
        self.vibrometer_faults(&mut faults);
        self.motor_faults(&mut faults);
        faults.extend(self.fault_words().iter().copied());
        faults
    }

    fn at(&self, key: &'static str) -> Time {
        Time::from_nanos(self.nanos(key))
    }

    /// A fault between the times of two keys, if there is one and it has a length.
    fn add(&self, faults: &mut Vec<Fault>, kind: Option<FaultKind>, [from, until]: [&'static str; 2]) {
        let (from, until) = (self.at(from), self.at(until));
        faults.extend(kind.filter(|_| from < until).map(|kind| Fault { kind, from, until }));
    }

    fn camera_faults(&self, faults: &mut Vec<Fault>) {
        let lost = FaultKind::Camera(CameraFault::Lost);
        self.add(faults, Some(lost), ["camera.lost_from_s", "camera.lost_until_s"]);
        let offset_deg = self.number("camera.fault_offset_deg");
        let camera = match self.choice("camera.fault") {
            "stuck" => Some(CameraFault::Stuck),
            "zeros" => Some(CameraFault::Zeros),
            "offset" => Some(CameraFault::Offset(offset_deg)),
            _ => None,
        };
        self.add(faults, camera.map(FaultKind::Camera), ["camera.fault_from_s", "camera.fault_until_s"]);
        let further_m = self.number("camera.false_mark_m");
        let mark = match self.choice("camera.mark_fault") {
            "lost" => Some(MarkFault::Lost),
            "stuck" => Some(MarkFault::Stuck),
            "false" => Some(MarkFault::False(further_m)),
            "exchanged" => Some(MarkFault::Exchanged),
            _ => None,
        };
        // One of 16.
        let number = u8::try_from(self.integer("camera.faulty_mark")).unwrap_or(1);
        let mark = mark.map(|mark| FaultKind::Mark(number, mark));
        self.add(faults, mark, ["camera.mark_fault_from_s", "camera.mark_fault_until_s"]);
    }

    fn vibrometer_faults(&self, faults: &mut Vec<Fault>) {
        let lost = FaultKind::Vibrometer(VibrometerFault::Lost);
        self.add(faults, Some(lost), ["ldv.lost_from_s", "ldv.lost_until_s"]);
        let vibrometer = match self.choice("ldv.fault") {
            "stuck" => Some(VibrometerFault::Stuck),
            "zeros" => Some(VibrometerFault::Zeros),
            "inverted" => Some(VibrometerFault::Inverted),
            "not_a_number" => Some(VibrometerFault::NotANumber),
            _ => None,
        };
        self.add(faults, vibrometer.map(FaultKind::Vibrometer), ["ldv.fault_from_s", "ldv.fault_until_s"]);
    }

    /// Those of drive and motor, which all begin at one time.
    fn motor_faults(&self, faults: &mut Vec<Fault>) {
        let from = self.at("fault.from_s");
        let mut add = |is: bool, kind, until| faults.extend(is.then_some(Fault { kind, from, until }));
        let gain = self.number("fault.drive_gain");
        add(gain < 1.0, FaultKind::Drive(DriveFault::Weak(gain)), Fault::NEVER);
        add(self.choice("fault.modes") == "swapped", FaultKind::Drive(DriveFault::Swapped), Fault::NEVER);
        let dead = match self.choice("fault.dead_mode") {
            "b" => Some(DriveMode::B),
            "c" => Some(DriveMode::C),
            _ => None,
        };
        add(dead.is_some(), FaultKind::Drive(DriveFault::Dead(dead)), Fault::NEVER);
        let (percent, drift_nanos) = (self.number("fault.drift_percent"), self.nanos("fault.drift_s"));
        // A drift that takes no time is a step: it has no end.
        let until = if drift_nanos == 0 { Fault::NEVER } else { from.plus_nanos(drift_nanos) };
        add(percent.abs() > 0.0, FaultKind::Drift(percent), until);
        let jolt_rad_s = self.number("fault.jolt_rad_s");
        add(jolt_rad_s.abs() > 0.0, FaultKind::Jolt(jolt_rad_s), Fault::NEVER);
        add(self.choice("fault.rotor") == "stuck", FaultKind::Stuck, Fault::NEVER);
        let friction = self.number("fault.hub_friction");
        add(friction > 0.0, FaultKind::Rub(friction), Fault::NEVER);
    }
}
