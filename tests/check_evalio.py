#!/usr/bin/env python3
"""check_evalio.py FILE.mcap...: compares the dataset of examples/evalio with an independent reader of the recordings.

evalio reads with `rosbags`; this script with `mcap` and `mcap-ros2-support`. Counts, rates, stamps, points and their times, IMU
samples, extrinsics and truth must agree, the truth also without its TUM file. Prints one line, `ok ...`; exits with 1 on a
difference, and with 77 if a module is not installed.
"""
import os
import sys
from itertools import pairwise
from pathlib import Path

try:
    import numpy as np
    from mcap.reader import make_reader
    from mcap_ros2.decoder import DecoderFactory

    FILES = [Path(file).resolve() for file in sys.argv[1:]]
    os.environ.update(ZSIM_RECORDINGS=str(FILES[0].parent), EVALIO_DATA=str(FILES[0].parent))
    sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "examples" / "evalio"))
    from evalio.types import ImuMeasurement, LidarMeasurement
    from zsim_evalio import Zsim
except ModuleNotFoundError as missing:
    print(missing, file=sys.stderr)
    sys.exit(77)


def read(path):
    """The decoded messages of each topic, in the order of their log times."""
    messages = {}
    with open(path, "rb") as file:
        for _, channel, _, decoded in make_reader(file, decoder_factories=[DecoderFactory()]).iter_decoded_messages():
            messages.setdefault(channel.topic, []).append(decoded)
    return messages


def nanoseconds(stamp):
    return stamp.sec * 10**9 + stamp.nanosec


def matrix(position, q):
    """A transform, from the formula for the rotation of a unit quaternion."""
    w, x, y, z = q.w, q.x, q.y, q.z
    result = np.eye(4)
    result[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    result[:3, 3] = position.x, position.y, position.z
    return result


def cloud(message):
    """x, y, z in m, and the time in ns, of each point of a PointCloud2 of zsim."""
    rows = np.frombuffer(bytes(message.data), [("xyz", "<f4", 3), ("intensity", "<f4"), ("t", "<u4")])
    return np.c_[rows["xyz"].astype(float), rows["t"]]


def check_scan(scan, message, rings, wrong):
    """Compares the points of a scan, in the order of their times, and the order of rings."""
    ours = np.c_[np.array(scan.to_vec_positions()), np.round(np.array(scan.to_vec_stamps()) * 1e9)]
    theirs = cloud(message)
    row = np.array([point.row for point in scan.points])
    if rings > 1:
        # Beams without a return are (0, 0, 0).
        there = np.any(ours[:, :3] != 0, axis=1)
        ours, row = ours[there], row[there]
    if scan.stamp.to_nsec() != nanoseconds(message.header.stamp):
        wrong.add("stamp of a scan")
    if len(ours) != len(theirs):
        wrong.add("number of points")
        return
    order = [np.lexsort(rows.T) for rows in (ours, theirs)]
    if np.abs(ours[order[0]] - theirs[order[1]]).max() > 1e-6:
        wrong.add("points or their times")
    if rings > 1:
        middle = [np.median(np.arctan2(ours[row == r, 2], np.hypot(ours[row == r, 0], ours[row == r, 1]))) for r in np.unique(row)]
        if len(middle) != rings or np.any(np.diff(row) < 0) or any(a >= b for a, b in pairwise(middle)):
            wrong.add("rings")


def check(path):
    """The differences between the dataset and the recording, and a summary."""
    wrong, messages, sequence = set(), read(path), Zsim(path.stem)
    scans, samples = messages["/points"], messages["/imu/data_raw"]
    measurements = list(sequence)
    ours = [m for m in measurements if isinstance(m, LidarMeasurement)]
    imu = [m for m in measurements if isinstance(m, ImuMeasurement)]
    rings = sequence.lidar_params().num_rows
    if not len(ours) == len(scans) == len(sequence) == len(list(sequence.lidar())):
        wrong.add(f"{len(ours)} scans instead of {len(scans)}")
    for scan, message in zip(ours, scans):
        check_scan(scan, message, rings, wrong)
    if not len(imu) == len(samples) == len(list(sequence.imu())):
        wrong.add(f"{len(imu)} IMU samples instead of {len(samples)}")
    for sample, message in zip(imu, samples):
        w, a = message.angular_velocity, message.linear_acceleration
        same = np.array_equal(sample.gyro, [w.x, w.y, w.z]) and np.array_equal(sample.accel, [a.x, a.y, a.z])
        if not same or sample.stamp.to_nsec() != nanoseconds(message.header.stamp):
            wrong.add("IMU samples")

    for rate_hz, sensor in ((sequence.lidar_params().rate, scans), (sequence.imu_params().rate, samples)):
        span_s = 1e-9 * (nanoseconds(sensor[-1].header.stamp) - nanoseconds(sensor[0].header.stamp))
        if rate_hz != round((len(sensor) - 1) / span_s):
            wrong.add("rates")

    links = {link.child_frame_id: link.transform for link in messages["/tf_static"][0].transforms}
    head_from = {frame: matrix(link.translation, link.rotation) for frame, link in links.items()}
    imu_from_head = np.linalg.inv(head_from["imu_link"])
    if np.abs(sequence.imu_T_lidar().to_mat() - imu_from_head @ head_from["laser"]).max() > 1e-12:
        wrong.add("extrinsics of the lidar")

    check_truth(sequence, messages, head_from["imu_link"], wrong)
    return wrong, f"{path.stem}: {len(ours)} scans with {rings} rings, {len(imu)} IMU samples"


def check_truth(sequence, messages, head_from_imu, wrong):
    """Compares the truth in the frame of the IMU, from the TUM file and from the recording, with the topic."""
    from_file, from_topic = sequence.ground_truth(), sequence.data_iter().truth()
    from_topic.transform_in_place(sequence.imu_T_gt().inverse())
    poses = messages["/ground_truth/pose"]
    for truth, name in ((from_file, "TUM file"), (from_topic, "topic")):
        if len(truth) != len(poses):
            wrong.add(f"truth of the {name}: {len(truth)} poses instead of {len(poses)}")
        for (stamp, pose), message in zip(truth, poses):
            expected = matrix(message.pose.position, message.pose.orientation) @ head_from_imu
            # The TUM file has nine decimals.
            if np.abs(pose.to_mat() - expected).max() > 1e-8:
                wrong.add(f"truth of the {name}: poses")
            if stamp.to_nsec() != nanoseconds(message.header.stamp):
                wrong.add(f"truth of the {name}: stamps")


for file in FILES:
    differences, summary = check(file)
    if differences:
        sys.exit(f"{file}: {', '.join(sorted(differences))}")
    print("ok", summary)
