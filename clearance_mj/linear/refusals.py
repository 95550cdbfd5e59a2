"""What analyses refuse until they know every kind of clearance: some take slots along z alone, some one kind."""

from __future__ import annotations

from ..core.errors import ClearanceError
from ..rig import Rig
from ..rig.dimensions import acts_across

__all__ = ["one_kind", "refuse_across"]


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
        moves = "round bushings" if any(b.is_round for b in rig.bushings) else acts_across(rig)[0]
        raise ClearanceError(f"{what} knows planar rigs, and rig {rig.name!r} moves in space: it has {moves}")


def one_kind(rig: Rig, what: str) -> None:
    """Refuse slots that rub or move along y and z, where a calculation knows slots along z or round clearances.

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
    slot = next((i for i, b in enumerate(rig.bushings) if rig.moves_across and not b.is_round), None)
    if slot is not None:
        moves = f"rig {rig.name!r} moves along y and z, and bushings[{slot}] is a {rig.bushings[slot].of_stops}"
        raise ClearanceError(f"{what} takes slots or round clearances, not both yet: {moves}")
    rubbing = next((i for i, b in enumerate(rig.bushings) if b.slides is not None), None)
    if rubbing is not None:
        raise ClearanceError(f"{what} knows no friction of slots yet: rig {rig.name!r}, bushings[{rubbing}].friction")
