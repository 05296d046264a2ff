#!/usr/bin/env python3
"""build-times.py TIMINGS.html PICTURE.svg: draws what a build compiled, from the report of `cargo build --timings`.

One bar for each crate that took 2 s or more, in the order of their starts; time goes to the right.
"""
import json
import re
import sys

html = open(sys.argv[1]).read()
units = json.loads(re.search(r"UNIT_DATA = (\[.*?\]);\n", html, re.S).group(1))
end = max(unit["start"] + unit["duration"] for unit in units)
shown = sorted((unit for unit in units if unit["duration"] >= 2.0), key=lambda unit: unit["start"])

WIDTH, ROW, TOP = 720, 13, 22
height = TOP + ROW * len(shown) + 6
scale = (WIDTH - 180) / end
lines = [
    f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" width="{WIDTH}" font-family="sans-serif" '
    f'font-size="10"><rect width="{WIDTH}" height="{height}" fill="#fff"/>'
]
step = next(step for step in (10, 20, 30, 60, 120, 300) if end / step <= 10)
for tick in range(0, int(end) + 1, step):
    x = 8 + tick * scale
    lines.append(f'<path d="M{x:.1f} 16V{height - 4}" stroke="#ddd"/><text x="{x:.1f}" y="12" fill="#555">{tick} s</text>')
for row, unit in enumerate(shown):
    x, y, width = 8 + unit["start"] * scale, TOP + row * ROW, unit["duration"] * scale
    color = "#4477aa" if unit["name"].startswith("zsim") or "zsim" in unit["target"] else "#bbccdd"
    name = unit["name"] + (unit["target"] if "build-script" not in unit["target"] else " (C)")
    lines.append(f'<rect x="{x:.1f}" y="{y}" width="{max(width, 1):.1f}" height="{ROW - 2}" fill="{color}"/>')
    lines.append(f'<text x="{x + width + 4:.1f}" y="{y + 9}" fill="#222">{name.strip()} {unit["duration"]:.0f} s</text>')
open(sys.argv[2], "w").write("\n".join(lines) + "\n</svg>\n")
