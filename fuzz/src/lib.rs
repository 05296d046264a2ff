//! Reading of a recording, shared by the fuzz targets.

use std::io::{Read, Seek};
use zsim_base::geometry::Pose;
use zsim_base::measurement::{Calibration, ImuAveraging, ImuNoise, LidarNoise};
use zsim_base::time::Span;
use zsim_recording::{Reader, TopicPreference};

/// Reads all contents of a recording: info, truth, and the measurements for each lidar topic.
pub fn read_all(file: impl Read + Seek + Send + 'static) {
    let Ok(reader) = Reader::new("fuzz", file) else { return };
    let _ = reader.info(Span::from_seconds(0.1));
    reader.truth().for_each(drop);
    let preferences = [None, Some("/points"), Some("/echoes"), Some("/livox")].map(|topic| topic.map(str::to_owned));
    for lidar_topic in preferences {
        let Ok(selection) = reader.select(&TopicPreference { lidar_topic, imu_topic: None }) else { continue };
        let _ = reader.calibration(&selection, &calibration(), None);
        reader.measurements(&selection).for_each(drop);
    }
}

fn calibration() -> Calibration {
    Calibration {
        head_from_laser: Pose::identity(),
        head_from_imu: Pose::identity(),
        imu: ImuNoise {
            gyro_density_rad_per_s_per_sqrt_hz: 0.0,
            accel_density_m_per_s2_per_sqrt_hz: 0.0,
            gyro_bias_walk_rad_per_s_per_sqrt_s: 0.0,
            accel_bias_walk_m_per_s2_per_sqrt_s: 0.0,
            gyro_turn_on_bias_rad_per_s: 0.0,
            accel_turn_on_bias_m_per_s2: 0.0,
            gyro_scale_error: 0.0,
            gyro_misalignment_rad: 0.0,
            accel_scale_error: 0.0,
            accel_misalignment_rad: 0.0,
            gyro_limit_rad_per_s: 1.0,
            accel_limit_m_per_s2: 1.0,
        },
        imu_averaging: ImuAveraging::ConingCorrected,
        lidar: LidarNoise { near_sigma_m: 0.0, near_m: 1.0, far_sigma_m: 0.0, far_m: 2.0 },
    }
}
