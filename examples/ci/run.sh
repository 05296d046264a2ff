#!/usr/bin/env bash
# Tests a SLAM system on a simulated recording: exit code 1 if the position error exceeds a limit or the trajectory is incomplete.
#   run.sh [SLAM]      SLAM is called as `SLAM RECORDING.mcap TRAJECTORY.tum`   [default: slam.sh in the folder of this script]
# Settings from the environment: SCENE, MOTION, FAULTS, DURATION, SEED, LIMIT_M (position RMSE, m).
# Writes recording.mcap, recording.tum (ground truth), estimate.tum and the folder comparison (figures and plots).
set -euo pipefail
slam=$(realpath "${1:-$(dirname "$0")/slam.sh}")
limit=${LIMIT_M:-0.02}

zsim --quiet simulate --scene "${SCENE:-mocap_room}" --motion "${MOTION:-hand}" --faults "${FAULTS:-none}" \
  --duration "${DURATION:-12s}" --seed "${SEED:-1}" --out recording.mcap --force >/dev/null
"$slam" recording.mcap estimate.tum
zsim compare --truth recording.mcap estimate.tum --fail-above "position_rmse=${limit}m" --min-coverage 95% --out comparison --force
