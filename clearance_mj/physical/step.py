"""The longest stable step of a model with stiff contacts, limits, springs and servos."""

from __future__ import annotations

from typing import NamedTuple, TypeAlias

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from .drives import drives
from .rows import ContactRow, Pose, poses_of

__all__ = ["Stable", "largest_step", "limiting_element"]

_LONGEST_STEP = 1.0  # s, upper end of the search
_Bits, _Integrator = mujoco.mjtDisableBit, mujoco.mjtIntegrator
_Mask: TypeAlias = dict[str, np.ndarray]


class Stable(NamedTuple):
    """A longest stable step, and the element that limits it."""

    step: float  # s; infinite where nothing is stiff
    element: str
    pose: int  # index of the pose
    k: float = 0.0  # of the element, N/m (N m/rad)
    c: float = 0.0  # N s/m (N m s/rad)

    def hardest_at(self, step: float) -> tuple[float, float]:
        """Return the largest k and c, in the element's proportion, that are stable at a longer step."""
        ratio = self.step / step
        return self.k * ratio**2, self.c * ratio


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
    not touch in the pose, MuJoCo's own friction, muscles, DC motors, activations, delays, flexes, fluids and
    callbacks; of polynomial springs and dampers the linear coefficient counts. Accuracy takes a tenth of this step.

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
    return limiting_element(model, poses).step


def limiting_element(model: mujoco.MjModel, poses: ArrayLike | None = None, contacts: bool = True) -> Stable:
    """Return the longest stable step with the element that limits it; see `largest_step`.

    Without ``contacts`` overlaps of geoms, as in poses that no motion reaches, are ignored; each explicit pair is still
    counted as if it touched.
    """
    limiting = Stable(np.inf, "nothing", 0)
    discrete = model.opt.integrator == getattr(_Integrator, "mjINT_DISCRETE", None)
    implicit, runge_kutta = _implicit_masks(model), model.opt.integrator == _Integrator.mjINT_RK4
    limit = _runge_kutta_limit if runge_kutta else _semi_implicit_limit
    for pose in poses_of(model, poses, contacts):
        if discrete:  # it is implicit in all but the Softener's forces
            pose = pose._replace(together=[row for row in pose.together if row.added], alone=[])
        pose = pose._replace(together=[row for row in pose.together if row.direction.any()])
        parts = _independent_parts(pose)
        of_rows = [int(parts[np.flatnonzero(row.direction)[0]]) for row in pose.together]
        steps = np.full(len(pose.mass), np.inf)  # of the part that each velocity is in
        for part in np.unique(parts):
            rows = [row for row, part_of_row in zip(pose.together, of_rows) if part_of_row == part]
            step = steps[parts == part] = limit(*_restrict(pose, parts == part, rows, implicit)) if rows else np.inf
            rates = {row.element: _inverse_step(row, pose, implicit) for row in rows}
            stiffest = max(rates, key=lambda element: rates[element], default="nothing")
            k, c = next(((row.k, row.c) for row in rows if row.element == stiffest), (0.0, 0.0))
            limiting = min(limiting, Stable(step, stiffest, pose.number, k, c), key=lambda stable: stable.step)
        rates_of = [[_inverse_step(row, pose, implicit) for row in rows] for rows in pose.alone]
        for rates_of_pair, pair in sorted(zip(rates_of, pose.alone), key=lambda item: -sum(item[0])):
            moves = np.any([row.direction != 0 for row in pair], axis=0)
            step_without = steps[moves].min(initial=np.inf)
            if not runge_kutta and 1 / (1 / step_without + sum(rates_of_pair)) > (1 - 1e-9) * limiting.step:
                continue  # springs and dampers need a step that is at worst as short as theirs in a row
            parts_moved = np.unique(parts[moves])
            rows = [other for other, part_of_row in zip(pose.together, of_rows) if part_of_row in parts_moved]
            step_with = limit(*_restrict(pose, np.isin(parts, parts_moved), [*rows, *pair], implicit))
            worst_row = pair[int(np.argmax(rates_of_pair))]
            candidate = Stable(step_with, worst_row.element, pose.number, worst_row.k, worst_row.c)
            limiting = min(limiting, candidate, key=lambda each: each.step)
    return limiting


def _independent_parts(pose: Pose) -> np.ndarray:
    """Return the number (n,) of each velocity's part: parts share neither inertia nor a row that acts at once."""
    linked = (pose.mass != 0) | np.eye(len(pose.mass), dtype=bool)
    for row in pose.together:
        dofs = np.flatnonzero(row.direction)
        linked[np.ix_(dofs, dofs)] = True
    parts, previous = np.arange(len(linked)), np.empty(0, dtype=int)
    while not np.array_equal(parts, previous):
        previous, parts = parts, np.where(linked, parts, len(linked)).min(axis=1, initial=len(linked))
        parts = parts[parts]  # follow links between parts
    return parts


def _restrict(
    pose: Pose, dofs: np.ndarray, rows: list[ContactRow], implicit: _Mask
) -> tuple[Pose, list[ContactRow], _Mask]:
    """Return a pose restricted to some velocities, with rows that move no others."""
    if dofs.all():
        return pose, rows, implicit
    block = np.ix_(dofs, dofs)
    reduced = pose._replace(mass=pose.mass[block], inverse=pose.inverse[block])
    rows = [row._replace(direction=row.direction[dofs]) for row in rows]
    return reduced, rows, {kind: mask[block] for kind, mask in implicit.items()}


