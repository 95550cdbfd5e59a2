"""A rubber bushing of six axes, and what MuJoCo's weld makes of it: stiffness that it has, and the time of a step.

A body on a bushing is loaded along or about one axis at a time and comes to rest. Beside `add_bushing` stand welds as a
user would write them: with the solref of the stiffness along x and MuJoCo's impedance, and at their best, scaled by the
inverse inertia of the initial pose, with a small impedance and the ``torquescale`` that is right about x. A weld has
one stiffness for all three directions, and one for all rotations.
"""

import contextlib
import time
import warnings

import mujoco
import numpy as np

from clearance_mj import physical
from clearance_mj.physical.softness import solref_solimp

from .case import row

K = np.array([2e5, 5e4, 1e4, 300.0, 80.0, 20.0])  # N/m and N m/rad
C = np.array([200.0, 100.0, 50.0, 2.0, 1.0, 0.5])
MASSES = 0.5, 2.0, 50.0  # kg
STEPS, ROUNDS = 4000, 15
FORMS = {
    "bushing": "add_bushing",
    "scaled": "weld, scaled by the inverse inertia",
    "weld": 'weld, solref="-k -c" of the direction x',
}
SHOWN = {0: "along x", 2: "along z", 3: "about x", 5: "about z"}


def measure():
    """Return rows as of `periodic`."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", physical.ModelWarning)
        return {"rows": _rows(), "skipped": {}}


def _rows():
    rows = []
    for form, name in FORMS.items():
        shares = np.array([_stiffness(form, mass) / K for mass in MASSES])
        for axis, where in SHOWN.items():
            rows.append(row(f"{name}: stiffness {where}", shares[:, axis], "x", "1"))
    bushing, weld, costs = _model("bushing", 2.0), _model("scaled", 2.0), []
    for _ in range(ROUNDS):
        plain = _march(weld)
        with physical.Softener(bushing):
            costs.append(_march(bushing) / plain)
    rows.append(row("add_bushing: time of a step / that with a weld", costs, "x", ""))
    return rows


def _model(form, mass):
    spec = mujoco.MjSpec.from_string(f"""
    <mujoco><option timestep="1e-4" gravity="0 0 0" integrator="implicitfast"/><worldbody><site name="a"/>
      <body name="body"><freejoint/><geom size="0.1" mass="{mass}"/><site name="b"/></body></worldbody></mujoco>""")
    if form == "bushing":
        physical.add_bushing(spec, "a", "b", K, C)
    else:
        weld = spec.add_equality(type=mujoco.mjtEq.mjEQ_WELD, objtype=mujoco.mjtObj.mjOBJ_SITE, name1="a", name2="b")
        weld.solref[:] = -K[0], -C[0]
        if form == "scaled":
            model = spec.compile()
            weld.solref, weld.solimp = solref_solimp(K[0], C[0], model.body_invweight0[1, 0])
            # a row about an axis is the scale times half the angle, and R its own: k = K[0] (scale/2)² R[0]/R[3]
            weld.data[10] = 2 * np.sqrt(K[3] / K[0] * model.body_invweight0[1, 1] / model.body_invweight0[1, 0])
    return physical.compile(spec)


def _stiffness(form, mass):
    """Return the stiffness (6,) that a bushing shows at rest, N/m and N m/rad."""
    model, stiffness = _model(form, mass), np.zeros(6)
    with physical.Softener(model) if form == "bushing" else contextlib.nullcontext():
        for axis, load in enumerate(1e-4 * K):  # 0.1 mm and 0.1 mrad, if the stiffness is right
            data = mujoco.MjData(model)
            for _ in range(1000):
                data.qfrc_applied[axis] = load
                mujoco.mj_step(model, data, 100)
                data.qvel[:] *= 0.5
            turned = np.zeros(3)
            mujoco.mju_quat2Vel(turned, data.qpos[3:7], 1.0)
            stiffness[axis] = load / np.concatenate((data.qpos[:3], turned))[axis]
    return stiffness


def _march(model):
    data = mujoco.MjData(model)
    data.qvel[:] = 1e-2
    begun = time.process_time()
    mujoco.mj_step(model, data, STEPS)
    return time.process_time() - begun
