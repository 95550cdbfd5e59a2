"""Friction of a transmission: its efficiency in either direction, and the friction at its motor."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any, NamedTuple

from ..core.errors import LawError

__all__ = ["DriveFriction", "Efficiency"]


class Efficiency(NamedTuple):
    """Fraction of the torque that passes, driven and driven back: friction that grows with the torque."""

    forward: float
    """torque out over torque in, without constant friction, of a drive that moves its load"""
    backward: float
    """torque at the motor over the load's, of a load that moves its drive; 0 or less: self-locking"""

    @classmethod
    def capstan(cls, friction: float) -> Efficiency:
        """Return the efficiency of a cable around an angle, with friction μ φ: e^{-μφ} both ways (Euler, 1769).

        Parameters
        ----------
        friction : float
            Coefficient of friction times the angle in rad.
        """
        return cls(math.exp(-friction), math.exp(-friction))

    @classmethod
    def screw(cls, lead: float, friction: float) -> Efficiency:
        """Return the efficiency of a worm or square thread: tan λ / tan(λ + ρ) and tan(λ - ρ) / tan λ, tan ρ = μ.

        Shigley's Mechanical Engineering Design, section 8-2. It is self-locking where μ ≥ tan λ: backward is then
        negative, since the motor must push the load back.

        Parameters
        ----------
        lead : float
            Lead angle λ, rad.
        friction : float
            Coefficient of friction μ.
        """
        rho = math.atan(friction)
        return cls(math.tan(lead) / math.tan(lead + rho), math.tan(lead - rho) / math.tan(lead))


_WITHOUT_LOSS = Efficiency(1.0, 1.0)


@dataclass(frozen=True)
class DriveFriction:
    """Dry friction at a drive's motor, which may grow with the torque that it carries; seen at the load's side.

    It sticks by a spring and damper, and slips at ::

        coulomb + |external τ_e - motor τ_m|
        + exp(-|ω/ω_s|^α) (stribeck + |stribeck_external τ_e - stribeck_motor τ_m| + q)

    τ_m the motor's torque, τ_e that of the load on the drive; where they oppose each other q = motor_square τ_e² if the
    motor's is the larger one, and external_square τ_m² if the load's is: the models M1 to M6 of Duclusaud et al.,
    *Extended Friction Models for the Physics Simulation of Servo Actuators* (arXiv 2410.08650). The losses of the
    efficiency are added: τ (1/forward - 1) of a drive that moves its load, τ (1 - backward) of one that is moved.
    """

    k: float
    """stiffness while it sticks, N m/rad, > 0"""
    c: float = 0.0
    """damping while it sticks, N m s/rad"""
    coulomb: float = 0.0
    """N m, without load"""
    viscous: float = 0.0
    """N m s/rad of the motor's speed, in addition"""
    efficiency: Efficiency = _WITHOUT_LOSS
    """of the transmission"""
    motor: float = 0.0
    """friction per torque of the motor"""
    external: float = 0.0
    """friction per torque of the load"""
    stribeck: float = 0.0
    """N m, additional friction at rest"""
    stribeck_motor: float = 0.0
    """as ``motor``, at rest"""
    stribeck_external: float = 0.0
    """as ``external``, at rest"""
    stribeck_speed: float = 1.0
    """ω_s, rad/s, > 0"""
    stribeck_exponent: float = 2.0
    """α, > 0"""
    motor_square: float = 0.0
    """1/(N m), of the quadratic friction while the motor's torque is the larger one"""
    external_square: float = 0.0
    """1/(N m), while the load's torque is the larger one"""

    def __post_init__(self) -> None:
        """Check the ranges.

        Raises
        ------
        LawError
            For numbers that are not finite or out of range.
        """
        forward, backward = self.efficiency
        for field in fields(self):
            value = getattr(self, field.name)
            positive = field.name in ("k", "stribeck_speed", "stribeck_exponent")
            if field.name != "efficiency" and not (math.isfinite(value) and (value > 0 if positive else value >= 0)):
                raise LawError(
                    f"{field.name} = {value:g} of a drive's friction must be finite and {'>' if positive else '>='} 0"
                )
        if not (0 < forward <= 1 and math.isfinite(backward) and backward <= 1):
            raise LawError(f"efficiency {forward:g}, {backward:g} must be in (0, 1] forward and <= 1 backward")

    @classmethod
    def from_bam(cls, parameters: Mapping[str, object], k: float, c: float = 0.0) -> DriveFriction:
        """Return the friction of a BAM (Better Actuator Models) parameter file, of any model M1 to M6.

        Parameters
        ----------
        parameters : mapping
            As read from its JSON file: "model", "friction_base", "friction_viscous", ...
        k, c : float
            Stiffness, N m/rad, and damping, N m s/rad, while it sticks, which these models do not have.

        Raises
        ------
        LawError
            For an unknown model or a missing number.
        """
        model = str(parameters.get("model"))
        if model not in _BAM:
            raise LawError(f'model "{model}" of a BAM file; known: {", ".join(_BAM)}')
        numbers: dict[str, Any] = {}
        for bam_name in _BAM[model]:
            value = parameters.get(bam_name)
            if not isinstance(value, int | float):
                raise LawError(f'a BAM file of model "{model}" needs a number "{bam_name}", got {value!r}')
            for name in _BAM_NAMES[bam_name]:
                numbers[name] = float(value)
        return replace(cls(k, c), **numbers)


_BAM_NAMES = {
    "friction_base": ("coulomb",),
    "friction_viscous": ("viscous",),
    "friction_stribeck": ("stribeck",),
    "dtheta_stribeck": ("stribeck_speed",),
    "alpha": ("stribeck_exponent",),
    "load_friction_base": ("motor", "external"),
    "load_friction_motor": ("motor",),
    "load_friction_external": ("external",),
    "load_friction_stribeck": ("stribeck_motor", "stribeck_external"),
    "load_friction_motor_stribeck": ("stribeck_motor",),
    "load_friction_external_stribeck": ("stribeck_external",),
    "load_friction_external_quad": ("motor_square",),
    "load_friction_motor_quad": ("external_square",),
}  # Names of a DriveFriction's numbers, by those of BAM's
_M1 = ("friction_base", "friction_viscous")
_M2 = (*_M1, "friction_stribeck", "dtheta_stribeck", "alpha")
_M5 = (
    *_M2, "load_friction_motor", "load_friction_external", "load_friction_motor_stribeck",
    "load_friction_external_stribeck",
)  # fmt: skip
_BAM = {
    "m1": _M1, "m2": _M2, "m3": (*_M1, "load_friction_base"),
    "m4": (*_M2, "load_friction_base", "load_friction_stribeck"),
    "m5": _M5, "m6": (*_M5, "load_friction_motor_quad", "load_friction_external_quad"),
}  # fmt: skip
