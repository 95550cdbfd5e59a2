"""Method "nominal": the datasheet, before any test."""

from __future__ import annotations

from ...io.dataset import Dataset
from ...model import Model
from ..registry import Identified, register


@register("nominal", "the rig file only: datasheet contact, fresh grease as a linear spring and damper", in_space=True)
def _identify(dataset: Dataset, progress: bool = False) -> Identified:
    return Identified(model=Model(dataset.rig))
