"""The steering: a servo, a shaft that runs through two bushings with clearance, and the lever that turns the wheels.

The servo turns the shaft's bushings; what the shaft moves in them, over the lever arm r, is the wheel's error
δ_err = x(l_j)/r at the bushing l_j where the lever's force acts. The shaft is a rig of this project, loaded there by
the aligning moment, the road's and the friction, each over r. It is reduced to one quasi-static degree of freedom
(`lost_motion`) or simulated, step by step beside the vehicle, by one of this project's engines. All angles and moments
are those at the road wheel.
"""

from __future__ import annotations

import functools
import math
import re
from dataclasses import dataclass

import numpy as np

from ..clearance.law import ConstantLaw, Law
from ..clearance.modelled import nominal_law
from ..clearance.record import fillings_of
from ..core.checks import naming
from ..core.errors import ClearanceError, ManoeuvreError
from ..core.units import quantity_of
from ..engines import Engine, get_engine
from ..linear import linear_model
from ..rig import Beam, Bushing, Contact, Grease, PointMass, Rig, Sensor, Shaker
from ..signals.excitation import random
from .lost_motion import LostMotion
from .plant import STEP
from .steering_run import Motor, QuasiStaticShaft, ServoStep, Shaft, SimulatedShaft, SteeringRun

__all__ = ["LEVER_ARM", "STEERING_SHAFT", "Steering", "parse_gap"]

RATIO, PINION_RADIUS = 16.0, 7.1e-3  # hand-wheel angle over road-wheel angle, and m
COLUMN_STIFFNESS = 172.0  # N m/rad, at the pinion
COLUMN_INERTIA = 0.04  # kg m², about the hand wheel's axis
RACK_MASS, RACK_DAMPING = 32.0, 3920.0  # kg and N s/m
LEVER_ARM = RATIO * PINION_RADIUS  # Travel of the rack, m, per radian of the road wheel.
NOISE_PERIOD = 60.0  # s after which the road's noise repeats, without a seam
SMALLEST_GAP = 1e-9  # m, stands for no gap, where a rig needs one


def _steering_shaft() -> Rig:
    """Slender steel shaft clamped at the servo; the rack's mass and damping and the column's stiffness at the lever."""
    lever, contact = 0.475, Contact(COLUMN_STIFFNESS / PINION_RADIUS**2, 200.0)
    return Rig(
        name="steering shaft",
        description="Shaft between steering servo and rack, in two bushings; the lever is at the second",
        beam=Beam(length=0.6, young_modulus=210e9, density=7850.0, diameter=0.010, rayleigh=(0.5, 1e-5)),
        masses=(PointMass(lever, RACK_MASS, "rack"),),
        bushings=(
            Bushing(0.33, 4e-4, 0.012, Grease(0.0, 3.0), contact),
            Bushing(lever, 4e-4, 0.012, Grease(0.0, RACK_DAMPING), contact),
        ),
        sensors=(Sensor(1, lever),),
        shaker=Shaker("force", lever),
    )


STEERING_SHAFT = _steering_shaft()  # The steering's shaft as `Steering` takes it by default.


def parse_gap(text: str, lever_arm: float = LEVER_ARM) -> float:
    """Half-gap at the road wheel, rad, from a number with a unit; the lever arm, m, makes an angle of a length.

    Such as "0.2deg", "3.5mrad" (road-wheel angle) or "0.15mm" (radial clearance of the shaft).
    """
    match = re.fullmatch(r"\s*(\d+\.?\d*(?:e[-+]?\d+)?|\.\d+)\s*(.*?)\s*", text)
    number, unit = match.groups() if match else ("", "")
    if found := quantity_of(unit, ["angle", "displacement"]):
        return float(number) * found[1] / (1.0 if found[0] == "angle" else lever_arm)
    known = "give an angle at the road wheel (0.2deg, 3.5mrad) or a radial clearance of the shaft (0.15mm)"
    raise ManoeuvreError(f'gap "{text}" {"has no unit" if number and not unit else "is not a gap"}; {known}')


