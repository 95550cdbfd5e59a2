"""The excitation of periodic vibrations: base, force, or rotating parts."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..clearance.law import TimeLaw
from ..core.errors import ExcitationError, RigError
from ..model import Model
from ..rig import Rig
from .condensed import UNBALANCE

__all__ = ["excitation_kind", "excited_by", "levels_of", "steady_spin"]


def excitation_kind(rig: Rig, kind: str | None) -> str:
    """Return the requested kind of excitation, or the shaker's."""
    kind = rig.shaker.kind if kind is None else kind
    if kind not in ("base", "force"):
        raise ExcitationError(f'kind must be "base" or "force", got {kind!r}')
    return kind


def excited_by(model: Model, kind: str | None) -> str:
    """Return the kind of a rig's excitation: the requested one, else that of rotating parts, else that of its shaker.

    Raises
    ------
    ExcitationError
        For another kind.
    RigError
        If unbalance is asked for of a rig that does not turn, or has none.
    """
    rig = model.rig
    turning = rig.unbalances or rig.orders or isinstance(model.law, TimeLaw)
    if kind is None:
        return UNBALANCE if turning else rig.shaker.kind
    if kind not in ("base", "force", UNBALANCE):
        raise ExcitationError(
            f'kind must be "base" or "force", or "unbalance" of what turns with the shaft, got {kind!r}'
        )
    if kind == UNBALANCE and not (rig.moves_across or rig.linear.is_torsional or turning):
        raise RigError(f"rig {rig.name!r} does not turn; give [spin] and [[unbalances]] or [[orders]]")
    if kind == UNBALANCE and not turning:
        raise RigError(
            f"rig {rig.name!r} has no unbalances; give [[unbalances]] with a position and a moment, or [[orders]]"
        )
    return kind


def levels_of(amplitude: complex | Sequence[complex]) -> list[complex]:
    """Return the amplitudes of an excitation's harmonics; ExcitationError if they are impossible."""
    try:
        levels = [complex(level) for level in np.atleast_1d(np.asarray(amplitude))]
    except (TypeError, ValueError):
        raise ExcitationError(f"amplitude must be a number or those of several harmonics, got {amplitude!r}") from None
    if not levels or not np.isfinite(levels).all() or not any(levels):
        raise ExcitationError(f"amplitude must be finite and not zero, got {amplitude!r}")
    return levels


def steady_spin(rig: Rig, kind: str) -> float:
    """Return the spin at which a rig is excited, rad/s; 0 under unbalance, whose speed is not the rig's.

    Raises
    ------
    RigError
        If the spin is not steady.
    ExcitationError
        If unbalances or orders would act in addition to an excitation.
    """
    if kind == UNBALANCE:
        return 0.0
    if rig.spin and (rig.spin.rate or rig.spin.inertia):
        raise RigError(
            f"rig {rig.name!r}: a periodic vibration needs a steady speed; leave out spin.rate, spin.until and "
            "spin.inertia"
        )
    if rig.unbalances or rig.orders:
        raise ExcitationError(
            f"rig {rig.name!r}: unbalances and orders at their own speed beside an excitation give no periodic "
            "vibration; leave out [[unbalances]] and [[orders]], or use follow_unbalance or, of maps and commands, "
            'kind "unbalance"'
        )
    return rig.spin.speed if rig.spin else 0.0
