#!/usr/bin/env python3
"""Kills `zsim simulate` and `zsim sweep run` many times at random moments.

After each kill it checks that finished parts can be read, that no file of an earlier run was replaced, and that a
second start continues to the same result as a run without kills. Takes 1 s per kill; CI does 12, `.ci/full` 300.

    python3 tests/kill_many.py target/release/zsim --kills 300 --seed 1
"""

import argparse
import collections
import json
import pathlib
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time

SPRINGS = """(
    base: spring(head: "handheld", shake: (pitch_deg: 2.0)),
    axes: [
        linear(path: "head.coil_diameter_mm", from: 18.0, to: 34.0),
        log(path: "head.wire_diameter_mm", from: 1.6, to: 4.0),
    ],
    sampling: sobol(count: 16384),
    measures: [rocking_hz, spring_mass_g],
)"""

WALKS = """(
    base: journey(
        scene: "mocap_room", head: "handheld", motion: "hand", lidar: "utm30lx", imu: "3dm_gx2", clock: "drifting",
        estimator: "default", duration_s: 6.0, limit: (time_s: 300.0, memory_mib: 2048),
    ),
    axes: [values(path: "imu", values: ["3dm_gx2", "tactical"])],
    sampling: grid,
    seeds: [1, 2],
    measures: [position_rmse_m, fraction_seen],
)"""

SIMULATE = ["simulate", "--scene", "mocap_room", "--quiet"]
ENDINGS = {signal.SIGKILL: [-9], signal.SIGINT: [130, 0], signal.SIGTERM: [143, 0]}


class Failure(Exception):
    """A check that failed."""


def require(condition, message):
    if not condition:
        raise Failure(message)


class Killer:
    """Starts zsim in a folder and kills it."""

    def __init__(self, program, folder, random_source):
        self.program, self.folder, self.random_source = program, folder, random_source
        self.count = collections.Counter()

    def run(self, *arguments):
        return subprocess.run([self.program, *arguments], cwd=self.folder, capture_output=True, text=True)

    def run_ok(self, *arguments):
        ended = self.run(*arguments)
        require(ended.returncode == 0, f"{arguments} ended with {ended.returncode}: {ended.stderr}")
        return ended.stdout

    def run_and_kill(self, arguments, longest_s, kind):
        """Runs a command and kills it after a random time; returns whether it was still running."""
        sent = self.random_source.choice(list(ENDINGS))
        process = subprocess.Popen(
            [self.program, *arguments], cwd=self.folder, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
        )
        time.sleep(self.random_source.uniform(0.0, longest_s))
        was_running = process.poll() is None
        process.send_signal(sent)
        _, talk = process.communicate(timeout=120)
        if was_running:
            # In its first milliseconds a process has no handlers yet; the signal terminates it directly.
            expected = ENDINGS[sent] + [-sent]
            require(process.returncode in expected, f"{sent.name}: exit code {process.returncode}: {talk}")
            self.count[f"{kind} {sent.name}"] += 1
        return was_running

    def files(self, pattern):
        return sorted(pathlib.Path(self.folder).glob(pattern))


def kill_simulate(killer):
    """Checks that a killed recording can be read, and that the next one does not replace it."""
    was_killed = killer.run_and_kill([*SIMULATE, "--duration", "60s", "--out", "run.mcap"], 3.0, "simulate")
    for path in killer.files("run*.mcap"):
        if path.stat().st_size == 0:
            continue
        info = killer.run("info", path.name, "--json")
        is_only_started = "not an MCAP file" in info.stderr or "too short" in info.stderr
        require(info.returncode in (0, 3) or is_only_started, f"info of {path.name}: {info.returncode} {info.stderr}")
        require("panicked" not in info.stderr, info.stderr)
    before = {path.name: path.read_bytes() for path in killer.files("run*")}
    again = killer.run(*SIMULATE, "--duration", "1s", "--out", "run.mcap")
    if before:
        require(again.returncode == 1 and "exists" in again.stderr, f"{again.returncode} {again.stderr}")
    else:
        require(again.returncode == 0, f"{again.returncode} {again.stderr}")
    for name, content in before.items():
        require((killer.folder / name).read_bytes() == content, f"{name} was changed")
    killer.run_ok(*SIMULATE, "--duration", "1s", "--out", "run-other.mcap")
    require(killer.run("info", "run-other.mcap").returncode == 0, "run-other.mcap cannot be read")
    for path in killer.files("run*"):
        path.unlink()
    return was_killed


