"""The package against the command, numpy, and the specification of the recordings."""

import _thread
import gc
import json
import math
import subprocess
import signal
import threading
import time

import numpy as np
import pytest

import zsim


@pytest.fixture(scope="module")
def recording():
    return zsim.simulate(scene="mocap_room", duration_s=8.0, seed=3)


def test_the_arrays_fit_together(recording):
    data = recording.all
    samples, scans, returns = len(data.imu_stamp_ns), len(data.scan_stamp_ns), len(data.return_stamp_ns)
    # The IMU has 100 Hz, the lidar 40 Hz.
    assert abs(samples - 800) <= 3 and abs(scans - 320) <= 3
    assert data.angular_velocity_rad_per_s.shape == data.specific_force_m_per_s2.shape == (samples, 3)
    assert data.point_in_laser_m.shape == (returns, 3) and data.intensity.shape == (returns,)
    assert data.scan_start.shape == (scans + 1,) and data.scan_start[-1] == returns
    assert np.all(np.diff(data.imu_stamp_ns) > 0) and np.all(np.diff(data.scan_stamp_ns) > 0)
    # A planar lidar: z is zero. Mean specific force over a walk: gravity.
    assert np.all(data.point_in_laser_m[:, 2] == 0.0)
    assert abs(np.linalg.norm(data.specific_force_m_per_s2, axis=1).mean() - 9.81) < 0.5
    assert np.allclose(np.linalg.norm(recording.truth.quaternion_xyzw, axis=1), 1.0)


def test_windows_in_their_order_are_the_whole_recording(recording):
    windows = list(recording.windows(1.0))
    assert 8 <= len(windows) <= 9
    for name in ("imu_stamp_ns", "scan_stamp_ns", "return_stamp_ns", "point_in_laser_m", "specific_force_m_per_s2"):
        joined = np.concatenate([getattr(window, name) for window in windows])
        assert np.array_equal(joined, getattr(recording.all, name)), name
    for window in windows:
        stamps = np.concatenate([window.imu_stamp_ns, window.scan_stamp_ns])
        # Windows end at the first return of a scan, which is up to a scan after its stamp.
        assert stamps.max() - stamps.min() < 1_025_000_000


def test_one_seed_gives_the_bytes_of_the_command(recording, tmp_path, command):
    path = tmp_path / "a.mcap"
    run = [command, "simulate", "--scene", "mocap_room", "--duration", "8s", "--seed", "3", "--out", path]
    subprocess.run(run, check=True, capture_output=True)
    with open(recording, "rb") as ours:
        assert ours.read() == path.read_bytes()


def test_an_estimator_fed_by_hand_has_the_trajectory_of_the_file(recording):
    estimate = zsim.estimate(recording, closed_loop=False)
    assert estimate.closed_loop is None and estimate.metrics["open_loop"]["position_rmse_m"] < 0.01

    fed = zsim.Estimator(recording.calibration())
    data = recording.all
    events = [(stamp, "imu", k) for k, stamp in enumerate(data.imu_stamp_ns)]
    events += [(stamp, "scan", k) for k, stamp in enumerate(data.scan_stamp_ns)]
    taken = []
    for stamp, kind, k in sorted(events):
        if kind == "imu":
            fed.push_imu(stamp, data.angular_velocity_rad_per_s[k], data.specific_force_m_per_s2[k])
        else:
            returns = slice(data.scan_start[k], data.scan_start[k + 1])
            fed.push_scan(stamp, data.return_stamp_ns[returns], data.point_in_laser_m[returns])
        taken.append(fed.take_poses())
    taken.append(fed.finish())
    assert all(isinstance(sentence, str) for sentence in fed.warnings)
    positions = np.concatenate([poses.position_m for poses in taken if len(poses)])
    # TUM files have nine decimals.
    assert positions.shape == estimate.open_loop.position_m.shape
    assert np.abs(positions - estimate.open_loop.position_m).max() < 1e-8
    with pytest.raises(zsim.InputError, match="create another Estimator"):
        fed.finish()


