"""Drives for the steering's twin: with wrong starts, with wear, and under controllers that use it."""

import math
import time
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from clearance_mj.vehicle.controllers import ClearancePrior, get_controller
from clearance_mj.vehicle.controllers.base import Controller, ControllerRun, Observation, Task
from clearance_mj.vehicle.experiment import GAP, REGIMES, ROAD_MOMENT
from clearance_mj.vehicle.path import Path as Road
from clearance_mj.vehicle.path import lane_changes
from clearance_mj.vehicle.plant import MultiBody, Spread
from clearance_mj.vehicle.run import Run, follow_path, nominal_task
from clearance_mj.vehicle.sensors import CarSensors
from clearance_mj.vehicle.signals import Signals
from clearance_mj.vehicle.steering import LEVER_ARM, Steering
from clearance_mj.vehicle.twin import SteeringTwin, twin_of

SPEED = 72.0  # km/h
STARTS = (0.5, 1.5)  # half-gap told, over the true one
TOLD_STD = 0.1  # standard deviation of what is told of stiffness and friction, as a share: the twin's priors
WEAR = 1e-6 / LEVER_ARM / 60  # rad/s: 1 µm of the shaft a minute


def road(changes: int, name: str = "lane changes") -> Road:
    """Lane changes of 3.5 m over 50 m to the left and back, 40 m apart: up to 3.2 m/s² at 72 km/h."""
    places = [(40.0 + 90.0 * i, 90.0 + 90.0 * i, 3.5 * (1 - i % 2)) for i in range(changes)]
    return lane_changes(name, places, 0.0, places[-1][1] + 60.0)


@dataclass(frozen=True)
class Recorded(Controller):
    """A controller that keeps the signals it was given."""

    controller: Controller
    signals: list[Signals] = field(default_factory=list)

    def start(self, task: Task) -> ControllerRun:
        """Begin a run."""
        return _RecordedRun(self, task)


class _RecordedRun(ControllerRun):
    def __init__(self, settings: Recorded, task: Task):
        self._inner, self._signals = settings.controller.start(task), settings.signals

    def command(self, seen: Observation) -> float:
        assert seen.signals is not None
        self._signals.append(seen.signals)
        return self._inner.command(seen)


def drive(
    name: str, path: Road, regime: str, seed: int, assumed: float = 1.0, wear: float = 0.0
) -> tuple[Run, list[Signals]]:
    """Drive a vehicle drawn from the seed; a controller that takes the half-gap is told so many times the true one."""
    friction, trail = REGIMES[regime]
    task = nominal_task(path, SPEED / 3.6, trail)
    steering = Steering(GAP, friction=friction, road_moment=ROAD_MOMENT, wear=wear)
    prior = ClearancePrior(assumed * GAP, friction, 0.0, steering.lost_motion.stiffness)
    known = get_controller(name)
    controller = Recorded(known.informed(known.tuned_controller("car"), task, prior))
    run = follow_path(MultiBody(Spread.random(seed), trail), steering, controller, task, CarSensors(), seed)
    return run, controller.signals


def twin(regime: str, seed: int, start: float) -> SteeringTwin:
    """A twin told a wrong half-gap, and stiffness and friction that are wrong by draws from its priors."""
    friction, trail = REGIMES[regime]
    draws = np.random.default_rng([seed, 3]).standard_normal(2)
    true = Steering(start * GAP, friction=friction).lost_motion
    assumed = true._replace(
        stiffness=true.stiffness * math.exp(TOLD_STD * draws[0]), friction=friction * (1 + TOLD_STD * draws[1])
    )
    return twin_of(nominal_task(road(1), SPEED / 3.6, trail).vehicle, assumed, true.stiffness + true.shaft_stiffness)


class History(NamedTuple):
    """Estimates of a twin along a drive."""

    time: np.ndarray  # (n,) s
    value: np.ndarray  # (n, 4) half-gap, stiffness, friction, rate of wear, rad/s
    low: np.ndarray  # (n, 4) of the 95 % interval
    high: np.ndarray  # (n, 4)
    rate: float  # times real time, of the processor's time


def follow(settings: SteeringTwin, signals: Iterable[Signals]) -> History:
    """Run a twin along the signals of a drive."""
    run, rows, last = settings.start(), [], 0.0
    began = time.process_time()
    for seen in signals:
        if run.advance(seen):
            estimates = run.estimates
            values = np.vstack((estimates.value[:3], estimates.interval()[:, :3]))
            rows.append((seen.time, *np.column_stack((values, run.wear))))
            last = seen.time
    rate = last / (time.process_time() - began)
    columns = [np.array(column) for column in zip(*rows)]
    return History(columns[0], columns[1], columns[2], columns[3], rate)


def converge(job: tuple[str, int]) -> list[tuple[str, int, float, History]]:
    """One drive without knowledge of the clearance, and the twins of both wrong starts along it."""
    regime, seed = job
    _, signals = drive("mpc", road(6), regime, seed)
    return [(regime, seed, start, follow(twin(regime, seed, start), signals)) for start in STARTS]


def wear(job: tuple[str, int, float]) -> tuple[str, int, History]:
    """A long drive along which the half-gap grows."""
    regime, seed, minutes = job
    _, signals = drive("smc", road(int(60 * minutes * SPEED / 3.6 / 90)), regime, seed, wear=WEAR)
    return regime, seed, follow(twin(regime, seed, STARTS[0]), signals)


def control(job: tuple[str, str, int, float]) -> dict[str, Any]:
    """Two passes of a double lane change: the peak error of each, mm."""
    name, regime, seed, assumed = job
    run, _ = drive(name, road(4), regime, seed, assumed)
    second = run.s > 205.0  # m: a pass is 180 m long
    peaks = [1e3 * np.abs(run.e_y[part]).max() for part in (~second, second)]
    return {"controller": name, "regime": regime, "seed": seed, "told": assumed, "first": peaks[0], "second": peaks[1]}
