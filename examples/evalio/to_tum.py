"""Writes results of evalio as trajectories of the head: to_tum.py RESULTS PIPELINE FOLDER

Each RESULTS/zsim/NAME/PIPELINE.csv becomes FOLDER/NAME.tum, for `zsim benchmark score` and `zsim compare`. A pose of evalio is
that of the IMU. KISS-ICP and GenZ-ICP with `deskew` estimate the pose at the end of a scan, and evalio 0.6.1 stamps it with the
start: these stamps are shifted by a period of the lidar.
"""

import sys
from pathlib import Path

from evalio.types import Duration, Experiment, Trajectory
from zsim_evalio import Zsim

STAMPS_START_OF_SCAN = ("kiss", "genz")


def main(results: str, pipeline: str, folder: str) -> None:
    Path(folder).mkdir(parents=True, exist_ok=True)
    for sequence in Zsim.sequences():
        estimate = Trajectory.from_file(Path(results, sequence.full_name, f"{pipeline}.csv"))
        if not isinstance(estimate, Trajectory) or len(estimate) == 0:
            print(f"{sequence.seq_name}: no trajectory of {pipeline}", file=sys.stderr)
            continue
        imu_from_head, shift = sequence.imu_T_gt(), delay(estimate.metadata, sequence)
        with open(Path(folder, f"{sequence.seq_name}.tum"), "w") as file:
            for stamp, pose in estimate:
                stamp, pose = stamp + shift, pose * imu_from_head
                rotation = (pose.rot.qx, pose.rot.qy, pose.rot.qz, pose.rot.qw)
                print(f"{stamp.sec}.{stamp.nsec:09}", *(f"{x:.9f}" for x in (*pose.trans, *rotation)), file=file)


def delay(experiment: Experiment, sequence: Zsim) -> Duration:
    """The time from the stamp of a pose to the instant of the pose."""
    at_start = experiment.pipeline in STAMPS_START_OF_SCAN and experiment.pipeline_params["deskew"]
    return sequence.lidar_params().delta_time() if at_start else Duration.from_sec(0.0)


if __name__ == "__main__":
    if len(sys.argv) != 4:
        sys.exit(__doc__)
    main(*sys.argv[1:])
