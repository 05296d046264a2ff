"""Simulates a lidar and an IMU on a spring, and estimates trajectory and map from their measurements.

Units are SI, angles are radians unless a name says `deg`, and stamps are integer nanoseconds. Frames are right-handed
with z up; a transform `a_from_b` maps coordinates in `b` to coordinates in `a`. One seed gives the same bytes.

    recording = zsim.simulate(scene="office", duration_s=20.0, seed=3)
    estimate = zsim.estimate(recording)
    print(zsim.evaluate(estimate, recording).figures["position_rmse_m"])
"""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal, TypeAlias

from . import _zsim
from ._arguments import as_json
from ._zsim import Calibration, Error, Estimate, Estimator, Evaluation, InputError, Trajectory, Window
from ._progress import Progress, callback
from ._recording import Recording
from ._spring import Spring

__all__ = [
    "Calibration",
    "Error",
    "Estimate",
    "Estimator",
    "Evaluation",
    "InputError",
    "Recording",
    "Spring",
    "Trajectory",
    "Window",
    "estimate",
    "evaluate",
    "read_sweep",
    "simulate",
    "sweep",
]


__version__: str = _zsim.__version__

_Path: TypeAlias = str | os.PathLike[str]
_Table: TypeAlias = Literal["pandas", "polars", "pyarrow"]


def simulate(
    *,
    scene: _Path,
    head: _Path = "handheld",
    motion: _Path = "hand",
    lidar: _Path = "utm30lx",
    imu: _Path = "3dm_gx2",
    clock: _Path = "drifting",
    base_imu: _Path | None = None,
    faults: _Path | None = None,
    route: str | None = None,
    duration_s: float = 120.0,
    seed: int = 1,
    path: _Path | None = None,
    overwrite: bool = False,
    progress: Progress = None,
) -> Recording:
    """Simulates a recording with ground truth.

    The parts are names under `scenes/` and `specs/`, or files. Without `path` the recording is a temporary file, which is
    deleted with the result. With `path` (MCAP) the true trajectory is written next to it as TUM.
    `progress` is True for a line on stderr, or a function that receives the stage and the finished fraction, 0 to 1.
    """
    scenario = {
        "scene": os.fspath(scene),
        "head": os.fspath(head),
        "motion": os.fspath(motion),
        "lidar": os.fspath(lidar),
        "imu": os.fspath(imu),
        "clock": os.fspath(clock),
        "base_imu": base_imu and os.fspath(base_imu),
        "faults": faults and os.fspath(faults),
        "route": route,
        "duration_s": duration_s,
        "seed": seed,
    }
    return Recording._of(_zsim.simulate(as_json(scenario), path, overwrite, callback(progress)))


def estimate(
    recording: _Path,
    *,
    estimator: _Path = "default",
    calibration: _Path | None = None,
    closed_loop: bool = True,
    ignore_manifest: bool = False,
    out: _Path | None = None,
    progress: Progress = None,
) -> Estimate:
    """Estimates trajectory and map from a recording of any program, as `zsim estimate`.

    `recording` is a path or a `Recording`. `calibration` is a file with extrinsics and noise, for values that the
    recording does not contain. `out` is an empty or new folder for all results; without it they are temporary.
    """
    settings = {
        "estimator": os.fspath(estimator),
        "calibration": calibration and os.fspath(calibration),
        "closed_loop": closed_loop,
        "ignore_manifest": ignore_manifest,
    }
    return _zsim.estimate(os.fspath(recording), as_json(settings), out, callback(progress))


def evaluate(estimate: Trajectory | Estimate | _Path, truth: Trajectory | Recording | _Path) -> Evaluation:
    """Compares an estimate with the truth after a rigid alignment by the positions, as `evo_ape -a`.

    `estimate` is a `Trajectory`, a TUM file, or an `Estimate` (its closed loop, else its open loop). `truth` is a
    `Trajectory`, a TUM file, or a `Recording` with ground truth.
    """
    if isinstance(estimate, Recording):
        raise InputError(f"estimate={estimate}: a recording has no estimate; pass zsim.estimate(recording)")
    if isinstance(estimate, Estimate):
        estimate = estimate.closed_loop or estimate.open_loop
    if isinstance(truth, Recording):
        if truth.truth is None:
            raise InputError(f"{truth.path} has no ground truth: pass the true trajectory")
        truth = truth.truth
    return _zsim.evaluate(_trajectory(estimate), _trajectory(truth))


def sweep(
    spec: _Path,
    out: _Path,
    *,
    to: _Table = "pandas",
    program: _Path | None = None,
    progress: Progress = None,
) -> Any:
    """Does the missing runs of a sweep or study, and returns its table, a row per run.

    `spec` is a name under `specs/studies/` or a file; `out` is the folder of the results, as of `zsim study`. An
    interrupted sweep continues. Full runs are processes of the command `zsim`, at `program` or in PATH. `to` is "pandas",
    "polars" or "pyarrow".
    """
    _reader_of_tables(to)
    program = program or shutil.which("zsim")
    _zsim.sweep(os.fspath(spec), out, program, callback(progress))
    return read_sweep(out, to=to)


def read_sweep(folder: _Path, *, to: _Table = "pandas") -> Any:
    """Reads the table of a sweep or study in `folder`, a row per run: parameters, seed, measures, error."""
    read = _reader_of_tables(to)
    table, schema = (Path(folder) / name for name in ("table.csv", "table.schema.json"))
    for path in (table, schema):
        if not path.exists():
            raise InputError(f"{path} is missing: `zsim sweep merge {folder}` writes it")
    fields = json.loads(schema.read_text(encoding="utf-8"))["fields"]
    return read(table, {field["name"]: field["type"] for field in fields})


def _reader_of_tables(to: str) -> Callable[[Path, dict[str, str]], Any]:
    """A function that reads a CSV file with these types of columns; an empty cell is missing."""
    if to == "pandas":
        import pandas

        return lambda path, types: pandas.read_csv(
            path,
            dtype=_each(types, {"integer": "int64", "number": "float64", "string": "str"}),
            keep_default_na=False,
            na_values=[""],
            float_precision="round_trip",
        )
    if to == "polars":
        import polars

        dtypes = {"integer": polars.Int64, "number": polars.Float64, "string": polars.String}
        return lambda path, types: polars.read_csv(path, schema=_each(types, dtypes))
    if to == "pyarrow":
        import pyarrow
        from pyarrow import csv

        dtypes = {"integer": pyarrow.int64(), "number": pyarrow.float64(), "string": pyarrow.string()}
        return lambda path, types: csv.read_csv(
            path,
            parse_options=csv.ParseOptions(newlines_in_values=True),
            convert_options=csv.ConvertOptions(
                column_types=_each(types, dtypes), null_values=[""], strings_can_be_null=True
            ),
        )
    raise InputError(f'to="{to}": use "pandas", "polars" or "pyarrow"')


def _each(types: dict[str, str], dtypes: dict[str, Any]) -> dict[str, Any]:
    return {name: dtypes[of] for name, of in types.items()}


def _trajectory(given: Trajectory | _Path) -> Trajectory:
    return given if isinstance(given, Trajectory) else Trajectory.read(given)
