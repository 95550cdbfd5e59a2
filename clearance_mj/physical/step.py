"""The longest stable step of a model with stiff contacts, limits, springs and servos."""

from __future__ import annotations

from typing import NamedTuple, TypeAlias

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from .drives import drives
from .rows import Pose, Row, poses_of

__all__ = ["Stable", "hardest", "largest_step"]

_LONGEST_STEP = 1.0  # s, that is looked at
_Bits, _Integrator = mujoco.mjtDisableBit, mujoco.mjtIntegrator
_Mask: TypeAlias = dict[str, np.ndarray]


class Stable(NamedTuple):
    """A longest stable step, and what makes it so short."""

    step: float  # s; infinite where nothing is stiff
    element: str
    pose: int  # index of the pose
    k: float = 0.0  # of the element, N/m (N m/rad)
    c: float = 0.0  # N s/m (N m s/rad)

    def hardest_at(self, step: float) -> tuple[float, float]:
        """Return the largest k and c, in the element's own proportion, that are stable at a longer step."""
        share = self.step / step
        return self.k * share**2, self.c * share


def largest_step(model: mujoco.MjModel, poses: ArrayLike | None = None) -> float:
    """Return the longest step, s, at which a model's contacts, limits, springs and servos are stable.

    The semi-implicit step of a spring and damper is stable below h = 2/(δ + √(δ² + ω²)); for all together, with an
    implicit damping D and an explicit C, below the h at which 4M + h (2D - 2C) - h² K is singular, M the mass matrix of
    a pose. Joint dampers are implicit in Euler; those of tendons and servos too in implicit and implicitfast, where
    they fit into the pattern of M; constraints in none. RK4 has its own limit; in discrete only bristles and drives
    have one.

    Counted at once are all limits, springs, dampers, bristles, drives inside actuators and servos (actuators with an
    affine bias, the gains of others at the end of their ctrlrange) and all contacts that touch; each other pair of
    geoms as if it touched too, where it is nearest. Not counted are constraints whose solref is a time constant, since
    MuJoCo keeps those stable itself (unless flag refsafe is disabled: then they count), geoms without a pair that do
    not touch in the pose, MuJoCo's own friction, muscles, DC motors, activations, delays, flexes, fluids and what
    callbacks do; of polynomial springs and dampers the linear coefficient counts. Accuracy takes a tenth of this step.

    Parameters
    ----------
    model : mujoco.MjModel
        The model, which is not changed.
    poses : array_like, shape (n, nq) or (nq,), optional
        Without them the model's initial pose and its keyframes. At other poses the limit may be lower.

    Returns
    -------
    float
        Infinite for a model in which nothing is stiff.

    Raises
    ------
    ModelError
        For poses of another size than the model's.
    """
    return hardest(model, poses).step


