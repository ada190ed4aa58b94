//! Whether the track takes the kicks of the impacts, or wanders as by the camera alone.
//!
//! Two kinds of evidence show a rotor whose kicks are not those of the model, since it tilts: impacts at heights that
//! no tooth reaches ([`super::impact_heights`]), or frames that pull the estimate one way
//! ([`crate::filters::kick_use`]).

use motor_model::{Real, Time};

use super::ImpactAided;

impl<T: Real> ImpactAided<T> {
    /// Decides at `now` whether kicks are taken, which frames or impacts have contradicted or not.
    pub(super) fn review_kick_use(&mut self, now: Time, contradicted: bool) {
        let driven = self.watch.applied.mode().is_some();
        if contradicted && driven && self.kick_use.taken && !self.detector.has_fault() {
            self.kick_use.contradict(now);
        }
        let taken = !driven || self.kick_use.allows(now);
        if self.kick_use.set(taken, now) {
            self.resume_detection(now);
        }
    }
}

#[cfg(test)]
mod tests {
    use heapless::Deque;
    use motor_model::{Angle, DriveCommand, DriveMode, Motor, MotorParams, MotorSetup, MotorState, math};
    use rand_distr::{Distribution as _, StandardNormal};
    use rand_pcg::Pcg64;
    use rand_pcg::rand_core::SeedableRng as _;

    use super::*;
    use crate::filter::{AngleFilter as _, Health, Reason};
    use crate::filters::impact_aided::tests::driven;
    use crate::filters::kick_use::KickUse;
    use crate::measurement::{CameraFrame, LdvSample};

    /// Under the drive a rotor that is struck 80 um above the last impact each time: from the second such impact on no
    /// kicks are taken, and the health says so. Without drive they are.
    #[test]
    fn exact_no_kicks_are_taken_of_a_rotor_that_tilts() {
        let mut filter = driven::<f64>(DriveMode::B);
        let mut shown_after = None;
        for n in 0..2000_u64 {
            let at = Time::from_micros(5 * (n + 1));
            // Up with 50 mm/s for 2 ms: after it 30 mm/s are left, and it is struck again.
            let velocity_m_s = (0.05 - 9.81 * 5e-6 * (n % 400) as f64) as f32;
            filter.update_ldv(&LdvSample { taken_at: at, velocity_m_s });
            if n % 20 == 0 {
                filter.update_camera(&CameraFrame::new(at, Angle::from_degrees(1e-3 * n as f64)));
            }
            if shown_after.is_none() && filter.health(at) == Health::Degraded(Reason::ImpactsUnexplained) {
                shown_after = Some(n / 400);
            }
        }
        assert_eq!(shown_after, Some(3));
        assert!(!filter.kick_use.taken);
        let end = Time::from_micros(10_100);
        filter.drive(end, DriveCommand::OFF);
        filter.update_camera(&CameraFrame::new(end, Angle::from_degrees(2.0)));
        assert!(filter.kick_use.taken);
    }

    /// Frames of a rotor that becomes faster by 80 rad/s each second while no impact kicks it. In the 10 ms between two
    /// impacts it leaves the line of a constant rate by 40 mdeg, four times a frame's noise, and always to one side. At
    /// 200 rad/s^2 the innovations are far larger than the filter says, but no camera makes such noise. A rotor at
    /// rest gives no reason, even where the frames are three times as noisy as described.
    #[test]
    fn law_frames_that_pull_one_way_end_the_use_of_kicks() {
        let sd_deg = |filter: &ImpactAided<f64>| {
            math::sqrt(filter.tuning.constant_rate.track.camera_rad2).to_degrees()
        };
        for (rad_s2, noise_sds, ends) in
            [(0.0, 0.0, false), (0.0, 1.0, false), (0.0, 3.0, false), (80.0, 0.0, true), (200.0, 0.0, true)]
        {
            let mut filter = driven::<f64>(DriveMode::B);
            let mut rng = Pcg64::seed_from_u64(1);
            let noise_deg = noise_sds * sd_deg(&filter);
            let mut ended = false;
            for n in 0..20_000_u64 {
                let at = Time::from_micros(5 * (n + 1));
                // Bounces of 10 ms, each from where the last one was.
                let velocity_m_s = (9.81 * 5e-6 * (1000.0 - (n % 2000) as f64)) as f32;
                filter.update_ldv(&LdvSample { taken_at: at, velocity_m_s });
                if n % 20 == 0 {
                    let (seconds, noise): (_, f64) = (5e-6 * (n + 1) as f64, StandardNormal.sample(&mut rng));
                    let turned_deg: f64 = (0.5 * rad_s2 * seconds * seconds).to_degrees();
                    let shown = Angle::from_degrees(turned_deg + noise_deg * noise);
                    filter.update_camera(&CameraFrame::new(at, shown));
                }
                ended |= !filter.kick_use.taken;
            }
            assert_eq!(ended, ends, "{rad_s2} rad/s^2, {noise_sds} of a frame's noise");
        }
    }

