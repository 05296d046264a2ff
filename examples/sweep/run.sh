#!/usr/bin/env bash
# Runs a sweep in the folder sweep: here, or with --slurm as a job array. A second call computes only what is missing.
#   run.sh [--slurm]
set -euo pipefail
spec=$(dirname "$0")/imu_and_motion.ron

[ -d sweep ] || zsim sweep plan "$spec" -o sweep
if [ "${1:-}" = --slurm ]; then
  zsim sweep submit sweep --slurm --elements 4 --sbatch "--time=0:30:00"
  echo "when squeue --me is empty: zsim sweep merge sweep"
else
  zsim sweep submit sweep --slurm --elements 4 --dry-run # writes sweep/slurm/array.sh, for a look
  zsim --quiet sweep run sweep
  zsim sweep merge sweep
fi
