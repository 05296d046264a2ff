#!/usr/bin/env bash
# Tests a SLAM system on a simulated recording: fails if the position error exceeds a limit or the trajectory is incomplete.
#   run.sh [SLAM]      SLAM is called as `SLAM RECORDING.mcap TRAJECTORY.tum`   [default: slam.sh in the folder of this script]
# Settings from the environment: SCENE, MOTION, FAULTS, DURATION, SEED, LIMIT_M (position RMSE, m).
# Writes recording.mcap, recording.tum (ground truth), estimate.tum and errors.json into the current folder.
set -euo pipefail
slam=$(realpath "${1:-$(dirname "$0")/slam.sh}")
limit=${LIMIT_M:-0.02}

zsim --quiet simulate --scene "${SCENE:-mocap_room}" --motion "${MOTION:-hand}" --faults "${FAULTS:-none}" \
  --duration "${DURATION:-12s}" --seed "${SEED:-1}" --out recording.mcap --force >/dev/null
"$slam" recording.mcap estimate.tum
zsim evaluate --estimate estimate.tum --truth recording.tum --json >errors.json

value() { sed -n "s/^ *\"$1\": *\([-0-9.e]*\),*$/\1/p" errors.json; }
length() { awk '/^[^#]/ { if (!n++) first = $1; last = $1 } END { print last - first }' "$1"; }
awk -v error="$(value position_rmse_m)" -v limit="$limit" -v covered="$(value duration_s)" -v truth="$(length recording.tum)" '
  BEGIN {
    printf "position RMSE %.2f mm (limit %.2f mm), %.0f %% of the recording\n", 1e3 * error, 1e3 * limit, 100 * covered / truth
    if (error == "" || error + 0 > limit + 0) { print "FAILED: position error above the limit"; exit 1 }
    if (covered < 0.95 * truth) { print "FAILED: the trajectory covers less than 95 % of the recording"; exit 1 }
  }'
