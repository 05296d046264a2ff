#!/usr/bin/env bash
# Makes the pictures of README and docs with zsim: docs/gallery.sh [FOLDER], by default docs/pictures.
#
# Needs zsim (ZSIM, by default target/release/zsim), Chromium, Node with playwright-core (target/ci-node, from .ci/tools), and
# Python with Pillow. Takes three minutes on two cores.
set -euo pipefail
cd "$(dirname "$0")/.."
zsim=$(realpath "${ZSIM:-target/release/zsim}")
pictures=$(realpath "${1:-docs/pictures}")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

"$zsim" --quiet --scene office --duration 60s --seed 1 --out "$work/office" >/dev/null
"$zsim" --quiet scene plan office "$work/plan.svg" >/dev/null
"$zsim" --quiet gains --head handheld --out "$work/gains" >/dev/null
"$zsim" --quiet spring handheld --out "$work/spring" >/dev/null
"$zsim" --quiet spring design spring_design --out "$work/springs" >/dev/null
"$zsim" --quiet coverage --head handheld --motion hand --duration 20s --out "$work/coverage" >/dev/null
node docs/gallery.mjs "${NODE_MODULES:-target/ci-node/node_modules}" "$work/plan.svg" "$work/office/report.html" \
  "$work/spring/report.html" "$work"

# Scenes: plan and perspective. Heads of the paper's figure 2 on their springs.
mkdir "$work/scenes"
for file in scenes/*.ron; do
  name=$(basename "$file" .ron)
  "$zsim" --quiet scene plan "$name" "$work/scenes/$name.svg" >/dev/null
  "$zsim" --quiet scene view "$name" "$work/scenes/$name.html" >/dev/null
done
for name in handheld handheld_2 backpack vehicle_three_springs vehicle_stiff_spring; do
  "$zsim" --quiet spring "$name" --out "$work/scenes/$name" >/dev/null
done
node docs/scenes.mjs "${NODE_MODULES:-target/ci-node/node_modules}" "$work/scenes"

# Each PNG gets a palette of 256 colours and at most 1200 px (octree: median cut loses colours of small areas); the frames of
# the map become an animated WebP.
python3 - "$work" "$pictures" <<'PYTHON'
import sys
from pathlib import Path
from PIL import Image

work, pictures = map(Path, sys.argv[1:])
files = {
    "plan": "plan.png",
    "report": "report.png",
    "spring": "spring.png",
    "trajectory": "office/plots/trajectory.png",
    "errors": "office/plots/errors.png",
    "gains": "gains/plots/gains.png",
    "springs": "springs/pareto.png",
    "coverage": "coverage/coverage.png",
}
for name, file in files.items():
    picture = Image.open(work / file).convert("RGB")
    # The points of a cloud hardly compress.
    side = 1050 if name == "report" else 1200
    picture.thumbnail((side, side), Image.Resampling.LANCZOS)
    picture.quantize(256, method=Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE).save(pictures / f"{name}.png", optimize=True)

(pictures / "scenes").mkdir(exist_ok=True)
for view in sorted((work / "scenes").glob("*-view.png")):
    name = view.name.removesuffix("-view.png")
    for kind in ["view", "plan"]:
        picture = Image.open(work / "scenes" / f"{name}-{kind}.png").convert("RGB")
        picture.thumbnail((700, 900), Image.Resampling.LANCZOS)
        picture.save(pictures / "scenes" / f"{name}-{kind}.webp", quality=55, method=6)

heads = ["handheld", "handheld_2", "backpack", "vehicle_three_springs", "vehicle_stiff_spring"]
sides = [Image.open(work / "scenes" / f"{head}.png").convert("RGB") for head in heads]
for side in sides:
    side.thumbnail((400, 400), Image.Resampling.LANCZOS)
row = Image.new("RGB", (sum(side.width for side in sides), sides[0].height), "white")
left = 0
for side in sides:
    row.paste(side, (left, 0))
    left += side.width
row.save(pictures / "designs.webp", quality=60, method=6)

frames = [Image.open(file).convert("RGB") for file in sorted(work.glob("frame-*.png"))]
height = round(640 * frames[0].height / frames[0].width)
frames = [frame.resize((640, height), Image.Resampling.LANCZOS) for frame in frames]
durations = [120] * (len(frames) - 1) + [3000]
frames[0].save(pictures / "map.webp", save_all=True, append_images=frames[1:], duration=durations, loop=0, quality=40, method=6)
PYTHON
ls -l "$pictures"
