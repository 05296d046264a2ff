#!/usr/bin/env bash
# Judges the claims of a study of two springs; the exit code is 1 if one is missed.
set -euo pipefail
zsim study "$(dirname "$0")/claims.ron" --out claims
