//! The paper's formulation of the window: trajectory in lidar time, clock offset in the IMU residuals, second differences.

use crate::estimation::fixture::{Room, Run, Score, Walk, calibration};
use zsim::estimation::{EstimatorSpec, Formulation, OpenLoop, estimate_all, load};

/// A walk through a furnished hall with the IMU's clock off by `offset_s`.
fn hall(seed: u64, offset_s: f64) -> Run {
    let walk = Walk { start_s: 1.5, ..Walk::new((1.8, 1.2), 25.0) };
    let run = Run::new(Room::furnished(), walk, seed, 16.0);
    Run { clock_offset_s: offset_s, ..run }
}

fn spec(formulation: Formulation, knot_spacing_s: f64) -> EstimatorSpec {
    EstimatorSpec { formulation, knot_spacing_s, ..load("default").unwrap() }
}

fn estimate(run: &Run, spec: &EstimatorSpec) -> OpenLoop {
    estimate_all(spec, &calibration(), run.measurements().into_iter()).unwrap()
}

#[test]
fn the_papers_formulation_finds_a_clock_offset_of_5_ms_of_either_sign() {
    for offset_s in [-5e-3, 5e-3] {
        let run = hall(11, offset_s);
        let score = Score::of(&estimate(&run, &spec(Formulation::Paper, 0.1)), &run);
        assert!(score.rmse_m < 0.006 && score.clock_end_s.abs() < 3e-4, "{offset_s}: {score:?}");
    }
}

/// Both formulations have the same optimum but for the weights of the accelerometer's samples.
#[test]
fn with_exact_clocks_both_formulations_agree_to_3_mm() {
    let run = Run { clock_drift: 0.0, ..hall(12, 0.0) };
    let [ours, paper] = [Formulation::ImuTime, Formulation::Paper].map(|formulation| {
        let result = estimate(&run, &spec(formulation, 0.2));
        (Score::of(&result, &run), result)
    });
    let position = |result: &OpenLoop, k: usize| result.trajectory.poses()[k].translation.vector;
    let count = ours.1.trajectory.len().min(paper.1.trajectory.len());
    let apart_m = (0..count).map(|k| (position(&ours.1, k) - position(&paper.1, k)).norm()).fold(0.0, f64::max);
    assert!(apart_m < 0.01 && apart_m > 0.0, "{apart_m} m; {:?} {:?}", ours.0, paper.0);
    assert!(paper.0.rmse_m < 0.0045, "{:?}", paper.0);
}