@dataclass(frozen=True)
class Steering:
    """Servo, shaft with clearance, and lever."""

    half_gap: float = 0.0  # rad at the road wheel: the bushings' clearance over the lever arm, not the shaft's own
    fidelity: str | Engine = "play"  # quasi-static lost motion; or an engine, such as "modal", that simulates the shaft
    friction: float = 0.0  # N m, Coulomb's, of the road wheel; below the aligning moment the clearance is torque-driven
    road_moment: float = 0.0  # N m RMS, of the road on the wheel
    road_band: tuple[float, float] = (0.5, 30.0)  # Hz, its band
    frequency: float = 6.0  # Hz, natural, of the second-order servo
    damping: float = 0.7  # of the servo, of critical
    rate_limit: float = 0.4  # rad/s at the road wheel, largest speed of the servo; 0.4 is that of commonroad's vehicle
    torque_limit: float = math.inf  # N m at the road wheel, largest of the servo's motor
    lever_arm: float = LEVER_ARM  # r, m
    shaft: Rig = STEERING_SHAFT  # its shaker's position is the lever's, and one of its bushings is there
    wear: float = 0.0  # rad/s, by which the half-gap grows on the way; with the fidelity "play" only
    law: Law | None = None  # of the contact, such as an identified one; None: the shaft's own datasheet values

    def __post_init__(self) -> None:
        self._engine()
        for name, low, high in _RANGES:
            if not low <= getattr(self, name) <= high:
                raise ManoeuvreError(f"steering.{name} must be in {low:g}..{high:g}, got {getattr(self, name):g}")
        if self.wear and self.fidelity != "play":
            raise ManoeuvreError(f'steering.wear needs the fidelity "play", got {self.fidelity!r}')
        if self.shaft.shaker.position not in [b.position for b in self.shaft.bushings]:
            raise ManoeuvreError(f"rig {self.shaft.name!r}: the lever (shaker.position) must be at one of its bushings")

    @property
    def lever(self) -> int:
        """Index of the bushing at the lever."""
        return [b.position == self.shaft.shaker.position for b in self.shaft.bushings].index(True)

    @functools.cached_property
    def rig(self) -> Rig:
        """The shaft with this clearance."""
        return self.shaft.with_gap(max(self.half_gap * self.lever_arm, SMALLEST_GAP))

    @functools.cached_property
    def datasheet_law(self) -> ConstantLaw:
        """Stiffness and damping of the shaft's contacts."""
        return nominal_law(self.shaft)

    @property
    def contact_law(self) -> Law:
        """The law, or the datasheet's."""
        return self.law or self.datasheet_law

    @functools.cached_property
    def lost_motion(self) -> LostMotion:
        """The shaft reduced to its deflection under the lever's force; a Hertz contact at its datasheet's gap."""
        rig, arm2 = self.rig, self.lever_arm**2
        model = linear_model(rig)
        deflection = model.at_bushings / model.omega**2 @ model.input("force")
        share2 = (deflection / deflection[self.lever]) ** 2
        grease_k, grease_c = np.transpose([g.small_motion() for g in fillings_of(self.shaft, self.contact_law)])
        stiffness, damping = 1 / deflection[self.lever] + sum(share2 * grease_k), sum(share2 * grease_c)
        contact = self.contact_law.largest([b.gap for b in self.shaft.bushings])[0][self.lever]
        values = (self.half_gap, contact * arm2, stiffness * arm2, damping * arm2, self.friction)
        return LostMotion(*map(float, values))

    def start(self, seed: int = 0) -> SteeringRun:
        """Begin a run with the wheels straight and the shaft centred; the seed is that of the road's noise."""
        motor = Motor(self.torque_limit, COLUMN_INERTIA * RATIO**2, RACK_DAMPING * self.lever_arm**2, self.friction)
        servo = ServoStep.of(self.frequency, self.damping, self.rate_limit, motor)
        engine, road = self._engine(), np.zeros(1)
        shaft: Shaft = QuasiStaticShaft(self.lost_motion, self.wear)
        if engine:
            shaft = SimulatedShaft(engine, self.rig, self.contact_law, self.shaft, self.lever_arm, self.friction)
        if self.road_moment > 0:
            road = random(NOISE_PERIOD, 1 / STEP, self.road_band, self.road_moment, seed, "force").value
        return SteeringRun(servo, shaft, road)

    def _engine(self) -> Engine | None:
        """The engine that simulates the shaft, if one does."""
        with naming('steering.fidelity is "play" or an engine', ClearanceError, ManoeuvreError):
            return None if self.fidelity == "play" else get_engine(self.fidelity)


_RANGES = (
    ("half_gap", 0.0, math.radians(5)),
    ("friction", 0.0, 1e4),
    ("road_moment", 0.0, 1e3),
    ("frequency", 0.5, 50.0),
    ("damping", 0.1, 2.0),
    ("rate_limit", 0.01, 100.0),
    ("wear", 0.0, 1.0),
    ("torque_limit", 1.0, math.inf),
    ("lever_arm", 0.01, 1.0),
)