def kill_forced(killer):
    """Checks that a replaced recording is completely the old one or the new one."""
    if not (killer.folder / "kept.mcap").exists():
        killer.run_ok(*SIMULATE, "--duration", "2s", "--out", "kept.mcap")
    command = [*SIMULATE, "--duration", "20s", "--out", "kept.mcap", "--force"]
    was_killed = killer.run_and_kill(command, 1.5, "simulate --force")
    info = killer.run("info", "kept.mcap", "--json")
    require(info.returncode == 0, f"the replaced recording: {info.returncode} {info.stderr}")
    for path in killer.files("kept.partial*"):
        path.unlink()
    return was_killed


class SweepCheck:
    """Compares a sweep that is killed and continued until complete with one without kills."""

    def __init__(self, name, spec, longest_s):
        self.name, self.spec, self.longest_s, self.reference = name, spec, longest_s, None

    def prepare(self, killer):
        (killer.folder / f"{self.name}.ron").write_text(self.spec)
        killer.run_ok("study", f"{self.name}.ron", "-o", f"{self.name}-whole", "--quiet")
        self.reference = self.table(killer, f"{self.name}-whole")

    def table(self, killer, folder):
        return [(killer.folder / folder / name).read_bytes() for name in ("table.csv", "table.schema.json")]

    def kill(self, killer):
        folder = f"{self.name}-cut"
        if not (killer.folder / folder / "plan.ron").exists():
            killer.run_ok("sweep", "plan", f"{self.name}.ron", "-o", folder)
        command = ["sweep", "run", folder, "--quiet", "--threads", "2"]
        was_killed = killer.run_and_kill(command, self.longest_s, f"sweep {self.name}")
        status = json.loads(killer.run_ok("sweep", "status", folder, "--json"))
        require(status["damaged"] == 0, f"damaged parts: {status}")
        if status["missing"] == 0 or killer.random_source.random() < 0.1:
            killer.run_ok("sweep", "run", folder, "--quiet", "--threads", "2")
            killer.run_ok("sweep", "merge", folder, "--quiet")
            require(self.table(killer, folder) == self.reference, f"{folder} has another table than a run without kills")
            killer.count[f"sweep {self.name} completed"] += 1
            shutil.rmtree(killer.folder / folder)
        return was_killed


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=pathlib.Path, help="the command zsim")
    parser.add_argument("--kills", type=int, default=300, help="number of kills (default: 300)")
    parser.add_argument("--seed", type=int, default=1, help="seed of the random times and signals (default: 1)")
    arguments = parser.parse_args()
    random_source = random.Random(arguments.seed)
    with tempfile.TemporaryDirectory() as folder:
        killer = Killer(arguments.program.resolve(), pathlib.Path(folder), random_source)
        sweeps = [SweepCheck("springs", SPRINGS, 1.0), SweepCheck("walks", WALKS, 2.0)]
        for sweep in sweeps:
            sweep.prepare(killer)
        kinds = [kill_simulate, kill_forced] + [sweep.kill for sweep in sweeps]
        done = attempts = 0
        while done < arguments.kills and attempts < 10 * arguments.kills:
            done += kinds[attempts % len(kinds)](killer)
            attempts += 1
        for kind, count in sorted(killer.count.items()):
            print(f"{count:5d}  {kind}")
        print(f"{done} kills in {attempts} starts: no failures")


if __name__ == "__main__":
    try:
        main()
    except Failure as failure:
        sys.exit(f"failed: {failure}")
