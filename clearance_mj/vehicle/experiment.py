"""Cases of the experiments on motion control, and their simulation.

A case is one run of a vehicle with everything that defines it. The reported manoeuvres are the double lane changes of
`LENGTH_FACTORS` and `manoeuvres.MANOEUVRES`; controllers are tuned on others (`tune.MANOEUVRES`).
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ..core.errors import ManoeuvreError
from ..core.tasks import run_tasks
from .controllers import CONTROLLERS, ClearancePrior, Controller, Registration, Task, get_controller
from .disturbances import Disturbance
from .manoeuvres import check_feasible, double_lane_change, get_manoeuvre
from .plant import MultiBody, Plant, SingleTrackDrift, Spread
from .run import Run, follow_path, nominal_task
from .sensors import Sensors, get_sensors
from .steering import Steering

__all__ = [
    "CONTROLLERS", "GAP", "LENGTH_FACTORS", "REGIMES", "Case", "Outcome", "Regime", "check", "get_controller",
    "run_all", "run_case",
]  # fmt: skip

GAP = float(np.radians(0.2))
"""Reported half-gap at the road wheel, rad: within good (0.1°) and the legal limit (0.45°)."""
LENGTH_FACTORS = {72.0: 1.75, 120.0: 2.5}
"""Length factors of the reported double lane changes by speed, km/h: they need 3.7 and 5.0 m/s²."""
ROAD_MOMENT = 5.0  # N m RMS, moment of the road's noise on the wheel
PLANTS: dict[str, type[Plant]] = {plant.name: plant for plant in (MultiBody, SingleTrackDrift)}


class Regime(NamedTuple):
    """Friction and trail, which decide on the side of the clearance."""

    friction: float  # N m, Coulomb friction of the road wheel
    trail: float  # m, of the aligning moment that reaches the shaft


REGIMES = {"torque": Regime(0.0, 0.045), "friction": Regime(30.0, 0.005)}
"""The aligning moment decides on the side; or friction, where a servo at the rack carries most of the moment."""


@dataclass(frozen=True)
class Case:
    """One run of a vehicle with everything that defines it."""

    controller: str  # name
    speed: float  # km/h
    half_gap: float = GAP  # rad, the steering's
    regime: str = "torque"  # of the steering: a name of `REGIMES`
    assumed_gap: float | None = None  # rad, prior information of the controllers that take it; None: the steering's
    stiffness: float = 1.0  # factor on the datasheet's stiffness of the steering's contacts
    assumed_stiffness: float = 1.0  # the factor that controllers with a clearance model assume
    length_factor: float | None = None  # None: that of `LENGTH_FACTORS`
    plant: str = "multi-body"  # name of the vehicle model
    spread: bool = False  # draw mass, cornering stiffness and friction from the seed
    seed: int = 0  # of the sensors' noise, the road and the spread
    preview: float = 0.2  # s
    sensors: str | Sensors = "ideal"  # a name of `SENSORS`, or the sensors
    manoeuvre: str | None = None  # a name of `MANOEUVRES`, driven at `speed`; None: the double lane change

    @property
    def task(self) -> Task:
        """The controller's knowledge of vehicle and road."""
        return _task(self.manoeuvre, self.length_factor, self.speed, _regime(self.regime).trail, self.preview)

    @property
    def disturbance(self) -> Disturbance | None:
        """Lateral disturbance of the vehicle, in addition to the road's moment on its wheels."""
        return None if self.manoeuvre is None else get_manoeuvre(self.manoeuvre).disturbance

    @property
    def steering(self) -> Steering:
        """The steering with its clearance."""
        nominal = Steering().datasheet_law
        law = dataclasses.replace(nominal, k=nominal.k * self.stiffness) if self.stiffness != 1 else None
        limit = get_sensors(self.sensors).servo_torque
        friction = _regime(self.regime).friction
        return Steering(self.half_gap, friction=friction, road_moment=ROAD_MOMENT, torque_limit=limit, law=law)

    @property
    def prior(self) -> ClearancePrior:
        """Prior information of controllers that take the clearance into account."""
        gap = self.half_gap if self.assumed_gap is None else self.assumed_gap
        datasheet = Steering().lost_motion.stiffness
        compliance = (1 / self.assumed_stiffness - 1) / datasheet
        return ClearancePrior(gap, _regime(self.regime).friction, compliance, self.assumed_stiffness * datasheet)

    @property
    def tuned_controller(self) -> Controller:
        """The controller with its settings and its prior information on the clearance."""
        known = get_controller(self.controller)
        return known.informed(known.tuned_controller(get_sensors(self.sensors).tuned), self.task, self.prior)