def test_an_evaluation_is_that_of_the_command_and_of_numpy(recording, tmp_path, command):
    truth = recording.truth
    error = np.array([0.01, -0.02, 0.005]) * np.sin(np.arange(len(truth)))[:, None]
    estimate = zsim.Trajectory(truth.stamp_ns, truth.position_m + error, truth.quaternion_xyzw)
    found = zsim.evaluate(estimate, recording)
    # The alternating error has no part that an alignment removes; RMS of the sine is 1 / sqrt 2.
    expected = np.linalg.norm([0.01, -0.02, 0.005]) / np.sqrt(2)
    assert found.figures["position_rmse_m"] == pytest.approx(expected, rel=1e-2)
    rmse = np.sqrt((found.position_error_m**2).sum(axis=1).mean())
    assert found.figures["position_rmse_m"] == pytest.approx(rmse, rel=1e-12)
    assert found.figures["drift_m_per_min"] is None

    estimate.write(tmp_path / "a.tum")
    run = [command, "compare", "--truth", recording.path, tmp_path / "a.tum", "--json"]
    text = subprocess.run(run, check=True, capture_output=True, text=True).stdout
    theirs = json.loads(text)["trajectories"][0]
    for key, value in found.figures.items():
        # TUM files have nine decimals: 1e-9 in a quaternion are 1e-7 degrees.
        expected = theirs[key] if value is None else pytest.approx(theirs[key], rel=1e-5, abs=5e-7)
        assert value == expected, key
    again = zsim.evaluate(tmp_path / "a.tum", recording)
    assert again.figures["position_rmse_m"] == pytest.approx(rmse, rel=1e-5)


def test_a_spring_has_the_figures_of_the_command_and_scales_with_its_wire(command):
    spring = zsim.Spring("handheld")
    text = subprocess.run([command, "spring", "handheld", "--json"], check=True, capture_output=True, text=True).stdout
    assert spring.report == json.loads(text) and spring.stands
    assert spring.stiffness.shape == (6, 6) and np.allclose(spring.stiffness, spring.stiffness.T)
    coil = spring.report["coil"]
    # Axial stiffness of a coil is proportional to the fourth power of the wire's diameter.
    wires = [zsim.Spring("handheld", wire_diameter_mm=d).report["coil"]["axial_n_per_m"] for d in (3.0, 3.3)]
    assert wires[1] / wires[0] == pytest.approx(1.1**4, rel=1e-6) and coil["axial_n_per_m"] > 0
    assert spring.modes[0]["frequency_hz"] < spring.modes[-1]["frequency_hz"]


def test_gains_peak_at_the_mode_of_the_spring():
    spring = zsim.Spring("handheld")
    gains = spring.gains("y_rot", up_to_hz=3.0, realisations=2)
    peak_hz = gains["freq_hz"][gains["gain_model"].argmax()]
    assert peak_hz == pytest.approx(spring.modes[0]["frequency_hz"], rel=0.1)
    with pytest.raises(zsim.InputError, match="x_rot, y_rot"):
        spring.gains("pitch")


def test_a_sweep_is_a_table(tmp_path):
    spec = tmp_path / "springs.ron"
    spec.write_text(
        """(base: spring(head: "handheld", shake: (pitch_deg: 2.0)),
            axes: [values(path: "head.wire_diameter_mm", values: [3.0, 3.2, 3.4])],
            sampling: grid, measures: [rocking_hz, spring_mass_g])"""
    )
    shown = []
    table = zsim.sweep(spec, tmp_path / "out", progress=lambda stage, fraction: shown.append((stage, fraction)))
    assert list(table["wire_diameter_mm"]) == [3.0, 3.2, 3.4]
    assert table["rocking_hz"].is_monotonic_increasing
    assert [str(table[name].dtype) for name in ("point", "rocking_hz")] == ["int64", "float64"]
    assert table["error"].isna().all()
    frame = zsim.read_sweep(tmp_path / "out", to="polars")
    assert frame["rocking_hz"].to_list() == list(table["rocking_hz"])
    assert [str(frame.schema[name]) for name in ("point", "rocking_hz", "error")] == ["Int64", "Float64", "String"]
    arrow = zsim.read_sweep(tmp_path / "out", to="pyarrow")
    assert arrow.column("rocking_hz").to_pylist() == list(table["rocking_hz"])
    assert [arrow.column(name).null_count for name in ("spring_mass_g", "error")] == [0, 3]
    assert [str(arrow.schema.field(name).type) for name in ("point", "error")] == ["int64", "string"]
    with pytest.raises(zsim.InputError, match="pandas"):
        zsim.read_sweep(tmp_path / "out", to="excel")
    with pytest.raises(zsim.InputError, match="sweep merge"):
        zsim.read_sweep(tmp_path)


