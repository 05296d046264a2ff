#!/usr/bin/env python3
"""Checks `zsim play` and `zsim live` with another implementation of DDS, Cyclone DDS.

check_ros2.py play DOMAIN RECORDING.mcap: subscribes to the topics of a recording until no message arrives for some seconds.
Each message must have arrived, in order, and be the one of the recording when decoded.

check_ros2.py live DOMAIN RECORDING.mcap: publishes the scans and IMU samples of a recording at their own pace, and prints
what `zsim live` publishes: the number of messages by topic, the last pose of /odom, the frames, and the last status.

Prints JSON; exits with 1 on a difference, and with 77 if a module is not installed.
"""
import json
import os
import sys
import time
import types
from dataclasses import dataclass

# Without multicast, and only on this machine.
os.environ.setdefault("CYCLONEDDS_URI", """<CycloneDDS><Domain>
  <General><Interfaces><NetworkInterface address="127.0.0.1"/></Interfaces><AllowMulticast>false</AllowMulticast></General>
  <Discovery><ParticipantIndex>auto</ParticipantIndex><Peers><Peer address="127.0.0.1"/></Peers></Discovery>
</Domain></CycloneDDS>""")

try:
    from cyclonedds.core import Policy, Qos
    from cyclonedds.domain import DomainParticipant
    from cyclonedds.idl import IdlStruct
    from cyclonedds.idl.types import array, float32, float64, int32, sequence, uint8, uint32
    from cyclonedds.pub import DataWriter
    from cyclonedds.sub import DataReader
    from cyclonedds.topic import Topic
    from cyclonedds.util import duration
    from mcap.reader import make_reader
except ImportError as missing:
    print(missing, file=sys.stderr)
    sys.exit(77)


def named(package, name):
    """Declares a message type by the name that ROS 2 gives it in DDS."""
    def declare(fields):
        typename = {"typename": f"{package}::msg::dds_::{name}_"}
        return dataclass(types.new_class(name, (IdlStruct,), typename, lambda body: body.update(__annotations__=fields)))
    return declare


Time = named("builtin_interfaces", "Time")({"sec": int32, "nanosec": uint32})
Header = named("std_msgs", "Header")({"stamp": Time, "frame_id": str})
Vector3 = named("geometry_msgs", "Vector3")({"x": float64, "y": float64, "z": float64})
Point = named("geometry_msgs", "Point")({"x": float64, "y": float64, "z": float64})
Quaternion = named("geometry_msgs", "Quaternion")({"x": float64, "y": float64, "z": float64, "w": float64})
Pose = named("geometry_msgs", "Pose")({"position": Point, "orientation": Quaternion})
PoseStamped = named("geometry_msgs", "PoseStamped")({"header": Header, "pose": Pose})
PoseWithCovariance = named("geometry_msgs", "PoseWithCovariance")({"pose": Pose, "covariance": array[float64, 36]})
Twist = named("geometry_msgs", "Twist")({"linear": Vector3, "angular": Vector3})
TwistWithCovariance = named("geometry_msgs", "TwistWithCovariance")({"twist": Twist, "covariance": array[float64, 36]})
Transform = named("geometry_msgs", "Transform")({"translation": Vector3, "rotation": Quaternion})
TransformStamped = named("geometry_msgs", "TransformStamped")(
    {"header": Header, "child_frame_id": str, "transform": Transform})
TFMessage = named("tf2_msgs", "TFMessage")({"transforms": sequence[TransformStamped]})
Odometry = named("nav_msgs", "Odometry")(
    {"header": Header, "child_frame_id": str, "pose": PoseWithCovariance, "twist": TwistWithCovariance})
Path = named("nav_msgs", "Path")({"header": Header, "poses": sequence[PoseStamped]})
Imu = named("sensor_msgs", "Imu")({
    "header": Header, "orientation": Quaternion, "orientation_covariance": array[float64, 9],
    "angular_velocity": Vector3, "angular_velocity_covariance": array[float64, 9],
    "linear_acceleration": Vector3, "linear_acceleration_covariance": array[float64, 9]})
LaserScan = named("sensor_msgs", "LaserScan")({
    "header": Header, "angle_min": float32, "angle_max": float32, "angle_increment": float32, "time_increment": float32,
    "scan_time": float32, "range_min": float32, "range_max": float32, "ranges": sequence[float32],
    "intensities": sequence[float32]})
