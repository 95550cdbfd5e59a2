"""Readings of a rig's sensors by the coordinates of any linear model of the rig, and by its base's motion."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple, TypeAlias

import numpy as np

from ..core.checks import naming
from ..core.quantities import QUANTITIES
from ..structure import Support
from ..structure.base import AXES, parse_direction, parse_place
from .dimensions import InSpace
from .instruments import Kinds, Sensor, input_kinds
from .loads import Directed

__all__ = [
    "SensorRows", "acceleration_mask", "base_readings", "check_sensors", "clearance_of", "input_readings",
    "sensing_points", "sensor_points", "sensor_rows",
]  # fmt: skip

NEAR = 1e-9  # of a shaft's length, within which places are one
Vector: TypeAlias = tuple[float, float, float]


class SensorRows(NamedTuple):
    """Readings of sensors by coordinates q: derivative number ``order`` of rows q + rates q̇ + on_base u."""

    rows: np.ndarray  # (n_sensors, n) per coordinate; zeros of a force in a clearance, which is no motion
    rates: np.ndarray  # (n_sensors, n) per velocity: of dampers below force sensors
    order: np.ndarray  # (n_sensors,) whole numbers
    on_base: np.ndarray  # (n_sensors,) of the base's displacement

    @property
    def accelerations(self) -> np.ndarray:
        """(n_sensors, n) rows of accelerometers per acceleration, zeros of others."""
        return np.where(self.order[:, None] == 2, self.rows, 0.0)

    @property
    def readings(self) -> np.ndarray:
        """(n_sensors, 2, n) readings of other sensors per coordinate and per velocity; (0, 2, n) if there are none."""
        order, count = self.order[:, None], len(self.order) * bool((self.order < 2).any())
        velocity_rows = np.where(order == 1, self.rows, self.rates)
        return np.stack((np.where(order == 0, self.rows, 0.0), velocity_rows * (order < 2)), axis=1)[:count]

    def at_rest(self, q: np.ndarray) -> np.ndarray:
        """Return the readings (n_sensors,) of the sensors at rest at coordinates (n,)."""
        return np.where(self.order == 0, self.rows @ q, 0.0)

    def gains(
        self, displacements: Callable[[np.ndarray], np.ndarray], probes: np.ndarray, omega: np.ndarray, shaken: bool
    ) -> np.ndarray:
        """Return the readings (n_f, n_sensors + n_probes, n_inputs) of sensors, then probes, per unit of each input.

        Parameters
        ----------
        displacements : callable
            Returns gains (n_f, n_rows, n_inputs) of displacements with rows (n_rows, n).
        probes : ndarray, shape (n_probes, n)
            Displacements that probes read.
        omega : ndarray, shape (n_f,)
            Angular frequencies, rad/s, real or complex.
        shaken : bool
            True if the last input is the base's acceleration.
        """
        gain, count, orders = displacements(np.vstack((self.rows, probes))), self.order.size, set(self.order.tolist())
        if orders == {2}:
            gain[:, :count] *= -(omega[:, None, None] ** 2)
            gain[:, :count, -1] += self.on_base * float(shaken)
            return gain
        j_omega = 1j * omega[:, None]
        if self.rates.any():
            gain[:, :count] += j_omega[:, :, None] * displacements(self.rates)
        for order in orders:
            rows = np.flatnonzero(self.order == order)
            if order:
                gain[:, rows] *= (j_omega if order == 1 else -(omega[:, None] ** 2))[:, :, None]
            if shaken and order == 2:
                gain[:, rows, -1] += self.on_base[rows]
            elif shaken:
                integral = np.divide(1.0, j_omega, out=np.zeros_like(j_omega), where=j_omega != 0)  # unknown at 0 Hz
                gain[:, rows, -1] += self.on_base[rows] * integral ** (2 - order)
        return gain


def sensor_rows(rig: InSpace, directed: Directed, size: int) -> SensorRows:
    """Return the rows of the sensors of a rig on the coordinates of a model of it.

    Parameters
    ----------
    rig : Rig
        The rig.
    directed : callable
        Returns the motion (n_points, n) of points along directions (n_points, 3) per coordinate; points that name an
        axis, such as "@0.4:RY", along that.
    size : int
        n, number of coordinates.
    """
    taps = [(i, *tap) for i, sensor in enumerate(rig.sensors) for tap in sensing_points(rig, sensor)]
    matrices = np.zeros((2, len(rig.sensors), size))
    if taps:
        sensors, points, along, *factors = zip(*taps)
        motion = directed(points, np.array(along))
        for rows, tap_factors in zip(matrices, factors):
            np.add.at(rows, list(sensors), np.array(tap_factors)[:, None] * motion)
    rows, rates = matrices
    return SensorRows(rows, rates, np.array([s.order for s in rig.sensors]), base_readings(rig))


def base_readings(rig: InSpace, number: int = 0) -> np.ndarray:
    """Return the readings (n_sensors,) of the sensors per displacement of the base along the direction of an input."""
    along = rig.inputs[number].unit_direction
    return np.array([0.0 if s.moves_with_base else s.gain * (s.unit_direction @ along) for s in rig.sensors])


def input_readings(rig: InSpace, kinds: Kinds) -> np.ndarray:
    """Return the readings (n_inputs, n_sensors) of accelerometers per unit of each input itself: of a moving base."""
    of_order = np.array([s.order == 2 for s in rig.sensors])
    return np.array(
        [base_readings(rig, i) * (of_order & (kind == "base")) for i, kind in enumerate(input_kinds(kinds))]
    )


def sensing_points(rig: InSpace, sensor: Sensor) -> Iterator[tuple[float | str, Vector, float, float]]:
    """Yield points, directions, and the factors of motion and velocity there that a reading is the sum of.

    There are none for a force in a clearance. A bending strain is -y'' times the distance of the fibre from the axis
    (Timoshenko and Gere, Mechanics of Materials, 1972, section 5.1).
    """
    position, direction, gain = sensor.position, sensor.unit_direction.tolist(), sensor.gain
    if sensor.quantity == "force":
        if clearance_of(rig, sensor) is None:
            support, (_, y, z) = _support_of(rig, sensor), direction
            for along, part, springs in (((0.0, 1.0, 0.0), y, support.in_other_plane), ((0.0, 0.0, 1.0), z, support)):
                if part:
                    yield position, along, gain * part * springs.translation, gain * part * springs.translation_damping
    elif not (sensor.turns or sensor.quantity == "strain") or parse_direction(position):
        yield position, (direction[0], direction[1], direction[2]), gain, 0.0
    else:
        name, x = parse_place(position) or ("", 0.0)
        is_strain = sensor.quantity == "strain"
        kind, factor = ("K", -gain * (sensor.fibre or _half_depth(rig, sensor))) if is_strain else ("R", gain)
        for axis, part in zip(AXES, direction):
            if part and kind + axis != "KX":
                yield f"{name}@{x!r}:{kind}{axis}", (0.0, 0.0, 0.0), factor * part, 0.0


def _half_depth(rig: InSpace, sensor: Sensor) -> float:
    """Return half the shaft's depth at a gauge, m, the larger one of both planes where it is between them."""
    i, x = rig.linear.place(sensor.position)
    shaft, (_, y, z) = rig.linear.shafts[i], sensor.unit_direction
    return max(shaft.half_depth(x) * bool(z), shaft.in_other_plane.half_depth(x) * bool(y))