    /// Kicks are not taken for 50 ms, and the drive is switched off: at once they are, since friction brakes a sliding
    /// rotor. On again within the 50 ms, they are not.
    #[test]
    fn exact_the_drive_decides_at_once_whether_kicks_are_taken() {
        let mut filter = driven::<f64>(DriveMode::B);
        filter.review_kick_use(Time::from_micros(1000), true);
        let mut taken = |micros, command| {
            filter.drive(Time::from_micros(micros), command);
            filter.kick_use.taken
        };
        let on = DriveCommand::full(DriveMode::B);
        assert_eq!([taken(2000, on), taken(3000, DriveCommand::OFF), taken(4000, on)], [false, true, false]);
        assert!(taken(51_001, on));
    }

    /// A motor of the nominal design under mode B whose kicks are not taken for 50 ms in every 100, before a camera
    /// whose frames come 1.6 ms late: the kicks until they are taken again are not known. In the 3 ms after it the
    /// squared error of the angle is as large as said, to a factor of two over 18 such times; where the past counts as
    /// known it is thirty times as large.
    #[test]
    fn law_kicks_that_were_not_taken_are_not_known() {
        let command = DriveCommand::full(DriveMode::B);
        let motor = Motor::<f64>::try_new(&MotorParams::nominal(), &MotorSetup::with_step(5e-6)).unwrap();
        let (mut state, mut filter) = (MotorState::<f64>::default(), driven::<f64>(DriveMode::B));
        let mut rng = Pcg64::seed_from_u64(1);
        let sd_deg = math::sqrt(filter.tuning.constant_rate.track.camera_rad2).to_degrees();
        let (mut on_its_way, mut squares) =
            (Deque::<CameraFrame, 32>::new(), heapless::Vec::<f64, 600>::new());
        let mut taken_from = 0;
        for micros in (5..2_000_000_u64).step_by(5) {
            motor.step(&mut state, command);
            let at = Time::from_micros(micros);
            filter.update_ldv(&LdvSample { taken_at: at, velocity_m_s: state.rotor.velocity_m_s as f32 });
            if micros.is_multiple_of(100_000) {
                filter.kick_use = KickUse::new();
                filter.review_kick_use(at, true);
            }
            if micros.is_multiple_of(100) {
                let (angle, noise): (_, f64) = (state.rotor.angle.angle(), StandardNormal.sample(&mut rng));
                let shown = Angle::from_degrees(angle.degrees() + sd_deg * noise);
                on_its_way.push_back(CameraFrame::new(at, shown)).unwrap();
                let taken = filter.kick_use.taken;
                if let Some(frame) =
                    on_its_way.pop_front_if(|frame| frame.exposed_at.plus_nanos(1_600_000) <= at)
                {
                    filter.update_camera(&frame);
                }
                taken_from = if filter.kick_use.taken && !taken { micros } else { taken_from };
                if micros > 150_000 && (200..3000).contains(&(micros - taken_from)) {
                    let estimate = filter.estimate(at).unwrap();
                    let off_rad: f64 = estimate.angle.radians_since(angle);
                    squares.push(off_rad * off_rad / estimate.angle_rad2).unwrap();
                }
            }
        }
        let mean = squares.iter().sum::<f64>() / squares.len() as f64;
        assert!(squares.len() > 400 && (0.25..2.0).contains(&mean), "{mean} of {}", squares.len());
    }
}
