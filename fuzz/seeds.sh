#!/usr/bin/env bash
# Makes seeds for the target `spec` from the specs that are shipped: a byte for the kind, then the text.
set -euo pipefail
cd "$(dirname "$0")"
mkdir -p corpus/spec
kind=0
for folder in ../scenes ../specs/heads ../specs/springs ../specs/lidars ../specs/imus ../specs/clocks ../specs/motions ../specs/estimators; do
  for file in "$folder"/*.ron; do
    [ -e "$file" ] || continue
    { printf "\\x$(printf %02x $kind)"; cat "$file"; } >"corpus/spec/$kind-$(basename "$file")"
  done
  kind=$((kind + 1))
done
