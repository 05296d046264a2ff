#!/usr/bin/env bash
# Chooses a spring for a head from a list of offered springs, and shows the head on its first spring for comparison.
# Writes the folder springs (pareto.csv, pareto.svg, ...) into the current folder.
set -euo pipefail
here=$(realpath "$(dirname "$0")")

zsim check "$here/head.ron"
zsim --quiet spring "$here/head.ron"
zsim --quiet spring design "$here/design.ron" --out springs --force
