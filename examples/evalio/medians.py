"""Prints the position errors of a suite, medians over the seeds and (maximum): medians.py SUITE

Reads SUITE/suite.json, and SUITE/scores.csv of `zsim benchmark score`. A failed recording counts as an infinite error.
"""

import csv
import json
import sys
from collections import defaultdict
from math import inf
from pathlib import Path
from statistics import median


def length(error_m: float) -> str:
    if error_m == inf:
        return "failed"
    return f"{error_m:.1f} m" if error_m >= 1.0 else f"{1e3 * error_m:.3g} mm"


def main(folder: str) -> None:
    settings = {r["name"]: r["settings"] for r in json.loads(Path(folder, "suite.json").read_text())["recordings"]}
    groups = defaultdict(lambda: defaultdict(list))
    with open(Path(folder, "scores.csv")) as file:
        for row in csv.DictReader(file):
            error_m = inf if row["failure"] else float(row["position_rmse_m"])
            groups[tuple(settings[row["recording"]].items())][row["system"]].append(error_m)
    axes, systems = [name for name, _ in next(iter(groups))], list(next(iter(groups.values())))
    print("|", " | ".join([*axes, "seeds", *systems]), "|")
    print("|" + "---|" * (len(axes) + 1 + len(systems)))
    for setting, of_system in groups.items():
        cells = [f"{length(median(errors))} ({length(max(errors))})" for errors in of_system.values()]
        print("|", " | ".join([*(value for _, value in setting), str(len(of_system[systems[0]])), *cells]), "|")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(sys.argv[1])
