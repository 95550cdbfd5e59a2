"""Softness of foreign MuJoCo models: `python -m experiments.physical.models --out FOLDER`.

Limits, contacts and backlash in the models that come with gymnasium, dm_control and gymnasium-robotics (only the files
are read), each at random poses: the static force against k r, the frequency of ringing against √(k a - (c a/2)²) with
a = J M⁻¹ Jᵀ of the pose, and beside it what MuJoCo makes of its default solref, of solref="-k -c", and of two hinges.
"""

import json
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np

from experiments.script import run
from experiments.tables import markdown_table

from .model_rows import (
    GAP,
    MODELS,
    PROBE,
    Row,
    active,
    alone,
    geared,
    invweight,
    length_of,
    path_of,
    poses,
    softened,
)

DEPTH = {"joint": 1e-4, "tendon": 1e-5, "pair": 1e-6}  # rad or m, of the violation at rest; it rings by a fifth of that
PERIODS, PER_PERIOD = 3, 200


def violate(model: mujoco.MjModel, data: mujoco.MjData, row: Row, depth: float, side: int) -> int | None:
    """Move a pose until a limit or contact is violated by so much; return the solver's row, or None if it cannot be."""
    if row.kind == "pair":
        tries = (_press(model, data, row, depth, n) for n in range(30))
        return next((r for r in tries if r is not None), None)
    for _ in range(30):
        value, along, target = length_of(model, data, row, side)
        wrong = target + side * depth - value
        if along @ along < 1e-12:
            return None
        mujoco.mj_integratePos(model, data.qpos, along * wrong / (along @ along), 1.0)
        if abs(wrong) < 1e-12:
            break
    return _single(model, data, row, depth)


def _single(model: mujoco.MjModel, data: mujoco.MjData, row: Row, depth: float) -> int | None:
    mujoco.mj_forward(model, data)
    rows = active(model, data, row)
    return rows[0] if len(rows) == 1 and data.efc_pos[rows[0]] < -0.5 * depth else None


def _press(model: mujoco.MjModel, data: mujoco.MjData, row: Row, depth: float, n: int) -> int | None:
    """Press the probe so deep on a geom, in a direction of pose and n; None if the geom hardly gives there."""
    mujoco.mj_fwdPosition(model, data)
    geom = model.geom(row.name.removeprefix(f"{PROBE} - ")).id
    probe, centre = model.geom(PROBE).id, data.geom_xpos[geom].copy()
    away = np.sin(1e3 * data.qpos.sum() + n + np.array([0.0, 2.1, 4.3]))
    away /= np.linalg.norm(away)
    place = model.geom_rbound[geom] + model.geom_size[probe, 0]
    for _ in range(40):
        data.mocap_pos[0] = centre + place * away
        mujoco.mj_kinematics(model, data)
        wrong = mujoco.mj_geomDistance(model, data, geom, probe, 10.0, None) + depth
        place -= wrong
        if abs(wrong) < 1e-13:
            break
    r = _single(model, data, row, depth)
    if r is None or inverse_inertia(model, data, jacobian(model, data, r)) < 0.1 * invweight(model, row.name):
        return None
    return r


def static_force(model: mujoco.MjModel, data: mujoco.MjData, row: Row, r: int) -> float:
    """Force of a row while the whole model is held at rest in its pose, by forces that inverse dynamics tells."""
    data.qvel[:], data.qacc[:] = 0, 0
    mujoco.mj_inverse(model, data)
    data.qfrc_applied[:] = data.qfrc_inverse - data.qfrc_actuator
    mujoco.mj_forward(model, data)
    return float(data.efc_force[active(model, data, row)[0]])


