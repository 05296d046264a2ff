#!/usr/bin/env bash
# Estimates trajectory and map from a recording with a calibration file: run.sh [RECORDING]
# Without RECORDING it simulates one, and ignores what the simulator wrote into it about the sensors.
# Writes the folder estimate into the current folder.
set -euo pipefail
here=$(dirname "$0")
recording=${1:-}
if [ -z "$recording" ]; then
  recording=recording.mcap
  zsim --quiet simulate --scene mocap_room --duration 12s --seed 1 --out "$recording" --force >/dev/null
fi

zsim info "$recording" # rates, gaps, and offsets between the clocks
zsim --quiet estimate "$recording" --ignore-manifest --calibration "$here/calibration.ron" --out estimate --force