def test_a_temporary_recording_is_deleted_with_its_object():
    recording = zsim.simulate(scene="mocap_room", duration_s=1.0)
    path = recording.path
    assert path.exists()
    del recording
    gc.collect()
    assert not path.exists()


def test_errors_have_the_sentences_of_the_library(tmp_path, recording):
    for arguments, words in [
        ({"scene": "nowhere"}, "built in are: "),
        ({"scene": "mocap_room", "head": "nosuch"}, "no such head"),
        ({"scene": "mocap_room", "duration_s": -1.0}, "above 0"),
        ({"scene": "mocap_room", "seed": -1}, "seed: .*u64"),
        ({"scene": "mocap_room", "path": tmp_path / "a.tum"}, "another ending"),
    ]:
        with pytest.raises(zsim.InputError, match=words):
            zsim.simulate(**arguments)
    existing = tmp_path / "b.mcap"
    existing.write_text("no recording")
    with pytest.raises(zsim.InputError, match="overwrite=True"):
        zsim.simulate(scene="mocap_room", duration_s=1.0, path=existing)
    for call in (zsim.Recording, zsim.estimate):
        with pytest.raises(zsim.Error, match="not an MCAP file"):
            call(existing)
    with pytest.raises(zsim.Error, match="do not overlap in time"):
        truth = recording.truth
        later = zsim.Trajectory(truth.stamp_ns + 10**12, truth.position_m, truth.quaternion_xyzw)
        zsim.evaluate(later, truth)
    with pytest.raises(zsim.InputError, match="no coil|unknown"):
        zsim.Spring("handheld", colour=3)


def test_progress_reaches_the_end_and_an_exception_of_it_stops():
    shown = []
    zsim.simulate(scene="mocap_room", duration_s=20.0, progress=lambda stage, fraction: shown.append((stage, fraction)))
    fractions = [fraction for _, fraction in shown]
    assert fractions == sorted(fractions) and fractions[-1] == pytest.approx(1.0, abs=0.05)
    assert {stage for stage, _ in shown} == {"simulating"}

    def fail(stage, fraction):
        raise ValueError("enough")

    with pytest.raises(ValueError, match="enough"):
        zsim.simulate(scene="mocap_room", duration_s=600.0, progress=fail)


def test_a_recording_is_overwritten_only_by_a_complete_one(tmp_path):
    path = tmp_path / "run.mcap"
    files = [path, path.with_suffix(".tum")]
    zsim.simulate(scene="mocap_room", duration_s=1.0, path=path)
    old = [file.read_bytes() for file in files]

    def fail(stage, fraction):
        raise ValueError("enough")

    with pytest.raises(ValueError, match="enough"):
        zsim.simulate(scene="mocap_room", duration_s=600.0, path=path, overwrite=True, progress=fail)
    assert [file.read_bytes() for file in files] == old
    assert len(list(tmp_path.iterdir())) == 2
    # Twice as long: the truth of a scene whose motion has no noise is the same for every seed.
    zsim.simulate(scene="mocap_room", duration_s=2.0, path=path, overwrite=True)
    assert all(file.stat().st_size > 1.5 * len(before) for file, before in zip(files, old))
    assert len(list(tmp_path.iterdir())) == 2


def processor_s():
    """Processor time of this process with its threads, s."""
    return time.clock_gettime(time.CLOCK_PROCESS_CPUTIME_ID)


