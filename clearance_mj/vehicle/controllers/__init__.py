"""Steering controllers, one file each; each file registers its controllers, in the order of tables."""

# isort: off
from . import smc, mpc, disturbance_observer, backlash_inverse, mpc_backlash, super_twisting  # noqa: F401
from . import preview_lqr, stanley, twin  # noqa: F401
# isort: on

from .base import Controller, ControllerRun, Observation, Task, limited
from .clearance_model import ClearanceModel, with_clearance_model
from .design import DesignModel, ModelRun, Predictor
from .registry import CONTROLLERS, ClearancePrior, Registration, get_controller, register

__all__ = [
    "CONTROLLERS", "ClearanceModel", "ClearancePrior", "Controller", "ControllerRun", "DesignModel", "ModelRun",
    "Observation", "Predictor", "Registration", "Task", "get_controller", "limited", "register", "with_clearance_model",
]  # fmt: skip