def frequency(model: mujoco.MjModel, row: Row, pose: np.ndarray, side: int) -> tuple[float, float] | None:
    """Frequency, Hz, of a limit's or contact's ringing in a pose, alone, and the closed form's."""
    model = alone(model, row)
    data = mujoco.MjData(model)
    data.qpos[:] = pose
    depth = DEPTH[row.kind]
    r = violate(model, data, row, depth, side)
    if r is None:
        return None
    along, mass = jacobian(model, data, r), np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, mass)
    moves = np.linalg.solve(mass, along)
    inverse, preload = along @ moves, row.k * -data.efc_pos[r]
    expected = np.sqrt(row.k * inverse - (row.c * inverse / 2) ** 2) / (2 * np.pi)
    if not np.isfinite(expected):
        return None
    data.qfrc_applied[:] = -preload * along
    data.qvel[:] = 0.2 * depth * 2 * np.pi * expected * moves / inverse
    model.opt.timestep = 1 / (expected * PER_PERIOD)
    start, moved = data.qpos.copy(), np.zeros(model.nv)
    height = np.zeros((PERIODS + 1) * PER_PERIOD)
    for i in range(len(height)):
        mujoco.mj_step(model, data)
        mujoco.mj_differentiatePos(model, moved, 1.0, start, data.qpos)
        height[i] = along @ moved
    up = np.flatnonzero((height[:-1] < 0) & (height[1:] >= 0))
    at = (up + height[up] / (height[up] - height[up + 1])) * model.opt.timestep
    return (len(at) - 1) / (at[-1] - at[0]) if len(at) > 1 else np.nan, expected


def jacobian(model: mujoco.MjModel, data: mujoco.MjData, r: int) -> np.ndarray:
    """(nv,) row of the solver's Jacobian."""
    if not mujoco.mj_isSparse(model):
        return data.efc_J.reshape(-1, model.nv)[r].copy()
    full, first = np.zeros(model.nv), data.efc_J_rowadr[r]
    entries = slice(first, first + data.efc_J_rownnz[r])
    full[data.efc_J_colind[entries]] = data.efc_J[entries]
    return full


def inverse_inertia(model: mujoco.MjModel, data: mujoco.MjData, along: np.ndarray) -> float:
    """J M⁻¹ Jᵀ."""
    mass = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, mass)
    return float(along @ np.linalg.solve(mass, along))


def alone_in_force(model: mujoco.MjModel) -> mujoco.MjModel:
    """The model without contacts, whose hard ones in a random pose would hide what a default limit does."""
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    return model


@dataclass
class Errors:
    """Largest errors of a model's rows, and how many were measured."""

    rows: int = 0
    cases: int = 0
    static: float = 0.0
    ringing: float = 0.0


def measure(model: mujoco.MjModel, rows: list[Row], count: int, ringing: bool = True) -> dict[str, Errors]:
    """Largest relative errors of the static force and of the ringing frequency, by kind of row."""
    errors_by_kind = {kind: Errors() for kind in ("joint", "tendon", "pair")}
    data, places = mujoco.MjData(model), list(poses(model, count))
    for row in rows:
        cases, errors = 0, errors_by_kind[row.kind]
        for n, pose in enumerate(places):
            side = 1 if n % 2 else -1
            mujoco.mj_resetData(model, data)
            data.qpos[:] = pose
            r = violate(model, data, row, DEPTH[row.kind], side)
            if r is None:
                continue
            expected = row.k * -data.efc_pos[r]
            errors.static = max(errors.static, abs(static_force(model, data, row, r) / expected - 1))
            rings = frequency(model, row, pose, side) if ringing else None
            if rings:
                errors.ringing = max(errors.ringing, abs(rings[0] / rings[1] - 1))
            cases += 1
        errors.rows, errors.cases = errors.rows + bool(cases), errors.cases + cases
    return errors_by_kind


def teeth(model: mujoco.MjModel, row: Row, pose: np.ndarray, side: int) -> tuple[float, float]:
    """Stiffness and play to a side, from the static forces at two angles between load and drive."""
    data, forces, angles = mujoco.MjData(model), [], []
    load, _, how = row.name.rpartition(" ")
    for depth in (1e-4, 2e-4):
        mujoco.mj_resetData(model, data)
        data.qpos[:] = pose
        r = violate(model, data, row, depth, side)
        turned = data.joint(row.name).qpos[0] if how == "play" else (
            data.joint(load).qpos[0] - data.joint(f"{load} drive").qpos[0]
        )  # fmt: skip
        angles.append(abs(turned))
        forces.append(static_force(model, data, row, r))
    stiffness = (forces[1] - forces[0]) / (angles[1] - angles[0])
    return stiffness, angles[0] - forces[0] / stiffness