def clearance_of(rig: InSpace, sensor: Sensor) -> int | None:
    """Return the number of the clearance whose force a sensor reads; None of a sensor of anything else."""
    clearances = zip(rig.bushings, rig.clearance_labels) if sensor.quantity == "force" else ()
    for j, (bushing, label) in enumerate(clearances):
        if sensor.position in (bushing.position, label, f"bushings[{j}]"):
            return j
    return None


def acceleration_mask(rig: InSpace) -> np.ndarray:
    """Return 1 for each sensor (n_sensors,) of a motion that has an acceleration in m/s², nan for all others."""
    return np.array([1.0 if QUANTITIES[s.quantity].motion == "displacement" else np.nan for s in rig.sensors])


def sensor_points(rig: InSpace) -> list[float | str]:
    """Return the points of the structure at which the sensors are; of a force in a clearance its middle."""
    places = [(s.position, clearance_of(rig, s)) for s in rig.sensors]
    return [position if j is None else rig.bushings[j].position for position, j in places]


def _support_of(rig: InSpace, sensor: Sensor) -> Support:
    """Return the elastic support whose force a sensor reads."""
    i, x = rig.linear.place(sensor.position)
    for support in rig.linear.shafts[i].supports if parse_place(sensor.position) and rig.linear.shafts else ():
        is_near = abs(support.position - x) <= NEAR * rig.linear.shafts[i].length
        if is_near and (support.translation or support.translation_damping):
            return support
    names = ", ".join(f'"{label}"' for label in rig.clearance_labels) or "none"
    raise ValueError(
        f'"{sensor.position}" has neither a clearance nor an elastic support, whose force it could read; give the name '
        f"of a clearance ({names}) or the place of a support that has springs"
    )


def check_sensors(rig: InSpace) -> None:
    """Refuse sensors that cannot read their quantity where they are, and two of one node, axis and quantity."""
    taken: set[tuple[str, str]] = set()
    for i, sensor in enumerate(rig.sensors):
        with naming(f"sensors[{i}].position", ValueError, ValueError, "{} {}"):
            _check_place(rig, sensor)
        key = sensor.label.replace("-", "+"), sensor.quantity
        if key in taken:
            raise ValueError(f"sensors[{i}].node {sensor.node} is used twice; each sensor needs its own node")
        taken.add(key)


def _check_place(rig: InSpace, sensor: Sensor) -> None:
    if sensor.quantity == "force":
        any(sensing_points(rig, sensor))  # refuses what is neither clearance nor support
        return
    if sensor.quantity == "strain":
        if parse_place(sensor.position) is None or parse_direction(sensor.position) or not rig.linear.shafts:
            raise ValueError(f'"{sensor.position}" has no fibres: a strain gauge needs a shaft')
        if sensor.fibre and sensor.fibre > (deepest := _half_depth(rig, sensor)) * (1 + NEAR):
            raise ValueError(f"lies in a shaft of half depth {deepest:g} m; fibre {sensor.fibre:g} m is outside of it")
