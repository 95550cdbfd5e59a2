"""Refusals of rigs by analyses that know slots along z alone."""

from __future__ import annotations

from ..core.errors import ClearanceError
from ..rig import Rig
from ..rig.dimensions import fields_across

__all__ = ["refuse_across", "refuse_loaded"]


def refuse_across(rig: Rig, what: str) -> None:
    """Refuse a rig that moves along y and z where a calculation knows motion along z alone.

    Parameters
    ----------
    rig : Rig
        The rig.
    what : str
        The calculation, the first words of the message.

    Raises
    ------
    ClearanceError
        If it is such a rig.
    """
    if rig.moves_across:
        moves = "round bushings" if any(b.is_round for b in rig.bushings) else fields_across(rig)[0]
        raise ClearanceError(f"{what} knows planar rigs, and rig {rig.name!r} moves in space: it has {moves}")


def refuse_loaded(rig: Rig, what: str) -> None:
    """Refuse a rig that moves along y and z, is loaded or rubs, where a calculation knows unloaded slots alone.

    Parameters
    ----------
    rig : Rig
        The rig.
    what : str
        The calculation, the first words of the message.

    Raises
    ------
    ClearanceError
        If it is such a rig.
    """
    refuse_across(rig, what)
    if rig.is_loaded:
        raise ClearanceError(
            f"{what} knows no gravity and no loads, and rig {rig.name!r} has them: leave them out, and give the "
            "offsets at which they hold the shaft"
        )
    rubbing = next((i for i, b in enumerate(rig.bushings) if b.sliding_point is not None), None)
    if rubbing is not None:
        raise ClearanceError(f"{what} knows no friction of slots: rig {rig.name!r}, bushings[{rubbing}].friction")