def _implicit_masks(model: mujoco.MjModel) -> _Mask:
    """Return masks (n, n) of damping derivatives that the integrator takes implicitly, by kind of damper."""
    size = model.nv + sum(1 for _ in drives(model))
    rotors = {"rotor": np.diag(np.arange(size) >= model.nv).astype(float)} if size > model.nv else {}
    if model.opt.integrator in (_Integrator.mjINT_IMPLICIT, _Integrator.mjINT_IMPLICITFAST):
        mask = np.zeros((size, size))
        for row, first, count in zip(mask, model.D_rowadr, model.D_rownnz):
            row[model.D_colind[first : first + count]] = 1
        return {"joint": mask, "force": mask, **rotors}
    if model.opt.integrator == _Integrator.mjINT_EULER and not model.opt.disableflags & _Bits.mjDSBL_EULERDAMP:
        return {"joint": np.eye(size), **rotors}
    return rotors


def _inverse_step(row: ContactRow, pose: Pose, implicit: _Mask) -> float:
    """Return the inverse of the longest stable step of one row alone, (δ + √(δ² + ω²))/2, 1/s."""
    dofs = np.flatnonzero(row.direction)
    direction = row.direction[dofs]
    inverse = float(direction @ pose.inverse[np.ix_(dofs, dofs)] @ direction)
    inertia = row.mass + 1 / max(inverse, np.finfo(float).tiny)
    decay = (-row.c if row.kind in implicit else row.c) / (2 * inertia)
    return float(decay + np.sqrt(decay**2 + row.k / inertia)) / 2


def _matrices(pose: Pose, rows: list[ContactRow]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the matrices of mass, with the parasitic one, stiffness and damping."""
    direction = np.array([row.direction for row in rows]).reshape(len(rows), len(pose.mass))
    mass, stiffness, damping = (
        (direction.T * [getattr(row, name) for row in rows]) @ direction for name in ("mass", "k", "c")
    )  # fmt: skip
    return pose.mass + mass, stiffness, damping


def _semi_implicit_limit(pose: Pose, rows: list[ContactRow], implicit: _Mask) -> float:
    """Return the longest stable step of v₊ = v + h (M + hD)⁻¹ M a, M' a = -K q - C v, q₊ = q + h v₊.

    M' includes the parasitic mass. An eigenvalue becomes -1 at h = 1/λ, where 4M' λ² + (4M'M⁻¹D - 2C) λ - K is
    singular; before that none leaves the unit circle if all matrices are symmetric: M'M⁻¹D but for rigid constraints.
    """
    mass, stiffness, damping = _matrices(pose, rows)
    size, implicit_damping = len(mass), np.zeros_like(mass)
    for kind, mask in implicit.items():
        implicit_damping += mask * _matrices(pose, [row for row in rows if row.kind == kind])[2]
    springs, dampers = np.linalg.solve(mass, np.stack((stiffness, damping)))
    explicit_rates = dampers / 2 - pose.inverse @ implicit_damping
    rates = np.linalg.eigvals(np.block([[np.zeros((size, size)), np.eye(size)], [springs / 4, explicit_rates]]))
    fastest = max(rates.real[np.abs(rates.imag) <= 1e-6 * np.abs(rates)], default=0.0)
    longest = 1 / fastest if fastest > 0 else np.inf

    def grows(h: float) -> bool:
        factor = np.linalg.inv(pose.mass + h * implicit_damping) @ pose.mass
        k, c = h * factor @ springs, np.eye(size) - h * factor @ dampers
        return bool(np.max(np.abs(np.linalg.eigvals(np.block([[np.eye(size) - h * k, h * c], [-k, c]])))) > 1 + 1e-6)

    stable, unstable = 0.0, min(longest, _LONGEST_STEP)
    if not implicit_damping.any() or not any(row.mass for row in rows) or not grows((1 - 1e-6) * unstable):
        return longest
    while unstable - stable > 1e-6 * unstable:
        middle = (stable + unstable) / 2
        stable, unstable = (stable, middle) if grows(middle) else (middle, unstable)
    return stable


def _runge_kutta_limit(pose: Pose, rows: list[ContactRow], implicit: _Mask) -> float:
    """Return the step at which Σ (hλ)ⁿ/n!, n = 0...4, leaves the unit circle for an eigenvalue λ of the motion."""
    mass, stiffness, damping = _matrices(pose, rows)
    size = len(mass)
    lower = [-np.linalg.solve(mass, stiffness), -np.linalg.solve(mass, damping)]
    rates = np.linalg.eigvals(np.block([[np.zeros((size, size)), np.eye(size)], lower]))
    rates = rates[np.abs(rates) > 0]
    directions = rates / np.abs(rates)
    directions = np.where(directions.real < -1e-9, directions, 1j * directions.imag)  # undamped but for rounding
    stable, unstable = np.zeros(len(rates)), np.full(len(rates), 4.0)
    for _ in range(50):
        middle = (stable + unstable) / 2
        z = middle * directions
        inside = np.abs(1 + z * (1 + z / 2 * (1 + z / 3 * (1 + z / 4)))) <= 1 + 1e-12
        stable, unstable = np.where(inside, middle, stable), np.where(inside, unstable, middle)
    return float(min(stable / np.abs(rates), default=np.inf))
