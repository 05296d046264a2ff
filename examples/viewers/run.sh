#!/usr/bin/env bash
# Simulates a recording and estimates it, with the head as a robot model, for the viewers: run.sh
# Writes recording.mcap, the files next to it, and the folders head and estimate into the current folder.
set -euo pipefail
zsim --quiet simulate --scene mocap_room --duration 12s --seed 1 --out recording.mcap --force >/dev/null
zsim --quiet spring export handheld --out head --force >/dev/null
zsim --quiet estimate recording.mcap --out estimate --force
