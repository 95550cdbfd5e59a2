"""Engines: MuJoCo flexible links, compiled modes, MuJoCo modes; every file in this folder is imported."""

import importlib
import pkgutil

from ..rig import Rig
from .base import Engine, default_engine, get_engine, register
from .batch import simulate_batch, simulate_each
from .equilibrium import Equilibrium, static_equilibrium
from .links import Links, build_links
from .modal import Modal
from .modal_mj import ModalMujoco, build_modes
from .simulation import simulate, simulate_blocks
from .together import simulate_and_keep, simulate_together

__all__ = [
    "Engine",
    "Equilibrium",
    "Links",
    "Modal",
    "ModalMujoco",
    "default_engine",
    "get_engine",
    "mjcf",
    "register",
    "simulate",
    "simulate_and_keep",
    "simulate_batch",
    "simulate_blocks",
    "simulate_each",
    "simulate_together",
    "static_equilibrium",
]

for _module in pkgutil.iter_modules(__path__):
    if _module.name != "__main__":
        importlib.import_module(f"{__name__}.{_module.name}")


def mjcf(rig: Rig) -> dict[str, str]:
    """MuJoCo models of a rig as MJCF texts, with the datasheet softness, to open in any viewer.

    Parameters
    ----------
    rig : Rig
        The rig.

    Returns
    -------
    dict of str
        "links", where the structure has shafts, and "modes" of a planar rig.

    Raises
    ------
    RigError
        For a spatial rig without shafts, or what links cannot show.
    """
    if rig.moves_across:
        return {"links": build_links(rig).to_xml()}
    links = {"links": build_links(rig).to_xml()} if rig.linear.shafts else {}
    return links | {"modes": build_modes(rig).to_xml()}
