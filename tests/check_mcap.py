#!/usr/bin/env python3
"""check_mcap.py FILE.mcap: checks a recording with independent readers.

Reads every message twice: with `mcap` and `mcap-ros2-support` by the definitions in the file, and with `rosbags` by its
own definitions. Both must agree, and the values must be those of a recording of zsim. Prints one line, `ok ...`;
exits with 1 on a difference, and with 77 if a module is not installed.
"""
import sys

try:
    import numpy as np
    from mcap.reader import make_reader
    from mcap_ros2.decoder import DecoderFactory
    from rosbags.typesys import Stores, get_typestore
except ImportError as missing:
    print(missing, file=sys.stderr)
    sys.exit(77)

TYPES = {
    "/scan": "sensor_msgs/msg/LaserScan",
    "/points": "sensor_msgs/msg/PointCloud2",
    "/imu/data_raw": "sensor_msgs/msg/Imu",
    "/base/imu": "sensor_msgs/msg/Imu",
    "/tf_static": "tf2_msgs/msg/TFMessage",
    "/ground_truth/odom": "nav_msgs/msg/Odometry",
    "/ground_truth/pose": "geometry_msgs/msg/PoseStamped",
    "/ground_truth/base": "geometry_msgs/msg/PoseStamped",
    "/ground_truth/clock": "sensor_msgs/msg/TimeReference",
}


def same(a, b):
    """Whether two decoded messages are equal, field by field."""
    if isinstance(b, np.ndarray) or isinstance(a, (bytes, bytearray)):
        a = np.frombuffer(a, np.uint8) if isinstance(a, (bytes, bytearray, memoryview)) else np.asarray(a)
        return np.array_equal(a.astype(float), np.asarray(b).astype(float), equal_nan=True)
    if isinstance(b, list):
        return len(a) == len(b) and all(same(x, y) for x, y in zip(a, b))
    if hasattr(b, "__dataclass_fields__"):
        names = [n for n in b.__dataclass_fields__ if not n.startswith("__") and not n.isupper()]
        return all(same(getattr(a, n), getattr(b, n)) for n in names)
    return a == b or (a != a and b != b)


def points_on_scan(scan, cloud):
    """Whether the cloud's points are the scan's returns with their times."""
    ranges = np.asarray(scan.ranges)
    back = np.flatnonzero((ranges >= scan.range_min) & (ranges <= scan.range_max))
    kinds = np.dtype([("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("i", "<f4"), ("t", "<u4")])
    rows = np.frombuffer(bytes(cloud.data), kinds)
    angles = scan.angle_min + back * scan.angle_increment
    there = np.c_[ranges[back] * np.cos(angles), ranges[back] * np.sin(angles)]
    near = np.abs(np.c_[rows["x"], rows["y"]] - there).max() < 1e-4
    return len(rows) == len(back) and near and np.abs(rows["t"] - back * scan.time_increment * 1e9).max() < 10


def roots(parents, frames):
    """The root frames of `frames` in the transform tree."""
    found = set()
    for frame in frames:
        while frame in parents:
            frame = parents[frame]
        found.add(frame)
    return found


def main(path):
    store = get_typestore(Stores.ROS2_HUMBLE)
    wrong, counts, last, qos, parents, frames = set(), {}, {}, {}, {}, set()
    with open(path, "rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        if reader.get_header().profile != "ros2":
            wrong.add("profile is not ros2")
        summary = reader.get_summary()
        for schema, channel, message, decoded in reader.iter_decoded_messages(log_time_order=False):
            topic = channel.topic
            counts[topic] = counts.get(topic, 0) + 1
            qos[topic] = channel.metadata.get("offered_qos_profiles", "")
            if TYPES.get(topic) != schema.name:
                wrong.add(f"{topic} is {schema.name}")
            if message.log_time < last.get(topic, 0):
                wrong.add(f"{topic}: log time decreases")
            last[topic] = message.log_time
            own = store.deserialize_cdr(message.data, schema.name)
            if not same(decoded, own):
                wrong.add(f"{topic}: the definition in the file decodes to other values")
            if bytes(store.serialize_cdr(own, schema.name))[4:] != message.data[4:]:
                wrong.add(f"{topic}: rosbags serialises to other bytes")
            if not topic.startswith("/ground_truth/") and topic != "/tf_static":
                frames.add(decoded.header.frame_id)
            if topic == "/tf_static":
                parents |= {link.child_frame_id: link.header.frame_id for link in decoded.transforms}
            if topic == "/scan":
                scan = decoded
            if topic == "/points" and not points_on_scan(scan, decoded):
                wrong.add("/points are not the returns of /scan")
    wrong |= {f"no {topic}" for topic in TYPES if topic not in counts}
    wrong |= {f"{topic}: no quality of service" for topic in counts if "durability" not in qos[topic]}
    if "durability: 1" not in qos.get("/tf_static", ""):
        wrong.add("/tf_static is not transient_local")
    if roots(parents, frames) != {"head"}:
        wrong.add(f"root frames of measurements are {sorted(roots(parents, frames))} instead of head")
    if summary is None or summary.statistics.message_count != sum(counts.values()):
        wrong.add("the summary has another number of messages")
    if wrong:
        print("\n".join(sorted(wrong)))
        return 1
    print(f"ok {sum(counts.values())} messages on {len(counts)} topics")
    return 0


sys.exit(main(sys.argv[1]))
