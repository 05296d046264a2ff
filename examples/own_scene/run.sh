#!/usr/bin/env bash
# Checks a scene of one's own, draws its floor plan, and runs the handheld head through it: run.sh [DURATION]
# Writes workshop.svg and the folder workshop into the current folder.
set -euo pipefail
scene=$(dirname "$0")/workshop.ron

zsim check "$scene"
zsim scene plan "$scene" workshop.svg --force
zsim --quiet --scene "$scene" --duration "${1:-12s}" --seed 1 --open-loop --out workshop --force
