"""Self-energising friction with dead travel, as of a band brake, from records of displacement and force.

A band lies around a drum and is held at both ends. Turning the drum pulls one end taut and slackens the other; on
reversal the taut end unloads, the slack is taken up (the dead travel 2d) and the other end becomes taut. Its deflection
z from the middle of the dead travel follows the displacement less what the band slips on the drum, and its ends are
springs that harden:

    f(z) = k₀ z + F ((|z| - d) / r)^p sign(z),    the second term where |z| > d

The band slips where f reaches its capacity, which sliding itself raises (the friction tightens the band) and sliding
the other way takes back. With the charge s between 0, all slid to push, and 1, all slid to pull,

    capacity = F (σ + (1-σ) c^q),    c = s in pulling, 1-s in pushing;    ds = slip / D

F, r, p, σ and q differ between pulling (f > 0) and pushing. Beside the band act a damper, dry friction and the force
sensor's zero. Loading is therefore softer than unloading, a partly loaded band unloads elastically, and the dead travel
starts anew wherever the band has slipped to.

Parameters are found by output error with a robust loss, since such brakes chatter while they slide.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from clearance_mj.core.errors import RecordError
from clearance_mj.core.jit import jit
from clearance_mj.estimate import Estimates, Parameter, Problem, SoftL1, StoppingCriteria, coloured, one_by_one, solve
from experiments.joints.hysteresis import UNRELATED, checked, checked_records

SIDE = {"slide": "N", "start": "1", "rise": "1", "elastic": "m", "exponent": "1"}
REST = {"gap": "m", "dead_stiffness": "N/m", "damping": "N s/m", "friction": "N", "force_zero": "N",
        "charge_travel": "m", "charge": "1"}  # fmt: skip
NAMES = {f"{name}_{way}": unit for way in ("pull", "push") for name, unit in SIDE.items()} | REST
"""parameters of a fit and their units"""
STARTS = ((0.15, 0.2), (0.15, 0.8), (0.4, 0.2), (0.4, 0.8))
"""elastic, dead and charge travel together, as a share of half the range of the displacement, and charge"""
POLISHED = 2  # starts, the best after a rough solution, that are solved to the end
ROBUST = 0.1  # residual, as a share of the force's RMS, above which it counts by its amount instead of its square
ROUGH_STEPS, MAX_STEPS = 8, 60  # of the search before the best starts are chosen, and after
STICK = 0.1  # travel over which the friction beside the band turns over, as a share of the charge travel
NEWTON = 40  # steps, at most, that the slip between two samples takes
CLOSE = 1e-9  # excess of the spring's force over the capacity, as a share of the slide force, that is taken as none
STEP = 1e-5  # of a logarithm, or of the range between bounds, for differences


@dataclass(frozen=True)
class BrakeSide:
    """One way in which a band brake is loaded."""

    slide: float  #: N, F: what it slides at when charged
    start: float  #: σ, share of it at which an uncharged band begins to slip; 1: it does not charge
    rise: float  #: q, how late the capacity rises over the charge
    elastic: float  #: m, r: deflection beyond the dead travel at which the spring carries F
    exponent: float  #: p, how much it hardens

    @property
    def value(self) -> np.ndarray:
        """(5,) in the order of the fields."""
        return np.array([getattr(self, name) for name in SIDE])


@dataclass(frozen=True, eq=False)
class BandBrakeFit:
    """Band brake fitted to records."""

    pull: BrakeSide  #: where the force is positive
    push: BrakeSide  #: where it is negative
    gap: float  #: m, d: half the dead travel
    dead_stiffness: float  #: N/m, k₀
    damping: float  #: N s/m, beside the band
    friction: float  #: N, dry friction beside the band
    force_zero: float  #: N, of the sensor
    charge_travel: float  #: m, D: slip that charges the band in full
    charge: float  #: at the beginning of each record
    speed_over: float = 0.0  #: s, over which the speed is taken to each side
    estimates: Estimates | None = None
    """of the parameters that were not held, in the order of `NAMES`; None: not fitted"""
    nrmse: float = 0.0  #: RMS of the residual over the RMS of the measured force about its mean, over the samples used

    @classmethod
    def of(cls, value: ArrayLike, speed_over: float = 0.0, **fields: Any) -> BandBrakeFit:
        """Take the parameters (17,) in the order of `NAMES`."""
        pull, push, others = np.split(np.asarray(value, dtype=float), (5, 10))
        rest = dict(zip(REST, others.tolist()))
        return cls(BrakeSide(*pull.tolist()), BrakeSide(*push.tolist()), speed_over=speed_over, **rest, **fields)

    @property
    def value(self) -> np.ndarray:
        """(17,) the parameters in the order of `NAMES`."""
        return np.concatenate((self.pull.value, self.push.value, [getattr(self, name) for name in REST]))

    def force(self, time: ArrayLike, displacement: ArrayLike, first: float = 0.0) -> np.ndarray:
        """Force (n,), N, under a displacement (n,), m, over rising times (n,), s.

        ``first``: N, the force when the record began, which says where the band stood; 0: amid the dead travel.
        """
        t, x, _ = checked(time, displacement, np.zeros(np.shape(time)), "the motion")
        return _force(self.value, x, speed(t, x, self.speed_over), first)


def speed(time: np.ndarray, displacement: np.ndarray, over: float) -> np.ndarray:
    """Return the mean speed (n,), m/s, from ``over`` seconds before to ``over`` after; 0: between samples."""
    if over == 0:
        return np.gradient(displacement, time)
    before, after = np.maximum(time - over, time[0]), np.minimum(time + over, time[-1])
    return (np.interp(after, time, displacement) - np.interp(before, time, displacement)) / (after - before)


def travel_since_reversal(displacement: ArrayLike, least: float) -> np.ndarray:
    """Return how far a displacement has gone from its last reversal, (n,), m.

    Parameters
    ----------
    displacement : array_like, shape (n,)
        m.
    least : float
        m, by which a reversal is left before it counts.
    """
    return reversal_travel(np.asarray(displacement, dtype=float), least)


def _force(value: np.ndarray, x: np.ndarray, v: np.ndarray, first: float) -> np.ndarray:
    return band_brake_force(x, v, first, value[:5], value[5:10], value[10:])


def band_brake(
    time: ArrayLike, displacement: ArrayLike, force: ArrayLike, use: ArrayLike | None = None, speed_over: float = 0.0,
    held: Mapping[str, float] | None = None,
) -> BandBrakeFit:  # fmt: skip
    """Identify a self-energising band brake with dead travel from measured displacement and force.

    Parameters
    ----------
    time, displacement, force : array_like, shape (n,), or sequences of them
        s, m and N. Several records of one brake are given as lists of arrays. The band's deflection when a record
        begins follows from its first force, the charge is common to all.
    use : array_like of bool, shape (n,), or a sequence of them, optional
        Samples that count, such as those as near a reversal as the motion to predict stays (`travel_since_reversal`).
    speed_over : float
        s, over which the speed is taken to each side, so that noise of the displacement is no speed.
    held : mapping, optional
        Parameters of `NAMES` that are not fitted and their values: ``{"damping": 0.0}``.

    Raises
    ------
    RecordError
        If a channel is not finite, constant, clipped or too short, no sample is used, a name in ``held`` is unknown or
        the force does not follow the displacement.

    Notes
    -----
    The band brake as a damper: Downey, Cao, Laflamme, Taylor and Ricles, High capacity variable friction damper based
    on band brake technology, Engineering Structures 113, 2016, 287-298. Hardening of a slider and its return to the
    capacity: Simo and Hughes, Computational Inelasticity, 1998, section 1.4.
    """
    records = checked_records(time, displacement, force)
    if not (np.isfinite(speed_over) and speed_over >= 0):
        raise RecordError(f"speed_over must be >= 0 s, got {speed_over!r}")
    used = _used(use, records)
    held = dict(held or {})
    unknown = [name for name in held if name not in NAMES]
    if unknown:
        raise RecordError(f"{', '.join(unknown)} cannot be held; parameters are {', '.join(NAMES)}")
    motions = [(x, speed(t, x, speed_over), f[0]) for t, x, f in records]
    measured = np.concatenate([f[u] for (_, _, f), u in zip(records, used)])
    scale = float(np.std(measured))
    if scale == 0:
        raise RecordError(f"the force is constant at {measured[0]:.6g} over the samples used")

    def residual(whole: np.ndarray) -> np.ndarray:
        return (np.concatenate([_force(whole, *motion)[u] for motion, u in zip(motions, used)]) - measured) / scale

    free = np.array([name not in held for name in NAMES])
    whole = np.array([held.get(name, 0.0) for name in NAMES])

    def full(value: np.ndarray) -> np.ndarray:
        complete = whole.copy()
        complete[free] = value
        return complete

    every = [_parameters(records, measured, motions, *start) for start in STARTS]
    parameters = [p for p, is_free in zip(every[0], free) if is_free]
    problem = Problem(
        parameters, one_by_one(lambda value: residual(full(value))), loss=SoftL1(ROBUST), step=STEP, lanes=False,
        units=[1.0 if p.transform == "log" else p.high - p.low for p in parameters],
    )  # fmt: skip
    starts = [problem.at([p.start for p, is_free in zip(each, free) if is_free]) for each in every]
    rough = solve(problem, starts, n_best=len(starts), stop=StoppingCriteria(ROUGH_STEPS, decrease=1e-7, move=1e-7))
    best_two = [s.at for s in (rough, *rough.others)[:POLISHED]]
    best = solve(problem, best_two, n_best=POLISHED, stop=StoppingCriteria(MAX_STEPS, decrease=1e-7, move=1e-7))
    nrmse = float(np.sqrt(np.mean(best.residuals**2)))
    if nrmse > UNRELATED:
        raise RecordError(
            f"the force does not follow the displacement ({100 * nrmse:.0f} % of it is left): no band brake"
        )
    estimates = best.estimates(coloured(best.rows, best.residuals))
    return BandBrakeFit.of(full(best.values), speed_over, estimates=estimates, nrmse=nrmse)


def _used(use: Any, records: Sequence[tuple[np.ndarray, ...]]) -> list[np.ndarray]:
    if use is None:
        return [np.ones(t.size, dtype=bool) for t, _, _ in records]
    several = len(use) > 0 and np.ndim(use[0]) == 1
    used = [np.asarray(u, dtype=bool) for u in (use if several else [use])]
    if [u.shape for u in used] != [t.shape for t, _, _ in records]:
        raise RecordError("use must have the shape of the records")
    if not any(u.any() for u in used):
        raise RecordError("no sample is used")
    return used


def _parameters(
    records: Sequence[tuple[np.ndarray, ...]], measured: np.ndarray, motions: Sequence[tuple[Any, ...]], ratio: float,
    charge: float,
) -> tuple[Parameter, ...]:  # fmt: skip
    """Starts and bounds from the ranges of the records; share: travel over half the range of the displacement."""
    x = max(np.ptp(x) for _, x, _ in records) / 2
    f = np.ptp(measured) / 2
    v = max(np.abs(v).max() for _, v, _ in motions)
    shape = {
        "slide": (0.8 * f, 0.1 * f, 5 * f, "log"), "start": (0.3, 0.0, 1.0, "linear"),
        "rise": (1.5, 1.0, 4.0, "linear"), "elastic": (0.5 * ratio * x, 1e-3 * x, 3 * x, "log"),
        "exponent": (1.7, 1.0, 4.0, "linear"),
    }  # fmt: skip
    rest = {
        "gap": (0.25 * ratio * x, 0.0, x, "linear"), "dead_stiffness": (0.1 * f / x, 0.0, 10 * f / x, "linear"),
        "damping": (0.03 * f / v, 0.0, f / v, "linear"), "friction": (0.02 * f, 0.0, 0.5 * f, "linear"),
        "force_zero": (0.0, -0.3 * f, 0.3 * f, "linear"), "charge_travel": (0.25 * ratio * x, 1e-3 * x, x, "log"),
        "charge": (charge, 0.0, 1.0, "linear"),
    }  # fmt: skip
    bounds = [*shape.values(), *shape.values(), *rest.values()]
    return tuple(
        Parameter(name, unit, float(start), float(low), float(high), transform=transform)  # type: ignore[arg-type]
        for (name, unit), (start, low, high, transform) in zip(NAMES.items(), bounds)
    )


@jit
def band_brake_force(
    x: np.ndarray, speed: np.ndarray, first: float, pull: np.ndarray, push: np.ndarray, rest: np.ndarray
) -> np.ndarray:
    """Force (n,), N, along x (n,), m, at its speed (n,), m/s, from the state in which the first force was ``first``.

    pull, push: slide, start, rise, elastic, exponent of `BrakeSide`; rest: gap, dead stiffness, damping, friction,
    force zero, charge travel and charge at the start. Deflection and charge depend on the reversals of x alone, not on
    the samples between them, so that any step is exact.
    """
    gap, soft, damping, friction, zero, travel, charge = rest
    force = np.empty(x.size)
    f = first - zero - damping * speed[0]
    z = _deflection(f, gap, soft, pull) if f >= 0.0 else -_deflection(-f, gap, soft, push)
    bristle, last = 0.0, x[0]
    for i in range(x.size):
        step = x[i] - last
        last = x[i]
        z += step
        if z > 0.0:
            slip = _slip(z, charge, gap, soft, travel, pull)
            z -= slip
            charge = min(charge + slip / travel, 1.0)
        else:
            slip = _slip(-z, 1.0 - charge, gap, soft, travel, push)
            z += slip
            charge = max(charge - slip / travel, 0.0)
        bristle = min(max(bristle + step / (STICK * travel), -1.0), 1.0)
        elastic = _spring(z, gap, soft, pull) if z > 0.0 else -_spring(-z, gap, soft, push)
        force[i] = elastic + damping * speed[i] + friction * bristle + zero
    return force


@jit
def _spring(u: float, gap: float, soft: float, side: np.ndarray) -> float:
    """Force at a deflection u >= 0."""
    return soft * u + (side[0] * ((u - gap) / side[3]) ** side[4] if u > gap else 0.0)


@jit
def _deflection(f: float, gap: float, soft: float, side: np.ndarray) -> float:
    """Deflection >= 0 at a force f >= 0; where there is none the least one."""
    low, high = 0.0, gap + side[3] * (f / side[0]) ** (1.0 / side[4])
    for _ in range(60):
        middle = 0.5 * (low + high)
        if _spring(middle, gap, soft, side) < f:
            low = middle
        else:
            high = middle
    return high if f > 0.0 else 0.0


@jit
def _slip(u: float, charge: float, gap: float, soft: float, travel: float, side: np.ndarray) -> float:
    """Travel that the band slips at a deflection u until the spring carries no more than its capacity."""
    slide, start, rise, elastic, exponent = side
    slip = 0.0
    for i in range(NEWTON):
        v, s = u - slip, min(charge + slip / travel, 1.0)
        excess = _spring(v, gap, soft, side) - slide * (start + (1.0 - start) * s**rise)
        if (excess <= 0.0 and i == 0) or abs(excess) <= CLOSE * slide:
            break
        slope = soft + (slide * exponent / elastic * ((v - gap) / elastic) ** (exponent - 1.0) if v > gap else 0.0)
        if s < 1.0:
            slope += slide * (1.0 - start) * rise * s ** (rise - 1.0) / travel
        slip = min(max(slip + excess / slope, 0.0), u)
    return slip


@jit
def reversal_travel(x: np.ndarray, least: float) -> np.ndarray:
    """Distance (n,) from the last reversal of a motion x (n,); a reversal counts once it is left by ``least``."""
    travel = np.empty(x.size)
    direction, extreme, reversal = 0.0, x[0], x[0]
    for i in range(x.size):
        if direction == 0.0:
            if abs(x[i] - x[0]) > least:
                direction = np.sign(x[i] - x[0])
                extreme = x[i]
        elif direction * (x[i] - extreme) > 0.0:
            extreme = x[i]
        elif direction * (extreme - x[i]) > least:
            direction, reversal, extreme = -direction, extreme, x[i]
        travel[i] = abs(x[i] - reversal)
    return travel