def hardest(model: mujoco.MjModel, poses: ArrayLike | None = None, contacts: bool = True) -> Stable:
    """Return the longest stable step with what makes it so short; see `largest_step`.

    Without ``contacts`` no geoms touch in the poses, as they would in poses that no motion reaches; each explicit pair
    is counted as if it did all the same.
    """
    found = Stable(np.inf, "nothing", 0)
    discrete = model.opt.integrator == getattr(_Integrator, "mjINT_DISCRETE", None)
    implicit, runge_kutta = _implicit(model), model.opt.integrator == _Integrator.mjINT_RK4
    limit = _runge_kutta if runge_kutta else _semi_implicit
    for pose in poses_of(model, poses, contacts):
        if discrete:  # it takes all but what the Softener adds implicitly
            pose = pose._replace(together=[row for row in pose.together if row.added], alone=[])
        pose = pose._replace(together=[row for row in pose.together if row.direction.any()])
        parts = _parts_of(pose)
        of_rows = [int(parts[np.flatnonzero(row.direction)[0]]) for row in pose.together]
        steps = np.full(len(pose.mass), np.inf)  # of the part that each velocity is in
        for part in np.unique(parts):
            rows = [row for row, of in zip(pose.together, of_rows) if of == part]
            step = steps[parts == part] = limit(*_cut(pose, parts == part, rows, implicit)) if rows else np.inf
            rates = {row.element: _rate(row, pose, implicit) for row in rows}
            worst = max(rates, key=lambda element: rates[element], default="nothing")
            k, c = next(((row.k, row.c) for row in rows if row.element == worst), (0.0, 0.0))
            found = min(found, Stable(step, worst, pose.number, k, c), key=lambda stable: stable.step)
        rates_of = [[_rate(row, pose, implicit) for row in rows] for rows in pose.alone]
        for rates_of_pair, pair in sorted(zip(rates_of, pose.alone), key=lambda both: -sum(both[0])):
            moves = np.any([row.direction != 0 for row in pair], axis=0)
            others = steps[moves].min(initial=np.inf)
            if not runge_kutta and 1 / (1 / others + sum(rates_of_pair)) > (1 - 1e-9) * found.step:
                continue  # springs and dampers need a step that is at worst as short as theirs in a row
            moved = np.unique(parts[moves])
            rows = [other for other, of in zip(pose.together, of_rows) if of in moved]
            beside = limit(*_cut(pose, np.isin(parts, moved), [*rows, *pair], implicit))
            worst_row = pair[int(np.argmax(rates_of_pair))]
            stable = Stable(beside, worst_row.element, pose.number, worst_row.k, worst_row.c)
            found = min(found, stable, key=lambda each: each.step)
    return found


def _parts_of(pose: Pose) -> np.ndarray:
    """(n,) number of the part that each velocity is in: parts share neither inertia nor a row of what acts at once."""
    linked = (pose.mass != 0) | np.eye(len(pose.mass), dtype=bool)
    for row in pose.together:
        moved = np.flatnonzero(row.direction)
        linked[np.ix_(moved, moved)] = True
    parts, before = np.arange(len(linked)), np.empty(0, dtype=int)
    while not np.array_equal(parts, before):
        before, parts = parts, np.where(linked, parts, len(linked)).min(axis=1, initial=len(linked))
        parts = parts[parts]  # what a part is in already
    return parts


def _cut(pose: Pose, kept: np.ndarray, rows: list[Row], implicit: _Mask) -> tuple[Pose, list[Row], _Mask]:
    """Return some of the velocities of a pose, with rows that move no others."""
    if kept.all():
        return pose, rows, implicit
    both = np.ix_(kept, kept)
    less = pose._replace(mass=pose.mass[both], inverse=pose.inverse[both])
    rows = [row._replace(direction=row.direction[kept]) for row in rows]
    return less, rows, {kind: fits[both] for kind, fits in implicit.items()}


def _implicit(model: mujoco.MjModel) -> _Mask:
    """(n, n) which derivatives of dampers an integrator takes implicitly, by the kind of damper."""
    size = model.nv + sum(1 for _ in drives(model))
    rotors = {"rotor": np.diag(np.arange(size) >= model.nv).astype(float)} if size > model.nv else {}
    if model.opt.integrator in (_Integrator.mjINT_IMPLICIT, _Integrator.mjINT_IMPLICITFAST):
        fits = np.zeros((size, size))
        for row, first, count in zip(fits, model.D_rowadr, model.D_rownnz):
            row[model.D_colind[first : first + count]] = 1
        return {"joint": fits, "force": fits, **rotors}
    if model.opt.integrator == _Integrator.mjINT_EULER and not model.opt.disableflags & _Bits.mjDSBL_EULERDAMP:
        return {"joint": np.eye(size), **rotors}
    return rotors


