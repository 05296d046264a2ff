//! Size of a recording, reported and checked before the run starts.

use anyhow::ensure;
use std::path::Path;
use zsim_run::free_bytes;
use zsim_sensors::{Imu, Lidar};
use zsim_simulation::{Outputs, STEP_S, Simulation};

/// Bytes of a beam in a `LaserScan` (range and intensity) and in a `PointCloud2`, compressed, as measured with the
/// shipped lidars in the shipped office: 8 and 12 to 16.
const BEAM_IN_SCAN_BYTES: f64 = 8.0;
const BEAM_IN_CLOUD_BYTES: f64 = 16.0;
/// Bytes of a sample of an IMU, compressed.
const IMU_SAMPLE_BYTES: f64 = 85.0;
/// Bytes of the truth at one step of the simulation: in the recording, and the line in the TUM file.
const TRUTH_BYTES: f64 = 470.0 + 107.0;
/// Size above which a note reports it, bytes.
const LARGE_BYTES: f64 = 1e9;

/// Reports with `note` the size of a large recording at `wanted`, or in that folder.
///
/// # Errors
/// When the file system has less free space.
pub(super) fn check(
    simulation: &Simulation,
    outputs: Outputs,
    wanted: &Path,
    note: impl Fn(&str),
) -> anyhow::Result<()> {
    let bytes = expected_bytes(simulation, outputs);
    if bytes < LARGE_BYTES {
        return Ok(());
    }
    let duration_s = simulation.inputs().duration_s;
    let size = format!("the recording of {duration_s} s will take about {:.1} GB", bytes / 1e9);
    let folder = wanted.ancestors().find(|folder| folder.is_dir()).unwrap_or(Path::new("."));
    if let Some(free) = free_bytes(folder) {
        ensure!(
            free as f64 >= bytes,
            "{size}, but the disk of {} has {:.1} GB free: shorten it with --duration, or record elsewhere with --out",
            folder.display(),
            free as f64 / 1e9
        );
    }
    note(&size);
    Ok(())
}

/// The size of the recording and of the true trajectory next to it, bytes, give or take a third.
fn expected_bytes(simulation: &Simulation, outputs: Outputs) -> f64 {
    let of_imu = |imu: &Imu| IMU_SAMPLE_BYTES / imu.period_s();
    let of_imus = of_imu(simulation.imu()) + simulation.base_imu().map_or(0.0, of_imu);
    let of_others = match outputs {
        Outputs::All => lidar_bytes_per_s(simulation.lidar()) + TRUTH_BYTES / STEP_S,
        Outputs::Imus => 0.0,
    };
    (of_imus + of_others) * simulation.inputs().duration_s
}

fn lidar_bytes_per_s(lidar: &Lidar) -> f64 {
    let of_beam = if lidar.is_planar() { BEAM_IN_SCAN_BYTES } else { BEAM_IN_CLOUD_BYTES };
    of_beam * lidar.beams().len() as f64 / lidar.period_s()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::AtomicBool;
    use zsim_run::{ProgressMonitor, record, record_imus};
    use zsim_simulation::Scenario;

    #[test]
    fn the_size_of_the_imu_alone_is_about_that_of_a_recording() {
        let here = tempfile::tempdir().unwrap();
        let simulation = Simulation::prepare(&Scenario { duration_s: 60.0, ..Scenario::in_scene("office") }).unwrap();
        let file = here.path().join("a.mcap");
        let mut watch = ProgressMonitor { stop: &AtomicBool::new(false), report: &mut |_| {} };
        record_imus(&simulation, &file, &mut watch).unwrap();
        let ratio = expected_bytes(&simulation, Outputs::Imus) / file.metadata().unwrap().len() as f64;
        assert!((0.7..1.5).contains(&ratio), "{ratio}");
    }

    #[test]
    fn the_size_is_about_that_of_a_recording() {
        let here = tempfile::tempdir().unwrap();
        for lidar in ["utm30lx", "vlp16", "mid360"] {
            let scenario = Scenario { lidar: lidar.to_owned(), duration_s: 2.0, ..Scenario::in_scene("office") };
            let simulation = Simulation::prepare(&scenario).unwrap();
            let files = [here.path().join("a.mcap"), here.path().join("a.tum")];
            let mut watch = ProgressMonitor { stop: &AtomicBool::new(false), report: &mut |_| {} };
            record(&simulation, &files[0], &files[1], false, &mut watch).unwrap();
            let bytes: u64 = files.iter().map(|file| file.metadata().unwrap().len()).sum();
            let ratio = expected_bytes(&simulation, Outputs::All) / bytes as f64;
            assert!((0.7..1.5).contains(&ratio), "{lidar}: {ratio}");
        }
    }
}
