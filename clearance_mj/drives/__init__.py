"""Drives with play, elasticity and friction that grows with the torque: identification and simulation."""

from ..physical.transmission import Efficiency
from .drive import Drive, PreslidingFriction, Strand
from .fit import PARTS, DriveFit, fit_drive
from .friction import carried, entering, presliding
from .held import HeldLostMotion, HeldServo, ServoLog, fit_held
from .motor_side import MotorSideFit, fit_motor_side
from .mujoco_model import add_found_drive
from .record import DriveRecord

__all__ = [
    "PARTS", "Drive", "DriveFit", "DriveRecord", "Efficiency", "HeldLostMotion", "HeldServo", "MotorSideFit",
    "PreslidingFriction", "ServoLog", "Strand", "add_found_drive", "carried", "entering", "fit_drive", "fit_held",
    "fit_motor_side", "presliding",
]  # fmt: skip
