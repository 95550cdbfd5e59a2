"""The links engine: shafts as chains of rigid links in MuJoCo; see `chain`, `links_model` and `links_clearances`."""

from __future__ import annotations

from typing import Annotated, ClassVar

import mujoco
import numpy as np
from pydantic import Field

from ..clearance.law import Law
from ..clearance.record import fillings_of
from ..core.validation import Positive, Whole
from ..linear import linear_model
from ..physical import apply
from ..rig import Rig
from ..rig.instruments import Kinds
from .base import Engine, SimulationRun, register
from .links_clearances import add_clearances
from .links_model import links_spec, round_places
from .links_plant import links_plant
from .links_run import LinksRun
from .modal import stiffest_contacts
from .plant import stable_step_with
from .scheme import driven, slide_rows

__all__ = ["Links", "build_links"]


@register
class Links(Engine):
    """MuJoCo flexible links."""

    name: ClassVar[str] = "links"
    links: Annotated[Whole, Field(ge=3)] = 16
    """number of links of each shaft"""
    safety: Positive = 0.6
    """time step over its stability limit, with contacts at their stiffest"""

    def largest_step(self, rig: Rig, law: Law) -> float:
        """Return ``safety`` times the stability limit with every contact, bristle and film at its stiffest.

        Gyroscopic moments and oil films act at the velocity in the middle of their kick, which limits no step.
        """
        plant, of_row = links_plant(rig, self.links), rig.bushing_of_row
        grease = np.reshape([(0.0, 0.0) if g.is_circulatory else g.largest() for g in fillings_of(rig, law)], (-1, 2))
        contacts = np.transpose((stiffest_contacts(rig, law), law.largest([b.gap for b in rig.bushings])[1]))
        whole, slides = plant.whole, slide_rows(rig)
        bristles = contacts[[*slides]] * [1.0, 0.0]
        rows = np.vstack((whole.at_points, np.repeat(plant.maps.at_rows[3 * rig.n_rows :], 2, axis=0)))
        forces = grease[of_row], np.vstack((contacts[of_row], bristles))
        step = stable_step_with(whole.mass, whole.stiffness, rows, *forces, plant.armature, *whole.other_elements)
        return self.safety * step

    def start(self, rig: Rig, law: Law, kind: Kinds, step: float) -> SimulationRun:
        """Begin a simulation at rest; see `Engine.start`."""
        driven(linear_model(rig), kind)  # refuses what cannot be excited so
        return LinksRun(self, rig, law, kind, step, links_plant(rig, self.links))


def build_links(rig: Rig, links: int = 16) -> mujoco.MjSpec:
    """Describe a rig as a MuJoCo model of rigid links, with the softness of the datasheet.

    It lacks rotation of the shaft and friction, for which MuJoCo has no elements.

    Parameters
    ----------
    rig : Rig
        The rig.
    links : int
        Number of links of each shaft.

    Raises
    ------
    RigError
        If the rig's structure has no shafts, or what links cannot show.
    """
    spec, whole = links_spec(rig, links)
    add_clearances(spec, whole)
    if whole.bends_across:
        round_places(spec)
    apply(spec)
    return spec
