"""zsim's recordings as a dataset of evalio: EVALIO_CUSTOM=zsim_evalio evalio run ...

The sequences are the recordings zsim/NAME, NAME.mcap in the folder ZSIM_RECORDINGS [default: the current folder]. The points
used have distances of ZSIM_RANGES_M [default: 1,70]: PointCloud2 does not contain the limits of a lidar.
"""

import os
from collections.abc import Iterator, Sequence
from functools import cached_property
from itertools import islice
from pathlib import Path

import numpy as np
from evalio._cpp.helpers import DataType, Field, PointCloudMetadata, fill_col_row_major, pc2_to_evalio
from evalio.datasets import Dataset, DatasetIterator
from evalio.types import SE3, SO3, ImuMeasurement, ImuParams, LidarMeasurement, LidarParams, Stamp, Trajectory
from evalio.utils import print_warning
from rosbags.highlevel import AnyReader, AnyReaderError

FOLDER = Path(os.environ.get("ZSIM_RECORDINGS", "."))
MIN_RANGE_M, MAX_RANGE_M = (float(limit) for limit in os.environ.get("ZSIM_RANGES_M", "1,70").split(","))

# Planar lidars are recorded as PointCloud2, too.
LIDAR, IMU = "/points", "/imu/data_raw"
# PointField.datatype of ROS, as types of numpy
ROS_TYPES = ["", "<i1", "<u1", "<i2", "<u2", "<i4", "<u4", "<f4", "<f8"]
POINT = np.dtype([("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("intensity", "<f4"), ("t", "<u4"), ("ring", "<u2")])
FIELDS = [
    Field(name=name, datatype=DataType(ROS_TYPES.index(POINT[name].str)), offset=POINT.fields[name][1])
    for name in POINT.names
]
TUM = ["sec", "x", "y", "z", "qx", "qy", "qz", "qw"]
# A lidar with more elevations than this has no rings.
MOST_RINGS = 128


def points_of(cloud) -> np.ndarray:
    """The points of a PointCloud2 of zsim, in the order in which they were measured; t is in ns since the stamp."""
    layout = {
        "names": [field.name for field in cloud.fields],
        "formats": [ROS_TYPES[field.datatype] for field in cloud.fields],
        "offsets": [field.offset for field in cloud.fields],
        "itemsize": cloud.point_step,
    }
    points = np.frombuffer(cloud.data, np.dtype(layout))
    result = np.zeros(len(points), POINT)
    for name in ("x", "y", "z", "intensity", "t"):
        result[name] = points[name]
    return result


def elevations_deg(points: np.ndarray) -> np.ndarray:
    """The elevation of each point in the frame of the lidar, to 0.1 degrees."""
    return np.round(np.degrees(np.arctan2(points["z"], np.hypot(points["x"], points["y"]))), 1)


class Recording(DatasetIterator):
    """The measurements of a recording, in the order of their log times: a scan follows the IMU samples that it spans."""

    def __init__(self, path: Path):
        self.reader = AnyReader([path])
        try:
            self.reader.open()
        except AnyReaderError as error:
            raise ValueError(f"{path} cannot be read: {error}") from None
        missing = {LIDAR, IMU, "/tf_static"} - set(self.reader.topics)
        if missing:
            raise ValueError(f"{path} is not a recording of zsim: it has no {', '.join(sorted(missing))}")

    def messages(self, *topics: str) -> Iterator:
        """The topics and decoded messages of `topics`, by log time."""
        connections = [connection for connection in self.reader.connections if connection.topic in topics]
        for connection, _, data in self.reader.messages(connections=connections) if connections else ():
            yield connection.topic, self.reader.deserialize(data, connection.msgtype)

    def first(self, topic: str):
        """The first message of a topic, None without one."""
        return next((message for _, message in self.messages(topic)), None)

    def rate_hz(self, topic: str) -> float:
        """The rate of a sensor, from the first stamps, without the gaps of lost messages."""
        stamps = [message.header.stamp for _, message in islice(self.messages(topic), 100)]
        periods_s = np.diff([stamp.sec + 1e-9 * stamp.nanosec for stamp in stamps])
        return float(np.round(1.0 / np.mean(periods_s[periods_s < 1.5 * np.median(periods_s)])))

    @cached_property
    def first_scans(self) -> list[np.ndarray]:
        """The points of the first scans, without empty ones."""
        scans = [points_of(message) for _, message in islice(self.messages(LIDAR), 20)]
        if not any(map(len, scans)):
            raise ValueError(f"{self.reader.paths[0]}: the first {len(scans)} scans have no points")
        return [points for points in scans if len(points)]

    @cached_property
    def rings_deg(self) -> np.ndarray:
        """The elevations of the rings, from the bottom; empty for a lidar without rings, or with one."""
        found = np.unique(np.concatenate([elevations_deg(points) for points in self.first_scans]))
        return found if 1 < len(found) <= MOST_RINGS else np.array([])

    @cached_property
    def firing_ns(self) -> float:
        """The time between two points of a ring, ns."""
        first_ring = [points["t"][elevations_deg(points) == self.rings_deg[0]] for points in self.first_scans]
        return min(np.diff(times.astype(float)).min() for times in first_ring if len(times) > 1)

    @cached_property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of a scan; a single row for a lidar without rings."""
        if not len(self.rings_deg):
            return 1, max(map(len, self.first_scans))
        last_ns = max(points["t"].max() for points in self.first_scans)
        return len(self.rings_deg), int(last_ns / self.firing_ns) + 1

    def organised(self, points: np.ndarray) -> np.ndarray:
        """The points row by row, with (0, 0, 0) where a beam has no return: the order that evalio specifies for rings."""
        grid = np.zeros(self.shape, POINT)
        grid["ring"] = np.arange(self.shape[0])[:, None]
        grid["t"] = np.round(np.arange(self.shape[1]) * self.firing_ns)
        rows = np.abs(elevations_deg(points)[:, None] - self.rings_deg).argmin(1)
        # A thousandth of a firing, because times are rounded to ns.
        columns = np.minimum((points["t"] / self.firing_ns + 1e-3).astype(int), self.shape[1] - 1)
        points["ring"] = rows
        grid[rows, columns] = points
        return grid.ravel()

    def poses(self) -> dict[str, SE3]:
        """The poses of the frames in the head, of /tf_static."""
        transforms = self.first("/tf_static").transforms
        for link in transforms:
            if link.header.frame_id != "head":
                raise ValueError(f"/tf_static: {link.child_frame_id} is in {link.header.frame_id} instead of head")
        return {"head": SE3.identity()} | {link.child_frame_id: pose(link.transform) for link in transforms}

    def scan(self, message) -> LidarMeasurement:
        """A scan as evalio expects it; its stamp is that of its first beam."""
        points = points_of(message)
        if len(self.rings_deg):
            points = self.organised(points)
        header = PointCloudMetadata(
            stamp=Stamp(sec=message.header.stamp.sec, nsec=message.header.stamp.nanosec),
            height=1,
            width=len(points),
            row_step=points.nbytes,
            point_step=POINT.itemsize,
            is_bigendian=False,
            is_dense=True,
        )
        scan = pc2_to_evalio(header, FIELDS, points.tobytes())
        fill_col_row_major(scan)
        return scan

    def sample(self, message) -> ImuMeasurement:
        """A sample of the IMU: angular velocity in rad/s, specific force in m/s^2."""
        stamp = Stamp(sec=message.header.stamp.sec, nsec=message.header.stamp.nanosec)
        return ImuMeasurement(stamp, vector(message.angular_velocity), vector(message.linear_acceleration))

    def imu_iter(self) -> Iterator[ImuMeasurement]:
        return (self.sample(message) for _, message in self.messages(IMU))

    def lidar_iter(self) -> Iterator[LidarMeasurement]:
        return (self.scan(message) for _, message in self.messages(LIDAR))

    def __iter__(self) -> Iterator[ImuMeasurement | LidarMeasurement]:
        for topic, message in self.messages(LIDAR, IMU):
            yield self.scan(message) if topic == LIDAR else self.sample(message)

    def __len__(self) -> int:
        return self.reader.topics[LIDAR].msgcount

    def truth(self) -> Trajectory | None:
        """The true trajectory of the head under /ground_truth, in lidar time; None if the recording has none."""
        stamps, poses = [], []
        for _, message in self.messages("/ground_truth/pose"):
            stamps.append(Stamp(sec=message.header.stamp.sec, nsec=message.header.stamp.nanosec))
            poses.append(pose(message.pose))
        return Trajectory(stamps=stamps, poses=poses) if poses else None


def vector(xyz) -> np.ndarray:
    """A vector of ROS as an array."""
    return np.array([xyz.x, xyz.y, xyz.z])


def pose(message) -> SE3:
    """A Pose or a Transform of ROS."""
    position = getattr(message, "position", None) or message.translation
    turn = getattr(message, "orientation", None) or message.rotation
    return SE3(SO3(qx=turn.x, qy=turn.y, qz=turn.z, qw=turn.w), vector(position))


class Zsim(Dataset):
    """Recordings of zsim, one sequence per file in ZSIM_RECORDINGS."""

    _ignore_ = ["file"]
    for file in sorted(FOLDER.glob("*.mcap")):
        # The prefix keeps a file such as imu.mcap apart from the methods below.
        vars()[f"recording_{file.stem}"] = file.stem

    @property
    def path(self) -> Path:
        """The recording."""
        return (FOLDER / f"{self.value}.mcap").resolve()

    def data_iter(self) -> Recording:
        return Recording(self.path)

    def truth_file(self) -> Path | None:
        """The true trajectory as TUM file: in the folder of the recording, or in the folder `truth` of a benchmark."""
        of_recording = self.path.with_suffix(".tum")
        of_suite = self.path.parent.parent / "truth" / of_recording.name
        return next((file for file in (of_recording, of_suite) if file.exists()), None)

    def ground_truth_raw(self) -> Trajectory | None:
        file = self.truth_file()
        # Trajectory.from_tum of evalio 0.6.1 expects commas.
        return Trajectory.from_csv(file, TUM, delimiter=" ") if file else self.data_iter().truth()

    def imu_T_lidar(self) -> SE3:
        poses = self.data_iter().poses()
        return poses["imu_link"].inverse() * poses["laser"]

    def imu_T_gt(self) -> SE3:
        return self.data_iter().poses()["imu_link"].inverse()

    def imu_params(self) -> ImuParams:
        recording = self.data_iter()
        message = recording.first(IMU)
        rate_hz = recording.rate_hz(IMU)
        return ImuParams(
            # zsim writes the variance of a sample; densities are per square root of the rate.
            gyro=float(np.sqrt(message.angular_velocity_covariance[0] / rate_hz)),
            accel=float(np.sqrt(message.linear_acceleration_covariance[0] / rate_hz)),
            # A recording does not contain the bias walks: those of an ordinary MEMS IMU.
            gyro_bias=5e-5,
            accel_bias=5e-4,
            gravity=np.array([0.0, 0.0, -9.80665]),
            rate=rate_hz,
        )

    def lidar_params(self) -> LidarParams:
        recording = self.data_iter()
        return LidarParams(
            num_rows=recording.shape[0],
            num_columns=recording.shape[1],
            min_range=MIN_RANGE_M,
            max_range=MAX_RANGE_M,
            rate=recording.rate_hz(LIDAR),
        )

    def files(self) -> Sequence[Path]:
        return [self.path]

    def quick_len(self) -> int:
        return len(self.data_iter())

    @staticmethod
    def url() -> str:
        return "made by zsim simulate"


if not Zsim.sequences():
    print_warning(f"no recording NAME.mcap in the folder {FOLDER.resolve()}: set ZSIM_RECORDINGS to the folder of the recordings")
