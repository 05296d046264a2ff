"""zsim's estimator as a pipeline of evalio: EVALIO_CUSTOM=estimator_evalio evalio run -p zsim ...

Needs the Python package zsim (docs/guide/python.md). Poses are those of the open loop.
"""

from importlib.metadata import version

import numpy as np
import zsim
from evalio.pipelines import Pipeline
from evalio.types import SE3, SO3, ImuMeasurement, ImuParams, LidarMeasurement, LidarParams, Stamp


class ZsimEstimator(Pipeline):
    """The estimator of zsim; its head frame is that of the IMU. The poses of the last seconds are not saved."""

    def __init__(self) -> None:
        super().__init__()
        self.settings = dict(self.default_params())

    @staticmethod
    def name() -> str:
        return "zsim"

    @staticmethod
    def url() -> str:
        return "docs/guide/python.md in the repository of zsim"

    @staticmethod
    def version() -> str:
        return version("zsim")

    @staticmethod
    def default_params() -> dict[str, bool | int | float | str]:
        # Names of specs, or files: the noise models of the sensors, and the settings of the estimator.
        return {"lidar": "utm30lx", "imu": "unknown", "estimator": "default"}

    def set_params(self, params: dict) -> dict:
        self.settings.update(params)
        return {key: value for key, value in params.items() if key not in self.default_params()}

    def set_imu_params(self, params: ImuParams) -> None:
        pass

    def set_lidar_params(self, params: LidarParams) -> None:
        pass

    def set_imu_T_lidar(self, T: SE3) -> None:
        self.imu_from_lidar = T.trans, (T.rot.qx, T.rot.qy, T.rot.qz, T.rot.qw)

    def map(self) -> dict:
        return {}

    def initialize(self) -> None:
        sensors = {"lidar": self.settings["lidar"], "imu": self.settings["imu"]}
        imu_from_imu = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)
        self.estimator = zsim.Estimator(
            zsim.Calibration(self.imu_from_lidar, imu_from_imu, **sensors), self.settings["estimator"]
        )

    def add_imu(self, mm: ImuMeasurement) -> None:
        self.estimator.push_imu(mm.stamp.to_nsec(), mm.gyro, mm.accel)

    def add_lidar(self, mm: LidarMeasurement) -> None:
        stamp, points = mm.stamp.to_nsec(), np.array(mm.to_vec_positions()).reshape(-1, 3)
        times = stamp + np.round(np.array(mm.to_vec_stamps()) * 1e9).astype(np.int64)
        # Beams without a return are (0, 0, 0); scans with rings are not in the order of time.
        returns = np.flatnonzero(points.any(axis=1))
        returns = returns[np.argsort(times[returns], kind="stable")]
        self.estimator.push_scan(stamp, times[returns], points[returns])
        poses = self.estimator.take_poses()
        for time, position, (qx, qy, qz, qw) in zip(poses.stamp_ns, poses.position_m, poses.quaternion_xyzw):
            self.save(Stamp.from_nsec(int(time)), SE3(SO3(qx=qx, qy=qy, qz=qz, qw=qw), position))