@pytest.mark.parametrize(
    "minutes_long",
    [
        lambda: zsim.simulate(scene="office", duration_s=36000.0),
        lambda: zsim.Spring("handheld").gains(realisations=400),
    ],
)
def test_an_interrupt_stops_a_computation(minutes_long):
    # A shell starts background jobs with the signal ignored; Python then has no handler for it.
    previous = signal.signal(signal.SIGINT, signal.default_int_handler)
    threading.Timer(2.5, _thread.interrupt_main).start()
    start = time.monotonic()
    try:
        with pytest.raises(KeyboardInterrupt):
            minutes_long()
    finally:
        signal.signal(signal.SIGINT, previous)
    assert time.monotonic() - start < 20.0
    # Nothing goes on in the background.
    after = processor_s()
    time.sleep(1.0)
    assert processor_s() - after < 0.3


def test_invalid_arguments_are_errors_that_name_them(tmp_path):
    spring = zsim.Spring(frequency_hz=np.float32(1.5), coil_diameter_mm=np.int64(25))
    assert spring.stands
    pose = ([0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0])
    invalid = [
        ("duration_s=nan", lambda: zsim.simulate(scene="mocap_room", duration_s=math.nan)),
        ("route=", lambda: zsim.simulate(scene="mocap_room", route=["a"])),
        ("ending of a ROS 1 bag", lambda: zsim.simulate(scene="mocap_room", duration_s=1.0, path=tmp_path / "run.bag")),
        ("progress=5", lambda: zsim.simulate(scene="mocap_room", duration_s=1.0, progress=5)),
        ("frequency_hz", lambda: zsim.Spring(frequency_hz=0.0)),
        ("head_from_laser", lambda: zsim.Calibration(([math.nan, 0.0, 0.0], pose[1]), pose)),
        ("head_from_imu", lambda: zsim.Calibration(pose, (pose[0], [0.0] * 4))),
        ("stamp_ns: .* got float64", lambda: zsim.Trajectory([0.0, 0.1], np.zeros((2, 3)), np.ones((2, 4)))),
        ("stamp_ns: .* largest", lambda: zsim.Trajectory(np.array([2**63], np.uint64), [[0.0] * 3], [pose[1]])),
        (r"stamp_ns: .* \(1, 2\)", lambda: zsim.Trajectory([[0, 1]], np.zeros((2, 3)), np.ones((2, 4)))),
        ("position_m: .* got <U1", lambda: zsim.Trajectory([0], [["a", "b", "c"]], [pose[1]])),
        (r"position_m: .* \(3,\)", lambda: zsim.Trajectory([0], [0.0, 0.0, 0.0], [pose[1]])),
        ("2 positions", lambda: zsim.Trajectory([0], np.zeros((2, 3)), [pose[1]])),
    ]
    for name, call in invalid:
        with pytest.raises(zsim.InputError, match=name):
            call()


def test_integers_of_any_type_are_stamps():
    pose = ([[0.0, 0.0, 0.0]] * 2, [[0.0, 0.0, 0.0, 1.0]] * 2)
    for stamps in ([1, 2], np.array([1, 2], np.int32), np.array([1, 2], np.uint64), range(1, 3)):
        assert zsim.Trajectory(stamps, *pose).stamp_ns.tolist() == [1, 2]
    assert len(zsim.Trajectory([], np.zeros((0, 3)), np.zeros((0, 4)))) == 0


def test_accelerations_in_g_are_refused():
    pose = ([0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0])
    estimator = zsim.Estimator(zsim.Calibration(pose, pose))
    with pytest.raises(zsim.InputError, match="multiply accelerations in g by 9.80665"):
        for k in range(200):
            estimator.push_imu(10_000_000 * k, [0.0, 0.0, 0.0], [0.0, 0.0, 1.0])


def test_a_damaged_recording_is_a_warning(recording, tmp_path):
    with open(recording, "rb") as whole:
        data = whole.read()
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(data[: len(data) * 2 // 3])
    with pytest.warns(UserWarning, match="truncated"):
        window = zsim.Recording(cut).all
    assert 0 < len(window.imu_stamp_ns) < len(recording.all.imu_stamp_ns)
