"""The experiments on motion control: which cases they consist of, and how cases are run.

A case is one drive with everything that defines it. The reported manoeuvres are the double lane changes of
`LENGTH_FACTORS`; controllers are tuned on others (`tune.MANOEUVRES`).
"""

from __future__ import annotations

import dataclasses
import functools
import os
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy.stats
from tqdm import tqdm

from ..errors import ManoeuvreError
from .compensation import BacklashInverse, ClearanceModel, Compensated
from .controller import Controller, Task
from .manoeuvre import Drive, Sensors, drive, nominal_task
from .path import check_feasible, double_lane_change
from .plant import MultiBody, Plant, SingleTrackDrift, Spread
from .steering import Steering
from .tune import stored

__all__ = [
    "CONTROLLERS",
    "GAP",
    "LENGTH_FACTORS",
    "REGIMES",
    "Case",
    "Kind",
    "Median",
    "Outcome",
    "Regime",
    "Told",
    "check",
    "comparison",
    "get_controller",
    "median",
    "run",
    "run_all",
]

GAP = float(np.radians(0.2))
"""Half-gap at the road wheel that is reported on, rad: within good (0.1°) and the legal limit (0.45°)"""
LENGTH_FACTORS = {72.0: 1.75, 120.0: 2.5}
"""Of the reported double lane changes, by speed in km/h: 3.7 and 5.0 m/s² if followed exactly"""
ROAD_MOMENT = 5.0
"""N m RMS on the wheel"""
PLANTS: dict[str, type[Plant]] = {"multi-body": MultiBody, "single-track": SingleTrackDrift}


class Regime(NamedTuple):
    """What decides on which side the clearance lies."""

    friction: float
    """N m, Coulomb friction of the road wheel"""
    trail: float
    """m, of the aligning moment that reaches the shaft"""


REGIMES = {"torque": Regime(0.0, 0.045), "friction": Regime(30.0, 0.005)}
"""The aligning moment decides; or friction does, where a servo at the rack carries most of the moment"""


class Told(NamedTuple):
    """What is told of the clearance to those controllers that take it into account."""

    half_gap: float
    """rad"""
    friction: float
    """N m"""
    compliance: float
    """rad/(N m), beyond that of the nominal vehicle"""


@dataclass(frozen=True)
class Kind:
    """A controller of the experiments."""

    make: Callable[[Task, Told], Controller]
    """makes the controller"""
    label: str
    """name in legends and tables"""
    knows: str
    """of the clearance; all know the nominal vehicle, the servo and the steering's stiffness without clearance"""


def _model(told):
    return ClearanceModel(told.half_gap, told.compliance, told.friction)


def _high_gain(task, told):
    """The switching gain that holds against the whole lost motion, k₂ + b h (Slotine and Li, section 7.1)."""
    law = stored("smc")
    gain = law.start(task).gain
    return dataclasses.replace(law, switching=law.switching + gain * told.half_gap)


CONTROLLERS = {
    "smc": Kind(lambda task, told: stored("smc"), "SMC", "nothing"),
    "smc-cm": Kind(
        lambda task, told: Compensated(stored("smc"), _model(told)), "SMC-CM", "half-gap, stiffness and friction"
    ),
    "mpc": Kind(lambda task, told: stored("mpc"), "MPC", "nothing"),
    "mpc-cm": Kind(
        lambda task, told: Compensated(stored("mpc"), _model(told)), "MPC-CM", "half-gap, stiffness and friction"
    ),
    "smc-inverse": Kind(
        lambda task, told: Compensated(stored("smc"), BacklashInverse(told.half_gap)),
        "SMC, backlash inverse",
        "half-gap",
    ),
    "smc-high-gain": Kind(_high_gain, "SMC, larger gain", "half-gap, as a bound"),
    "super-twisting": Kind(lambda task, told: stored("super-twisting"), "super-twisting", "nothing"),
}
"""By name; those with one law share its tuned settings"""


def get_controller(name: str) -> Kind:
    """Return the controller of a name.

    Parameters
    ----------
    name : str
        Of `CONTROLLERS`.

    Raises
    ------
    ManoeuvreError
        For an unknown name; the message lists the known ones.
    """
    if name not in CONTROLLERS:
        raise ManoeuvreError(f'controller "{name}" is unknown; known: {", ".join(CONTROLLERS)}')
    return CONTROLLERS[name]


