"""The linear structure of a rig: modes and static shapes, their values at points, poles and gains at any spin."""

from .making import MAX_MODES, linear_model
from .model import LinearModel
from .poles import Poles
from .rows import PlaneRows, RigRows

__all__ = ["MAX_MODES", "LinearModel", "PlaneRows", "Poles", "RigRows", "linear_model"]
