"""The response of a rig to a periodic excitation over frequency."""

from __future__ import annotations

import numbers
from collections.abc import Sequence

import numpy as np

from ..beam import MOST_MODES
from ..clearance.law import Law
from ..errors import ClearanceError, ExcitationError
from ..rig import Rig
from .branch import Branch, SpecialPoint
from .condensed import Condensed, condensed
from .continuation import NoConvergence, Solver
from .stability import BRANCH_POINT, FOLD, Located, changes, multipliers, with_fold

__all__ = ["response"]

SAMPLES = 12
"""per harmonic: contacts are not smooth"""
SAME_FOLD = 1e-3
"""of the frequency: how far from a fold its multiplier may pass 1"""


def response(
    rig: Rig,
    law: Law,
    level: complex | Sequence[complex],
    frequencies: tuple[float, float],
    harmonics: int = 21,
    samples: int | None = None,
    kind: str | None = None,
    modes: int = 8,
    stability: bool = True,
) -> Branch:
    """Follow the periodic vibration of a rig from one frequency to another, around folds.

    Condensed harmonic balance: unknown are the harmonics of the displacements at the clearances, in which the laws'
    forces are sampled (alternating frequency-time). The branch begins with the vibration that grows out of rest with
    the level, and ends where it leaves the range of frequencies.

    Parameters
    ----------
    rig : Rig
        The rig; a small system of matrices is one with a `structure.Matrices`.
    law : Law
        What acts in its clearances: a `ConstantLaw` or a `ContactLaw`.
    level : complex or sequence of complex
        Amplitude of the excitation, m/s² or N, or those of its harmonics from the first on.
    frequencies : tuple of float
        From and to, Hz; downwards too.
    harmonics : int
        H, of the motion.
    samples : int, optional
        Of a period; None: the power of two from 12 H on. At least 4 H + 1.
    kind : str, optional
        "base" or "force"; None: as the rig's shaker.
    modes : int
        Of the Ritz basis, as in the modal engine.
    stability : bool
        Find Floquet's multipliers of every point, and locate where the stability changes.

    Returns
    -------
    Branch
        If no next point was found, the branch so far: ``ended`` says where and at which level.

    Raises
    ------
    ClearanceError
        For impossible numbers of harmonics, samples or modes, or if not even the first point is found.
    ExcitationError
        For impossible levels or frequencies, or a rig without a position for a force.
    LawError
        For a law over time or amplitude, or one that does not fit the rig.
    RigError
        If the rig has no clearance, or in the gap moves without stiffness.

    Notes
    -----
    M. Krack and J. Gross, Harmonic Balance for Nonlinear Vibration Problems, Springer 2019.
    """
    levels = _levels(level)
    start, stop = _frequencies(frequencies)
    harmonics, samples = _resolution(harmonics, samples, len(levels), modes)
    kind = rig.shaker.kind if kind is None else kind
    if kind not in ("base", "force"):
        raise ExcitationError(f'kind must be "base" or "force", got {kind!r}')
    system = condensed(rig, law, kind, levels, harmonics, modes)
    solver = Solver(system, harmonics, samples)
    points: list[Located] = []
    ended, recent = "", 0
    try:
        for motion in solver.branch(2 * np.pi * start, 2 * np.pi * stop):
            point = Located(motion, multipliers(solver, motion) if stability else None)
            if not points:
                points.append(point)
                continue
            before = points[-1].motion
            points += [*changes(solver, points[-1], point), point]
            points[recent:] = with_fold(solver, points[recent:])
            recent = next(i for i, each in enumerate(points) if each.motion is before)
    except NoConvergence as end:
        unit = "m/s²" if kind == "base" else "N"
        at = f"{end.args[0] / (2 * np.pi):.6g} Hz and level {abs(levels[0]):g} {unit}"
        if not points:
            raise ClearanceError(
                f"rig {rig.name!r}: no periodic vibration was found at {at}; begin at another frequency, or with "
                "more harmonics and samples"
            ) from None
        ended = f"no further periodic vibration was found beyond {at}"
    return _branch(system, levels, points, ended)


def _levels(level: complex | Sequence[complex]) -> list[complex]:
    try:
        levels = [complex(each) for each in np.atleast_1d(np.asarray(level))]
    except (TypeError, ValueError):
        raise ExcitationError(f"level must be one amplitude or those of several harmonics, got {level!r}") from None
    if not levels or not np.isfinite(levels).all() or not any(levels):
        raise ExcitationError(f"level must be finite and not zero, got {level!r}")
    return levels


