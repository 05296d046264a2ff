#!/usr/bin/env python3
"""check_las.py FILE.las EXPECTED.txt: compares a LAS cloud, as laspy reads it, with its expected points.

EXPECTED.txt has one point per line: x y z intensity time error. Prints one line, `ok ...`; exits with 1 on a
difference, and with 77 if laspy is not installed.
"""
import sys

try:
    import laspy
    import numpy as np
except ImportError as missing:
    print(missing, file=sys.stderr)
    sys.exit(77)

cloud = laspy.read(sys.argv[1])
expected = np.loadtxt(sys.argv[2], ndmin=2)
columns = np.column_stack([cloud.x, cloud.y, cloud.z, cloud.intensity, cloud.gps_time, cloud["error"]])
assert (cloud.header.version.major, cloud.header.version.minor) == (1, 4), cloud.header.version
assert cloud.header.point_format.id == 6, cloud.header.point_format
assert columns.shape == expected.shape, (columns.shape, expected.shape)
tolerance = [5.1e-5, 5.1e-5, 5.1e-5, 0.5, 1e-9, 1e-6]
worst = np.abs(columns - expected).max(axis=0)
assert (worst <= tolerance).all(), worst
assert np.allclose(cloud.header.maxs, expected[:, :3].max(axis=0), atol=1e-4), cloud.header.maxs
print(f"ok {len(cloud.points)} points")
