"""Springs under a head."""

from __future__ import annotations

import os
from typing import Any

import numpy
from numpy.typing import NDArray

from . import _zsim
from ._arguments import as_json
from ._progress import Progress, callback


class Spring:
    """A head on its spring: stiffness, rest, modes and gains, as `zsim spring` and `zsim gains`.

    `head` and `spring` are names under `specs/` or files; without `spring` it is that of the head. Further arguments
    replace values of the coil: `coil_diameter_mm`, `wire_diameter_mm`, `active_coils`, `free_length_mm`. `pitch_deg` and
    `frequency_hz` are the nod of the hand for the response in `report` (default: at the slowest mode).
    """

    def __init__(
        self,
        head: str | os.PathLike[str] = "handheld",
        *,
        spring: str | os.PathLike[str] | None = None,
        lidar: str | os.PathLike[str] = "utm30lx",
        imu: str | os.PathLike[str] = "3dm_gx2",
        pitch_deg: float = 2.0,
        frequency_hz: float | None = None,
        **coil: float,
    ) -> None:
        settings = {
            "head": os.fspath(head),
            "spring": spring and os.fspath(spring),
            "coil": coil,
            "lidar": os.fspath(lidar),
            "imu": os.fspath(imu),
            "shake": {"pitch_deg": pitch_deg, "frequency_hz": frequency_hz},
        }
        self._spring = _zsim.Spring(as_json(settings))

    @property
    def report(self) -> dict[str, Any]:
        """All figures, as `zsim spring --json`; units are in the keys."""
        return self._spring.report

    @property
    def stands(self) -> bool:
        """Whether the head has a stable rest pose; otherwise `report["falls_because"]` has the reason."""
        return self._spring.stands

    @property
    def stiffness(self) -> NDArray[numpy.float64] | None:
        """Stiffness about the centre of mass at rest, gravity included: 6 x 6, x y z rx ry rz, N, m, rad; base axes."""
        return self._spring.stiffness

    @property
    def modes(self) -> list[dict[str, Any]]:
        """Modes about the rest pose, slowest first: `name`, `frequency_hz`, `damping_ratio`, `shape`."""
        return self._spring.modes

    def gains(
        self,
        axis: str = "y_rot",
        *,
        up_to_hz: float = 10.0,
        realisations: int = 4,
        seed: int = 1,
        progress: Progress = None,
    ) -> dict[str, NDArray[numpy.float64]]:
        """Measures head motion over base motion by frequency, in simulation, with the closed form for comparison.

        `axis` is a translation x, y, z (accelerations) or a rotation x_rot, y_rot, z_rot (rates). The keys of the result
        are `freq_hz`, `gain`, `gain_sigma`, `gain_model`, `coherence`, `phase_rad`, `phase_model_rad`.
        """
        settings = {"axis": axis, "up_to_hz": up_to_hz, "realisations": realisations, "seed": seed}
        curve = self._spring.measure_gains(as_json(settings), callback(progress))
        points = curve["points"]
        return {key: numpy.array([point[key] for point in points]) for key in points[0]}

    def __repr__(self) -> str:
        return repr(self._spring)
