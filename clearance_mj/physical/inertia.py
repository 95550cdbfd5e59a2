"""A known inverse inertia behind every contact and limit of a compiled model."""

from __future__ import annotations

import mujoco

from .elements import apply
from .softness import INVERSE_INERTIA

__all__ = ["set_inverse_inertia"]


def set_inverse_inertia(model: mujoco.MjModel, inverse_inertia: float = INVERSE_INERTIA) -> None:
    """Replace all of MuJoCo's Â by one value, and apply the softness of contacts, limits and clearances again.

    Changes of softness while a model runs then need no Â of each row (see `SOLREF_PER_UNIT`; a contact between
    two bodies that both move has twice the Â), and the parasitic mass μ = d/((1-d) Â) is 1e-8 kg in every pose.
    Contacts, limits and equalities whose softness is not in physical units become softer by this. ``mj_setConst``
    undoes it.

    Parameters
    ----------
    model : mujoco.MjModel
        Changed in place.
    inverse_inertia : float
        Â, 1/kg, or 1/(kg m²) of hinges, > 0; the smaller the more the parasitic mass.

    Raises
    ------
    ModelError
        If an element with a softness was removed.
    """
    model.body_invweight0[1:] = inverse_inertia
    model.dof_invweight0[:] = inverse_inertia
    model.tendon_invweight0[:] = inverse_inertia
    apply(model)
