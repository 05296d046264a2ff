#!/usr/bin/env python3
"""check_evalio_pipeline.py: compares the pipeline `zsim` of examples/evalio with the estimator of the Python package.

Both process the same simulated measurements; their poses must agree. Prints one line, `ok ...`; exits with 1 on a difference.
"""
import sys
from math import sqrt
from pathlib import Path

import numpy as np
import zsim
from evalio import types

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "examples" / "evalio"))
from estimator_evalio import ZsimEstimator

# The lidar of the head, turned by 90 degrees about z.
POSITION, QUATERNION = (0.0, 0.0, 0.078), (0.0, 0.0, sqrt(0.5), sqrt(0.5))


def in_order(data):
    """The indices of the IMU samples (-1, i) and of the scans (0, i), in order of their stamps."""
    samples = [(stamp, -1, i) for i, stamp in enumerate(data.imu_stamp_ns.tolist())]
    return [each[1:] for each in sorted(samples + [(stamp, 0, i) for i, stamp in enumerate(data.scan_stamp_ns.tolist())])]


def scan(data, i):
    """Stamp, stamps of the returns, and points in the turned lidar."""
    part = slice(data.scan_start[i], data.scan_start[i + 1])
    points = data.point_in_laser_m[part][:, [1, 0, 2]] * np.array([1, -1, 1], np.float32)
    return int(data.scan_stamp_ns[i]), data.return_stamp_ns[part], points


def scan_of_evalio(stamp, times, points):
    """The scan as evalio has it: in any order, and with (0, 0, 0) for a beam without a return."""
    delays = (types.Duration.from_nsec(time - stamp) for time in times.tolist())
    points = [types.Point(x=x, y=y, z=z, t=t) for (x, y, z), t in zip(points.tolist(), delays)]
    return types.LidarMeasurement(types.Stamp.from_nsec(stamp), [types.Point(), *reversed(points)])


def main():
    data = zsim.simulate(scene="mocap_room", duration_s=8.0, seed=3).all
    head = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)
    estimator = zsim.Estimator(zsim.Calibration((POSITION, QUATERNION), head, imu="3dm_gx2"))
    pipeline = ZsimEstimator()
    if pipeline.set_params({"imu": "3dm_gx2", "wrong": 1}) != {"wrong": 1}:
        sys.exit("an unknown parameter is not reported")
    x, y, z, w = QUATERNION
    pipeline.set_imu_T_lidar(types.SE3(types.SO3(qx=x, qy=y, qz=z, qw=w), np.array(POSITION)))
    pipeline.initialize()
    for kind, i in in_order(data):
        if kind == 0:
            estimator.push_scan(*scan(data, i))
            pipeline.add_lidar(scan_of_evalio(*scan(data, i)))
        else:
            sample = int(data.imu_stamp_ns[i]), data.angular_velocity_rad_per_s[i], data.specific_force_m_per_s2[i]
            estimator.push_imu(*sample)
            pipeline.add_imu(types.ImuMeasurement(types.Stamp.from_nsec(sample[0]), *sample[1:]))

    expected, saved = estimator.take_poses(), pipeline.saved_estimates()
    # The pipeline takes poses after scans only.
    if len(saved) < 100 or not 0 <= len(expected) - len(saved) < 10:
        sys.exit(f"{len(saved)} poses instead of {len(expected)}")
    for (stamp, pose), time, position, quaternion in zip(saved, expected.stamp_ns, expected.position_m, expected.quaternion_xyzw):
        rotation = np.array([pose.rot.qx, pose.rot.qy, pose.rot.qz, pose.rot.qw])
        same = np.allclose(pose.trans, position, rtol=0.0, atol=1e-9) and abs(rotation @ quaternion) > 1 - 1e-12
        if stamp.to_nsec() != time or not same:
            sys.exit(f"the pose at {time} ns is {pose} at {stamp.to_nsec()} ns instead of {position} m, {quaternion}")
    print(f"ok {len(saved)} poses")


main()