def _frequencies(frequencies: tuple[float, float]) -> tuple[float, float]:
    try:
        start, stop = map(float, frequencies)
    except (TypeError, ValueError):
        raise ExcitationError(f"frequencies are a pair (from, to) in Hz, got {frequencies!r}") from None
    if not (0 < start < np.inf and 0 < stop < np.inf and start != stop):
        raise ExcitationError(f"frequencies must be two different ones > 0 Hz, got {start:g} and {stop:g}")
    return start, stop


def _resolution(harmonics: int, samples: int | None, excited: int, modes: int) -> tuple[int, int]:
    for name, value in (("harmonics", harmonics), ("samples", samples), ("modes", modes)):
        whole = isinstance(value, numbers.Integral) and not isinstance(value, bool)
        if not (whole or (value is None and name == "samples")):
            raise ClearanceError(f"{name} must be a whole number, got {value!r}")
    if harmonics < max(excited, 1):
        raise ClearanceError(f"harmonics must be {max(excited, 1)} or more, as the excitation's are, got {harmonics}")
    if not 1 <= modes <= MOST_MODES:
        raise ClearanceError(f"modes must be between 1 and {MOST_MODES}, got {modes}")
    if samples is None:
        return int(harmonics), 2 ** int(np.ceil(np.log2(SAMPLES * harmonics)))
    if samples < 4 * harmonics + 1:
        raise ClearanceError(
            f"samples must be {4 * harmonics + 1} or more for {harmonics} harmonics (4 H + 1), got {samples}"
        )
    return int(harmonics), int(samples)


def _branch(system: Condensed, levels: list[complex], points: list[Located], ended: str) -> Branch:
    """Expand motions at the clearances to everything that a branch knows."""
    rig, poles, linear = system.rig, system.poles, system.linear
    model, count, motions = poles.model, len(system.rig.bushings), [point.motion for point in points]
    omega = np.array([motion.omega for motion in motions])
    x = _complex(np.array([linear.basis @ motion.z + motion.y for motion in motions]))
    force = _complex(np.array([motion.force for motion in motions]))
    turning = 1j * np.arange(linear.excitation.size) * omega[:, None]  # (n, H + 1)
    driven = poles.forced @ model.input(system.kind)
    from_points = poles.forced @ model.at_points.T
    of_poles = driven[:, None] * linear.excitation - np.einsum("jp,nph->njh", from_points, force)
    of_poles /= turning[:, None, :] - poles.values[:, None]
    modes = np.einsum("mj,njh->nmh", poles.shapes, of_poles)
    acceleration = np.einsum("sm,nmh->nsh", model.at_sensors, modes) * (turning**2)[:, None, :]
    if system.kind == "base":
        acceleration += model.sensors_on_base[:, None] * linear.excitation
    at = model.shapes([sensor.position for sensor in rig.sensors])
    ends = force[:, count:].reshape(len(omega), count, 2, -1).sum(axis=2)
    own = (system.laws.spring[:, None] + system.laws.damper[:, None] * turning[:, None, :]) * x[:, :count]
    of_folds = _of_folds(omega, [point.kind for point in points])
    special = tuple(
        SpecialPoint(point.kind, float(omega[i] / (2 * np.pi)), i)
        for i, point in enumerate(points)
        if point.kind and i not in of_folds
    )
    known = [point.multipliers for point in points if point.multipliers is not None]
    return Branch(
        omega / (2 * np.pi), np.array(levels), system.kind, acceleration, np.einsum("sm,nmh->nsh", at, modes),
        x[:, :count], ends, force[:, :count] + own, np.array(known) if known else None, special, ended,
        tuple(rig.sensor_labels), tuple(rig.probe_labels),
    )  # fmt: skip


def _of_folds(omega: np.ndarray, kinds: list[str]) -> set[int]:
    """Which changes of stability are those of folds, whose multiplier passes 1 there but for rounding of both."""
    found: set[int] = set()
    for fold in (i for i, kind in enumerate(kinds) if kind == FOLD):
        near = [
            i for i, kind in enumerate(kinds)
            if kind == BRANCH_POINT and i not in found and abs(omega[i] / omega[fold] - 1) < SAME_FOLD
        ]  # fmt: skip
        found.update(sorted(near, key=lambda i: abs(i - fold))[:1])
    return found


def _complex(values: np.ndarray) -> np.ndarray:
    """Complex amplitudes (n, n_points, H + 1) of real harmonics (n, n_points, K)."""
    found = np.empty((*values.shape[:2], values.shape[2] // 2 + 1), dtype=complex)
    found[..., 0] = values[..., 0]
    found[..., 1:] = values[..., 1::2] - 1j * values[..., 2::2]
    return found
