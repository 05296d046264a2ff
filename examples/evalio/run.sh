#!/usr/bin/env bash
# Runs KISS-ICP of evalio on a simulated recording, and compares its trajectory with the truth: run.sh
# Settings from the environment: SCENE, HEAD, DURATION, SEED, VOXEL_M (size of the map's voxels).
# Writes recordings/recording.mcap and .tum, evalio_results/kiss/zsim/recording/kiss.csv, kiss/recording.tum and the folder comparison.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
if ! command -v evalio >/dev/null; then
  echo "evalio is not installed: pip install evalio==0.6.1" >&2
  exit 77
fi
python=$(dirname "$(command -v evalio)")/python
export PYTHONPATH=$here EVALIO_CUSTOM=zsim_evalio EVALIO_DATA=. ZSIM_RECORDINGS=recordings

mkdir -p recordings
zsim --quiet simulate --scene "${SCENE:-office}" --head "${HEAD:-rigid}" --lidar mid360 --duration "${DURATION:-6s}" \
  --seed "${SEED:-1}" --out recordings/recording.mcap --force >/dev/null
cat >kiss.yaml <<END
datasets: [zsim/recording]
pipelines: [{pipeline: kiss, deskew: true, voxel_size: ${VOXEL_M:-0.25}}]
END
rm -rf evalio_results/kiss
evalio run -c kiss.yaml
"$python" "$here/to_tum.py" evalio_results/kiss kiss kiss
zsim compare --truth recordings/recording.tum kiss/recording.tum --out comparison --force
