#!/usr/bin/env python3
"""check_mujoco.py FOLDER FREQUENCY...: loads the robot model of `zsim spring export` into MuJoCo.

FREQUENCY: natural frequencies that it must have at rest, Hz, lowest first. Prints one line, `ok WORST`, the largest relative
difference; exits with 1 if the head is not in equilibrium or the model cannot be loaded, and with 77 without MuJoCo.
"""
import sys

try:
    import mujoco
    import numpy as np
except ImportError as missing:
    print(missing, file=sys.stderr)
    sys.exit(77)

folder, expected = sys.argv[1], np.array(sys.argv[2:], dtype=float)
model = mujoco.MjModel.from_xml_path(f"{folder}/head.xml")
data = mujoco.MjData(model)
mujoco.mj_forward(model, data)
assert model.nv == 6, model.nv
assert np.abs(data.qacc).max() < 1e-6, data.qacc


def force(q):
    """Generalised force at rest in the coordinates q."""
    data.qpos[:] = q
    data.qvel[:] = 0.0
    mujoco.mj_forward(model, data)
    return data.qfrc_passive - data.qfrc_bias


step = 1e-6
stiffness = np.column_stack([(force(-step * unit) - force(step * unit)) / (2 * step) for unit in np.eye(6)])


def acceleration(applied):
    """Acceleration of the coordinates at rest under a generalised force."""
    data.qfrc_applied[:] = applied
    force(np.zeros(6))
    return data.qacc.copy()


inverse_mass = np.column_stack([acceleration(unit) - acceleration(0 * unit) for unit in np.eye(6)])
squares = np.sort(np.linalg.eigvals(inverse_mass @ stiffness).real)
frequencies = np.sqrt(squares) / (2 * np.pi)
worst = np.abs(frequencies / expected - 1).max()

# URDF has no springs: its masses and joints are compared.
urdf = mujoco.MjModel.from_xml_path(f"{folder}/head.urdf")
assert urdf.nv == 6, urdf.nv
assert abs(urdf.body_mass.sum() / model.body_mass.sum() - 1) < 1e-4, (urdf.body_mass, model.body_mass)
print(f"ok {worst:.5f}")
