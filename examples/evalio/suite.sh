#!/usr/bin/env bash
# Runs zsim's estimator, RKO-LIO and KISS-ICP on a benchmark suite, and scores them: suite.sh [FOLDER]   [default: suite]
# Needs `pip install evalio==0.6.1 rko-lio==0.4.0`. Writes the folder of the suite and FOLDER_estimates. A second start continues.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
suite=$(realpath -m "${1:-suite}")
out=${suite}_estimates
python=$(dirname "$(command -v evalio)")/python
export PYTHONPATH=$here EVALIO_CUSTOM=zsim_evalio,rko_evalio EVALIO_DATA=. ZSIM_RECORDINGS=$suite/recordings OMP_NUM_THREADS=1

zsim benchmark plan "$here/suite.ron" -o "$suite"
mkdir -p "$out/zsim"
for recording in "$suite"/recordings/*.mcap; do
  name=$(basename "$recording" .mcap)
  [ -e "$out/zsim/$name.tum" ] && continue
  # Without loop closure and without the manifest: the other systems have neither. Exit code 3: see the score.
  zsim --quiet --threads 1 estimate "$recording" --open-loop --ignore-manifest --out "$out/work" --force >/dev/null || [ $? = 3 ]
  cp "$out/work/open_loop.tum" "$out/zsim/$name.tum"
done
(cd "$out" && evalio run -c "$here/pipelines.yaml")
systems=(--system "zsim=$out/zsim")
for pipeline in rko kiss; do
  "$python" "$here/to_tum.py" "$out/evalio_results/pipelines" "$pipeline" "$out/$pipeline"
  systems+=(--system "$pipeline=$out/$pipeline")
done
zsim benchmark score "$suite" "${systems[@]}"
"$python" "$here/medians.py" "$suite"
