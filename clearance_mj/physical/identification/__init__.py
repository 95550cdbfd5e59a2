"""Identification of any MuJoCo model's clearances from records of its joints."""

from .comparison import Prediction
from .fit import ModelFit, fit_model
from .record import ModelRecord

__all__ = ["ModelFit", "ModelRecord", "Prediction", "fit_model"]
