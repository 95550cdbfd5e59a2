"""Identification of any MuJoCo model's clearances from records of its joints."""

from .fit import ModelFit, Prediction, model
from .record import ModelRecord

__all__ = ["ModelFit", "ModelRecord", "Prediction", "model"]
