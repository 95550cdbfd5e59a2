"""Drives with play, elasticity and friction that grows with the torque: found from runs, and followed."""

from .drive import Drive, PreslidingFriction, Strand
from .fit import PARTS, DriveFit, fit_drive
from .friction import Efficiency, carried, entering, presliding
from .record import DriveRecord

__all__ = [
    "PARTS",
    "Drive",
    "DriveFit",
    "DriveRecord",
    "Efficiency",
    "PreslidingFriction",
    "Strand",
    "carried",
    "entering",
    "fit_drive",
    "presliding",
]