@dataclass(frozen=True, eq=False)
class Outcome:
    """A case and its run."""

    case: Case
    run: Run

    def row(self) -> dict[str, Any]:
        """Return the case and its metrics as one row of a table."""
        return dataclasses.asdict(self.case) | self.run.metrics()


@functools.lru_cache(maxsize=32)
def _task(manoeuvre: str | None, length_factor: float | None, speed: float, trail: float, preview: float) -> Task:
    if manoeuvre is None:
        nearest_speed = min(LENGTH_FACTORS, key=lambda known: abs(known - speed))
        path = double_lane_change(LENGTH_FACTORS[nearest_speed] if length_factor is None else length_factor)
    elif length_factor is None:
        path = get_manoeuvre(manoeuvre).path()
    else:
        raise ManoeuvreError(f'length_factor is that of the double lane change; manoeuvre "{manoeuvre}" has none')
    return nominal_task(path, speed / 3.6, trail, preview=preview)


def _regime(regime: str) -> Regime:
    ManoeuvreError.require_known("regime", regime, REGIMES)
    return REGIMES[regime]


def check(case: Case) -> None:
    """Raise `ManoeuvreError` for a case that cannot be run."""
    get_controller(case.controller)
    if case.seed < 0:
        raise ManoeuvreError(f"seed must be >= 0, got {case.seed}")
    ManoeuvreError.require_known("plant", case.plant, PLANTS)
    check_feasible(case.task.path, case.task.speed, case.task.vehicle.tyre.friction)
    _ = case.steering, case.tuned_controller  # these check their values


def drive(case: Case, controller: Controller, disturbance: Disturbance | None = None) -> Run:
    """Run a case with a controller of any settings, and a disturbance, if given, instead of the case's."""
    plant = PLANTS[case.plant](Spread.random(case.seed) if case.spread else Spread(), _regime(case.regime).trail)
    sensors = get_sensors(case.sensors)
    return follow_path(plant, case.steering, controller, case.task, sensors, case.seed, disturbance or case.disturbance)


def run_case(case: Case) -> Outcome:
    """Run one case; `ManoeuvreError` for what `check` refuses, `SimulationError` if the vehicle leaves the path."""
    check(case)
    return Outcome(case, drive(case, case.tuned_controller))


def _run_registered(registrations: Sequence[Registration], numbered: tuple[int, Case]) -> Outcome:
    """Run a case in a process that may not have imported the files that registered its controllers."""
    for registration in registrations:
        CONTROLLERS.setdefault(registration.name, registration)
    return run_case(numbered[1])


def run_all(cases: Iterable[Case], workers: int | None = None, progress: bool = False) -> list[Outcome]:
    """Run many cases at once, in their order; the results do not depend on the number of processes."""
    numbered = list(enumerate(cases))
    names = dict.fromkeys(case.controller for _, case in numbered)
    run = functools.partial(_run_registered, [get_controller(name) for name in names])
    outcomes = run_tasks(run, numbered, workers, processes=len(numbered) > 1, progress="runs" if progress else "")
    return [outcome for _, outcome in sorted(outcomes, key=lambda pair: pair[0][0])]
