"""Recordings: measurements and ground truth as arrays."""

from __future__ import annotations

import os
from collections.abc import Iterator
from functools import cached_property
from pathlib import Path

from . import _zsim
from ._zsim import Calibration, Trajectory, Window


class Recording:
    """A recording: MCAP, a ROS 1 bag, a rosbag2 database, or a folder of rosbag2.

    `all`, `truth` and `windows` read the file; `all` and `truth` are kept.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self._recording = _zsim.Recording(path)

    @classmethod
    def _of(cls, recording: _zsim.Recording) -> Recording:
        self = cls.__new__(cls)
        self._recording = recording
        return self

    @property
    def path(self) -> Path:
        """The file or folder."""
        return self._recording.path

    @cached_property
    def truth(self) -> Trajectory | None:
        """The true poses of the head, `world_from_head`, in lidar time; None for a recording of real sensors."""
        return self._recording.read_truth()

    @cached_property
    def all(self) -> Window:
        """All measurements. An hour has about 1 GB: use `windows` for long recordings."""
        return self._recording.read_all()

    def windows(self, seconds: float) -> Iterator[Window]:
        """Reads the measurements in windows of this many seconds, by their stamps; only two are in memory.

        A window can be shorter where the recording has a gap. Data that cannot be read are a warning at the end.
        """
        return self._recording.windows(seconds)

    def calibration(self, file: str | os.PathLike[str] | None = None) -> Calibration:
        """Poses and noise of the sensors: from `file`, else from the recording, else those of unknown sensors."""
        return self._recording.calibration(file)

    def __fspath__(self) -> str:
        return str(self._recording.path)

    def __repr__(self) -> str:
        return f"<zsim.Recording: {self.path}>"