def measure_backlash(name: str, count: int) -> dict[str, float]:
    """Largest errors of stiffness and play over poses and over links ten times as heavy; and what the recipe gives."""
    result = {"joints": 0, "stiffness": 0.0, "play": 0.0, "ringing": 0.0}
    values: dict[str, list[float]] = {}
    for scale in (1.0, 10.0):
        for recipe in (False, True):
            model, rows = geared(name, recipe, scale)
            if recipe:
                model = alone_in_force(model)
            for row in rows:
                for n, pose in enumerate(poses(model, count)):
                    stiffness, play = teeth(model, row, pose, 1 if n % 2 else -1)
                    if recipe:
                        values.setdefault(row.name, []).append(stiffness / row.k)
                        continue
                    result["stiffness"] = max(result["stiffness"], abs(stiffness / row.k - 1))
                    result["play"] = max(result["play"], abs(play / GAP - 1))
            if not recipe and scale == 1:
                result["joints"] = len(rows)
                result["ringing"] = max((e.ringing for e in measure(model, rows, count).values()), default=0.0)
    ratios = [max(v) / min(v) for v in values.values()]
    return result | {"two hinges, stiffest over softest": max(ratios, default=np.nan)}


def defaults(name: str, count: int) -> dict[str, float]:
    """Return the softest and the stiffest limit of a model as it comes, N m/rad."""
    model, rows = softened(name)
    rows = [row for row in rows if row.kind == "joint"]
    model.jnt_solref[:], model.jnt_solimp[:] = (0.02, 1), (0.9, 0.95, 0.001, 0.5, 2)
    model, stiffnesses = alone_in_force(model), []
    data = mujoco.MjData(model)
    for row in rows:
        for pose in poses(model, count):
            mujoco.mj_resetData(model, data)
            data.qpos[:] = pose
            r = violate(model, data, row, 1e-3, 1)
            if r is not None:
                stiffnesses.append(static_force(model, data, row, r) / 1e-3)
    return {"softest": min(stiffnesses, default=np.nan), "stiffest": max(stiffnesses, default=np.nan)}


def table(models: dict[str, dict]) -> str:
    """Return the results in Markdown."""
    lines = [(
        "model", "limits and contacts", "cases", "static error", "ringing error", "default limits, N m/rad",
        "backlash in", "its stiffness", "its play", "its ringing", "two hinges: stiffest/softest",
    )]  # fmt: skip
    for name, row in models.items():
        kinds, gears, default = row["rows"].values(), row["backlash"], row["default"]
        lines.append((
            name, sum(e["rows"] for e in kinds), sum(e["cases"] for e in kinds),
            *(f"{max(e[error] for e in kinds):.1e}" for error in ("static", "ringing")),
            f"{default['softest']:.3g} to {default['stiffest']:.3g}", gears["joints"],
            *(f"{gears[error]:.1e}" for error in ("stiffness", "play", "ringing")),
            f"{gears['two hinges, stiffest over softest']:.3g}",
        ))  # fmt: skip
    return markdown_table(lines)


def main(out: Path = Path("results/physical_models"), poses: int = 20, models: Sequence[str] = tuple(MODELS)) -> None:
    out.mkdir(parents=True, exist_ok=True)
    results: dict[str, dict] = {}
    for name in models:
        if not path_of(name):
            print(f"{name}: its package is not installed")
            continue
        rows = {kind: vars(errors) for kind, errors in measure(*softened(name), poses).items()}
        results[name] = {
            "rows": rows, "backlash": measure_backlash(name, poses), "default": defaults(name, poses)
        }  # fmt: skip
        (out / "physical_models.json").write_text(json.dumps(results, indent=1, default=float))
        (out / "physical_models.md").write_text(table(results))
        print(name, results[name], flush=True)


if __name__ == "__main__":
    sys.exit(run(main, __doc__))
