//! Any instruments within their bounds.

use estimator::{CameraDescription, CameraFrame, Instruments, LdvSample, VibrometerDescription};
use motor_model::{Angle, DriveCommand, DriveMode, Time};
use proptest::prelude::*;

use crate::bench::filters;

prop_compose! {
    /// Any instruments within their bounds, and beyond what the study asks for.
    fn any_instruments()(
        period_nanos in 10_000_u64..100_000_000,
        exposure in 0.0..1.0_f64,
        latency_nanos in 0_u64..1_000_000_000,
        noise_log in -9.0..-3.0_f64,
        resolution_log in -9.0..-3.0_f64,
        radius_log in -4.0..-1.0_f64,
        marks in 1..=16_u8,
        shared in any::<bool>(),
        bias_log in -9.0..-3.0_f64,
        shift_log in -9.0..-3.0_f64,
        ldv_nanos in 1000_u64..100_000,
        ldv_log in -6.0..0.0_f64,
        range in prop_oneof![Just(0.0), 0.01..100.0_f64],
        step in prop_oneof![Just(0.0), 1e-6..1.0_f64],
        fitted in any::<bool>(),
    ) -> Instruments {
        let power = |x: f64| 10.0_f64.powf(x);
        let camera = CameraDescription {
            period_nanos,
            exposure_nanos: (exposure * period_nanos as f64) as u64,
            latency_nanos,
            noise_m: power(noise_log),
            resolution_m: power(resolution_log),
            radius_m: power(radius_log).clamp(1e-4, 0.1),
            marks,
            mark_bias_m: if shared { power(bias_log) } else { 0.0 },
            shift_m: if shared { power(shift_log) } else { 0.0 },
            stamp_sd_s: if shared { power(shift_log) as f32 } else { 0.0 },
            clock_sd_micros: if shared { 600 * u16::from(marks) } else { 0 },
        };
        let vibrometer = VibrometerDescription {
            period_nanos: ldv_nanos,
            noise_m_s: power(ldv_log),
            bias_max_m_s: 0.0,
            range_m_s: range,
            resolution_m_s: step,
        };
        Instruments { camera, vibrometer: fitted.then_some(vibrometer) }.checked().unwrap()
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]

    /// Any instruments, any frames and samples: no panic, finite estimates, positive variances.
    #[test]
    fn law_any_instruments_leave_a_finite_estimate(
        instruments in any_instruments(),
        events in proptest::collection::vec((0_u8..4, 1_u64..3_000_000, any::<i64>(), -0.2..0.2_f32), 1..300),
    ) {
        for mut filter in filters(&instruments) {
            let mut now = Time::ZERO;
            for &(kind, nanos, units, velocity_m_s) in &events {
                now = now.plus_nanos(nanos);
                match kind {
                    0 => filter.drive(now, DriveCommand::full(DriveMode::B)),
                    1 => filter.drive(now, DriveCommand::OFF),
                    2 => drop(filter.update_ldv(&LdvSample { taken_at: now, velocity_m_s })),
                    _ => {
                        let angle = Angle::from_degrees(units as f64 / 1e19 * 360.0).wrapped();
                        let _ = filter.update_camera(&CameraFrame::new(now, angle));
                    }
                }
                if let (Some(estimate), _) = filter.assess(now) {
                    prop_assert!(estimate.rate_rad_s.is_finite());
                    prop_assert!(estimate.angle_rad2 > 0.0 && estimate.angle_rad2.is_finite());
                    prop_assert!(estimate.rate_rad2_s2 > 0.0 && estimate.rate_rad2_s2.is_finite());
                }
            }
        }
    }
}
