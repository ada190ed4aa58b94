//! Every key of a scene, one table for each thing that it describes.

pub mod board;
#[cfg(feature = "gyroscope")]
pub mod calibrate;
pub mod camera;
pub mod estimator;
pub mod faults;
#[cfg(feature = "gyroscope")]
pub mod gyroscope;
pub mod jog;
pub mod limits;
pub mod plant;
pub mod position;
pub mod rate;
pub mod record;
pub mod run;
pub mod simulate;
pub mod stator;
pub mod vibrometer;

/// What the tables of a scene file describe.
pub const TABLE_TITLES: &[(&str, &str)] = &[
    ("motor", "The design of the motor: Table 1 of the paper. Filters, drive and response map follow it."),
    ("motor.hub", "Hole and pin, of a rotor that tilts (plant.rotor)."),
    ("motor.stator_tilt", "The stator's tilting modes, of a rotor that tilts (plant.rotor)."),
    ("stator", "The drawing of a stator, from which finite elements make its modes: the command stator."),
    ("simulate", "One run of the nominal motor in open loop: the command simulate."),
    ("plant", "The motor of every command but simulate: drawn around the design by the seed."),
    ("plant.tolerance.motor", "How far true motors are from their design, as host-sim identify found it."),
    ("plant.motor", "What the true motor has beside its design. What is not set here is drawn."),
    ("camera", "The camera, and what is wrong with it."),
    ("ldv", "The laser-Doppler vibrometer, and what is wrong with it."),
    #[cfg(feature = "gyroscope")]
    ("gyroscope", "The gyroscope that calibrate puts on the rotor."),
    ("fault", "Faults of drive and motor."),
    ("estimator", "The filter of angle and rate."),
    ("estimator.assumed.camera", "The camera as the filters assume it."),
    ("estimator.assumed.ldv", "The vibrometer as the filters assume it."),
    ("board", "The processor of the loop."),
    ("position", "A move to an angle."),
    ("rate", "A rate that is held, or a profile of rates."),
    ("limits", "Limits that a move, a rate and experiments keep."),
    ("run", "A move or a rate on a real board."),
    ("jog", "A drive by hand, on a real board."),
    ("record", "A recording in open loop: which drives, one after the other."),
    ("calibrate", "The plan of a calibration."),
];
