//! The filters: their arithmetic, then their estimates beside the truth, with and without faults.

mod dual_covariance;
mod law_covariance_endurance;

mod law_camera_clock;
mod law_consistency;
mod law_shared_camera_errors;
mod law_stamp_errors;
mod law_tilting_rotor;
mod law_twin_learns;
mod law_windowed_errors;
mod law_worth_of_impacts;

mod law_camera_faults;
mod law_camera_reference;
mod law_faults_of_many_motors;
mod law_first_drive;
mod law_slow_and_late_cameras;
mod law_vibrometer_faults;
mod law_vibrometer_told_or_covered;