PointField = named("sensor_msgs", "PointField")({"name": str, "offset": uint32, "datatype": uint8, "count": uint32})
PointCloud2 = named("sensor_msgs", "PointCloud2")({
    "header": Header, "height": uint32, "width": uint32, "fields": sequence[PointField], "is_bigendian": bool,
    "point_step": uint32, "row_step": uint32, "data": sequence[uint8], "is_dense": bool})
KeyValue = named("diagnostic_msgs", "KeyValue")({"key": str, "value": str})
DiagnosticStatus = named("diagnostic_msgs", "DiagnosticStatus")(
    {"level": uint8, "name": str, "message": str, "hardware_id": str, "values": sequence[KeyValue]})
DiagnosticArray = named("diagnostic_msgs", "DiagnosticArray")({"header": Header, "status": sequence[DiagnosticStatus]})

RECORDED = {"/scan": LaserScan, "/imu/data_raw": Imu, "/tf_static": TFMessage}
PUBLISHED = {"/tf": TFMessage, "/odom": Odometry, "/path": Path, "/cloud": PointCloud2, "/diagnostics": DiagnosticArray}
QUIET_S = 3.0


def quality(topic):
    durability = Policy.Durability.TransientLocal if topic == "/tf_static" else Policy.Durability.Volatile
    return Qos(Policy.Reliability.Reliable(duration(seconds=1)), durability, Policy.History.KeepLast(1000))


def recorded(path):
    with open(path, "rb") as file:
        for _, channel, message in make_reader(file).iter_messages(topics=list(RECORDED)):
            yield channel.topic, message.log_time * 1e-9, RECORDED[channel.topic].deserialize(message.data)


def readers(participant, kinds):
    return {t: DataReader(participant, Topic(participant, "rt" + t, kind), qos=quality(t)) for t, kind in kinds.items()}


def received(reader):
    return [sample for sample in reader.take(N=1000) if hasattr(sample, "__idl__")]


def play(domain, path):
    participant = DomainParticipant(domain)
    subscribed = readers(participant, RECORDED)
    print("subscribed", flush=True)
    got = {topic: [] for topic in RECORDED}
    last = time.monotonic() + 30
    while time.monotonic() < last:
        for topic, reader in subscribed.items():
            new = received(reader)
            got[topic] += new
            last = time.monotonic() + QUIET_S if new else last
        time.sleep(0.005)
    expected = {topic: [] for topic in RECORDED}
    for topic, _, message in recorded(path):
        expected[topic].append(message)
    for topic, messages in expected.items():
        assert len(got[topic]) == len(messages), f"{topic}: {len(got[topic])} of {len(messages)} messages arrived"
        assert got[topic] == messages, f"{topic}: other messages than recorded"
    return {topic: len(messages) for topic, messages in got.items()}


def live(domain, path):
    participant = DomainParticipant(domain)
    writers = {t: DataWriter(participant, Topic(participant, "rt" + t, kind), qos=quality(t)) for t, kind in RECORDED.items()}
    subscribed = readers(participant, PUBLISHED)
    limit = time.monotonic() + 30
    while not all(writer.get_matched_subscriptions() for writer in writers.values()) and time.monotonic() < limit:
        time.sleep(0.05)
    counts, last = {topic: 0 for topic in PUBLISHED}, {}

    def take():
        for topic, reader in subscribed.items():
            for sample in received(reader):
                counts[topic] += 1
                last[topic] = sample

    start = None
    for topic, log_time, message in recorded(path):
        start = start or time.monotonic() - log_time
        while time.monotonic() - start < log_time:
            take()
            time.sleep(0.001)
        writers[topic].write(message)
    end = time.monotonic() + QUIET_S
    while time.monotonic() < end:
        take()
        time.sleep(0.01)
    missing = [topic for topic in PUBLISHED if topic not in last]
    assert not missing, f"nothing arrived on {missing}"
    odometry, status = last["/odom"], last["/diagnostics"].status[0]
    stamp = odometry.header.stamp
    return {
        "counts": counts,
        "frames": [odometry.header.frame_id, odometry.child_frame_id, last["/tf"].transforms[0].child_frame_id],
        "stamp": f"{stamp.sec}.{stamp.nanosec:09}",
        "position": [getattr(odometry.pose.pose.position, axis) for axis in "xyz"],
        "path": len(last["/path"].poses),
        "points": last["/cloud"].width,
        "fields": [field.name for field in last["/cloud"].fields],
        "level": status.level,
        "status": status.message,
    }


if __name__ == "__main__":
    try:
        print(json.dumps({"play": play, "live": live}[sys.argv[1]](int(sys.argv[2]), sys.argv[3])))
    except AssertionError as difference:
        print(difference, file=sys.stderr)
        sys.exit(1)