@dataclass(frozen=True)
class Case:
    """One drive."""

    controller: str
    """name"""
    speed: float
    """km/h"""
    half_gap: float = GAP
    """rad, the steering's"""
    regime: str = "torque"
    """of the steering: a name of `REGIMES`"""
    told_gap: float | None = None
    """rad, told to the controllers that take it into account; None: the steering's"""
    stiffness: float = 1.0
    """factor on the datasheet's stiffness of the steering's contacts"""
    told_stiffness: float = 1.0
    """the factor that controllers with a clearance model are told"""
    length_factor: float | None = None
    """None: that of `LENGTH_FACTORS`"""
    plant: str = "multi-body"
    """name of the vehicle model"""
    spread: bool = False
    """draw mass, cornering stiffness and friction from the seed"""
    seed: int = 0
    """of the sensors' noise, the road and the spread"""
    preview: float = 0.2
    """s"""

    @property
    def task(self) -> Task:
        """What the controller is told of vehicle and road."""
        length_factor = _length_factor(self.speed) if self.length_factor is None else self.length_factor
        return _task(self.speed, length_factor, _regime(self.regime).trail, self.preview)

    @property
    def steering(self) -> Steering:
        """The steering with its clearance."""
        nominal = Steering().contact_law
        law = dataclasses.replace(nominal, k=nominal.k * self.stiffness) if self.stiffness != 1 else None
        return Steering(self.half_gap, friction=_regime(self.regime).friction, road_moment=ROAD_MOMENT, law=law)

    @property
    def law(self) -> Controller:
        """The controller with its settings and what it is told of the clearance."""
        told_gap = self.half_gap if self.told_gap is None else self.told_gap
        contact = Steering().lost_motion.stiffness
        compliance = (1 / self.told_stiffness - 1) / contact
        told = Told(told_gap, _regime(self.regime).friction, compliance)
        return get_controller(self.controller).make(self.task, told)


@dataclass(frozen=True, eq=False)
class Outcome:
    """A case and its drive."""

    case: Case
    """what was asked"""
    drive: Drive
    """what came out"""

    def row(self) -> dict:
        """Return the case and its metrics as one row of a table."""
        return dataclasses.asdict(self.case) | self.drive.metrics()


@functools.lru_cache(maxsize=16)
def _task(speed, length_factor, trail, preview):
    return nominal_task(double_lane_change(length_factor), speed / 3.6, trail, preview=preview)


def _length_factor(speed) -> float:
    """That of the nearest reported speed."""
    return LENGTH_FACTORS[min(LENGTH_FACTORS, key=lambda known: abs(known - speed))]


def _regime(regime) -> Regime:
    if regime not in REGIMES:
        raise ManoeuvreError(f'regime "{regime}" is unknown; known: {", ".join(REGIMES)}')
    return REGIMES[regime]


def check(case: Case):
    """Refuse a case that cannot be driven.

    Parameters
    ----------
    case : Case
        The case.

    Raises
    ------
    ManoeuvreError
        For a speed out of range, a path that needs more than the road's friction, an unknown controller, regime or
        plant, an impossible gap.
    """
    get_controller(case.controller)
    if case.seed < 0:
        raise ManoeuvreError(f"seed must be >= 0, got {case.seed}")
    if case.plant not in PLANTS:
        raise ManoeuvreError(f'plant "{case.plant}" is unknown; known: {", ".join(PLANTS)}')
    check_feasible(case.task.path, case.task.speed, case.task.vehicle.friction)
    _ = case.steering, case.law  # which refuse impossible values


def run(case: Case) -> Outcome:
    """Drive one case.

    Parameters
    ----------
    case : Case
        The case.

    Raises
    ------
    ManoeuvreError
        For what `check` refuses.
    SimulationError
        If the vehicle leaves the path.
    """
    check(case)
    spread = Spread.random(case.seed) if case.spread else Spread()
    plant = PLANTS[case.plant](spread, _regime(case.regime).trail)
    return Outcome(case, drive(plant, case.steering, case.law, case.task, Sensors.inertial(), case.seed))


def run_all(cases: Iterable[Case], workers: int | None = None, progress: str | None = None) -> list[Outcome]:
    """Drive many cases at once; the results do not depend on the number of processes.

    Parameters
    ----------
    cases : iterable of Case
        The cases.
    workers : int, optional
        Processes; default: one for each processor.
    progress : str, optional
        Show a progress bar with this name.

    Returns
    -------
    list of Outcome
        In the order of the cases.
    """
    cases = list(cases)
    with ProcessPoolExecutor(min(workers or os.cpu_count(), len(cases)) or 1) as pool:
        found = pool.map(run, cases)
        return list(tqdm(found, total=len(cases), desc=progress, unit="drive", disable=progress is None))


def comparison(controllers: Sequence[str] = tuple(CONTROLLERS), speeds=tuple(LENGTH_FACTORS), **settings) -> list[Case]:
    """Cases of every controller at every speed in both regimes.

    Parameters
    ----------
    controllers : sequence of str
        Of `CONTROLLERS`.
    speeds : sequence of float
        km/h.
    **settings
        Other fields of `Case`.
    """
    return [Case(name, speed, regime=r, **settings) for speed in speeds for r in REGIMES for name in controllers]


class Median(NamedTuple):
    """Median over seeds."""

    value: float
    low: float
    """95 % confidence interval, distribution-free"""
    high: float


def median(values) -> Median:
    """Median with its exact 95 % confidence interval from order statistics.

    Parameters
    ----------
    values : array_like
        One of each seed.
    """
    values = np.asarray(values, dtype=float)
    interval = scipy.stats.quantile_test(values, q=np.median(values), p=0.5).confidence_interval(0.95)
    return Median(float(np.median(values)), float(interval.low), float(interval.high))