def _rate(row: Row, pose: Pose, implicit: _Mask) -> float:
    """1/s, the inverse of the longest stable step of one row alone, (δ + √(δ² + ω²))/2."""
    moved = np.flatnonzero(row.direction)
    direction = row.direction[moved]
    inverse = float(direction @ pose.inverse[np.ix_(moved, moved)] @ direction)
    inertia = row.mass + 1 / max(inverse, np.finfo(float).tiny)
    decay = (-row.c if row.kind in implicit else row.c) / (2 * inertia)
    return float(decay + np.sqrt(decay**2 + row.k / inertia)) / 2


def _matrices(pose: Pose, rows: list[Row]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mass, with the parasitic one, stiffness and damping."""
    direction = np.array([row.direction for row in rows]).reshape(len(rows), len(pose.mass))
    mass, stiffness, damping = (
        (direction.T * [getattr(row, name) for row in rows]) @ direction for name in ("mass", "k", "c")
    )  # fmt: skip
    return pose.mass + mass, stiffness, damping


def _semi_implicit(pose: Pose, rows: list[Row], implicit: _Mask) -> float:
    """Longest step of v₊ = v + h (M + hD)⁻¹ M a, M' a = -K q - C v, q₊ = q + h v₊, M' with the parasitic mass.

    An eigenvalue becomes -1 at h = 1/λ, where 4M' λ² + (4M'M⁻¹D - 2C) λ - K is singular; before that none leaves the
    unit circle as long as all matrices are symmetric, which M'M⁻¹D is but for constraints that are next to rigid.
    """
    mass, stiffness, damping = _matrices(pose, rows)
    size, implied = len(mass), np.zeros_like(mass)
    for kind, fits in implicit.items():
        implied += fits * _matrices(pose, [row for row in rows if row.kind == kind])[2]
    springs, dampers = np.linalg.solve(mass, np.stack((stiffness, damping)))
    late = dampers / 2 - pose.inverse @ implied
    rates = np.linalg.eigvals(np.block([[np.zeros((size, size)), np.eye(size)], [springs / 4, late]]))
    fastest = max(rates.real[np.abs(rates.imag) <= 1e-6 * np.abs(rates)], default=0.0)
    longest = 1 / fastest if fastest > 0 else np.inf

    def grows(h: float) -> bool:
        share = np.linalg.inv(pose.mass + h * implied) @ pose.mass
        k, c = h * share @ springs, np.eye(size) - h * share @ dampers
        return bool(np.max(np.abs(np.linalg.eigvals(np.block([[np.eye(size) - h * k, h * c], [-k, c]])))) > 1 + 1e-6)

    stable, unstable = 0.0, min(longest, _LONGEST_STEP)
    if not implied.any() or not any(row.mass for row in rows) or not grows((1 - 1e-6) * unstable):
        return longest
    while unstable - stable > 1e-6 * unstable:
        middle = (stable + unstable) / 2
        stable, unstable = (stable, middle) if grows(middle) else (middle, unstable)
    return stable


def _runge_kutta(pose: Pose, rows: list[Row], implicit: _Mask) -> float:
    """Longest step: that at which Σ (hλ)ⁿ/n!, n = 0...4, leaves the unit circle for an eigenvalue λ of the motion."""
    mass, stiffness, damping = _matrices(pose, rows)
    size = len(mass)
    lower = [-np.linalg.solve(mass, stiffness), -np.linalg.solve(mass, damping)]
    rates = np.linalg.eigvals(np.block([[np.zeros((size, size)), np.eye(size)], lower]))
    rates = rates[np.abs(rates) > 0]
    turned = rates / np.abs(rates)
    turned = np.where(turned.real < -1e-9, turned, 1j * turned.imag)  # undamped but for rounding
    stable, unstable = np.zeros(len(rates)), np.full(len(rates), 4.0)
    for _ in range(50):
        middle = (stable + unstable) / 2
        z = middle * turned
        inside = np.abs(1 + z * (1 + z / 2 * (1 + z / 3 * (1 + z / 4)))) <= 1 + 1e-12
        stable, unstable = np.where(inside, middle, stable), np.where(inside, unstable, middle)
    return float(min(stable / np.abs(rates), default=np.inf))
