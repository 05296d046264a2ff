"""RKO-LIO, the package rko-lio of PyPI, as a pipeline of evalio: EVALIO_CUSTOM=zsim_evalio,rko_evalio evalio run -p rko ..."""

from importlib.metadata import version

import numpy as np
from evalio.pipelines import Pipeline
from evalio.types import SE3, ImuMeasurement, ImuParams, LidarMeasurement, LidarParams, Stamp
from evalio.utils import print_warning
from rko_lio.config import LIOConfig
from rko_lio.lio import LIO
from rko_lio.rko_lio_pybind import InputError


class RkoLio(Pipeline):
    """RKO-LIO. A pose is that of the IMU at the end of a scan."""

    def __init__(self) -> None:
        super().__init__()
        self.settings, self.scans = dict(self.default_params()), []

    @staticmethod
    def name() -> str:
        return "rko"

    @staticmethod
    def url() -> str:
        return "https://github.com/PRBonn/rko_lio"

    @staticmethod
    def version() -> str:
        return version("rko_lio")

    @staticmethod
    def default_params() -> dict[str, bool | int | float | str]:
        # The defaults of the package, except for the initialisation: recordings of zsim begin at rest.
        return {"voxel_size": 1.0, "double_downsample": True, "initialization_phase": True, "max_num_threads": 0}

    def set_params(self, params: dict) -> dict:
        self.settings.update(params)
        return {key: value for key, value in params.items() if key not in self.default_params()}

    def set_imu_params(self, params: ImuParams) -> None:
        pass

    def set_lidar_params(self, params: LidarParams) -> None:
        self.ranges = {"min_range": params.min_range, "max_range": params.max_range}

    def set_imu_T_lidar(self, T: SE3) -> None:
        self.imu_from_lidar = T.to_mat()

    def map(self) -> dict:
        return {}

    def initialize(self) -> None:
        self.lio = LIO(LIOConfig(**self.settings, **self.ranges))

    def add_imu(self, mm: ImuMeasurement) -> None:
        time = mm.stamp.to_nsec()
        # A scan is registered when the samples reach its end.
        while self.scans and self.scans[0][1].max() < time:
            self.register(*self.scans.pop(0))
        self.lio.add_imu_measurement(mm.accel, mm.gyro, time, np.eye(4))

    def add_lidar(self, mm: LidarMeasurement) -> None:
        times = mm.stamp.to_nsec() + np.round(np.array(mm.to_vec_stamps()) * 1e9).astype(np.int64)
        if len(times):
            self.scans.append((np.array(mm.to_vec_positions()), times))

    def register(self, points: np.ndarray, times: np.ndarray) -> None:
        """Registers a scan with points in the frame of the lidar and times in ns."""
        try:
            self.lio.register_scan(points, times, self.imu_from_lidar)
        except InputError as error:
            # The program rko_lio omits such scans too, for example one without IMU samples.
            print_warning(f"RKO-LIO: scan until {times.max()} ns omitted: {error}")
            return
        self.save(Stamp.from_nsec(int(times.max())), SE3.from_mat(self.lio.pose()))
