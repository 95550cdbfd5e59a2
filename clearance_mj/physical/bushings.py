"""Rubber bushings between two sites: stiffness and damping along and about each axis.

A bushing is stored in the model as an equality and ``<custom><numeric name="physical:bushing:NAME" data="..."/>``, its
stiffnesses and then its dampings, which are read at every step.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from ..core.errors import LawError, ModelError
from .elements import change_spec, compile_target, find, name_of, require_spec
from .records import MARK, marked_names, note_softener, write_numbers
from .softness import solref_solimp

__all__ = ["SiteBushing", "add_bushing", "bushings_of"]


class SiteBushing(NamedTuple):
    """A bushing of a model, stored as an equality and a custom numeric."""

    name: str
    equality: int
    numeric: int  # address in numeric_data: stiffnesses, then dampings
    axes: int  # 3 or 6
    site: int  # whose axes are used


def add_bushing(spec: mujoco.MjSpec, site_a: Any, site_b: Any, k: ArrayLike, c: ArrayLike) -> mujoco.MjsEquality:
    """Join two sites by a bushing: forces k r + c ṙ along its axes and torques k θ + c ω about them.

    The axes are those of ``site_b``. An equality "A to B" between the sites (``weld``, of three axes ``connect``) holds
    the bushing; a `Softener` gives it its stiffness, exact in any pose and for any masses. Angles are twice the vector
    part of the quaternion, θ to 1 % up to 0.5 rad.

    Parameters
    ----------
    spec : mujoco.MjSpec
        Changed in place.
    site_a, site_b : str or mujoco.MjsSite
        On two bodies; they coincide in the bushing's rest.
    k : array_like, shape (6,) or (3,)
        Stiffness along x, y and z, N/m, and about them, N m/rad; with three numbers it turns freely. > 0.
    c : array_like, shape (6,) or (3,)
        Damping, N s/m and N m s/rad, >= 0.

    Returns
    -------
    mujoco.MjsEquality
        The equality.

    Raises
    ------
    ModelError
        For a site that the model does not have, and sites on one body.
    LawError
        For numbers out of range, or of another count.
    """
    stiffness, damping = np.asarray(k, dtype=float), np.asarray(c, dtype=float)
    if stiffness.shape != damping.shape or stiffness.shape not in ((3,), (6,)):
        raise LawError(f"k and c of a bushing have the shapes {stiffness.shape} and {damping.shape}; they need 3 or 6")
    for name, values, sign, ok in (("k", stiffness, ">", stiffness > 0), ("c", damping, ">=", damping >= 0)):
        if not np.all(ok & np.isfinite(values)):
            raise LawError(f"{name} = {values.tolist()} of a bushing must be finite and {sign} 0")
    model, names = compile_target(require_spec(spec)), [name_of(site) for site in (site_a, site_b)]
    bodies = [model.site_bodyid[find(model, "site", name)] for name in names]
    if model.body_weldid[bodies[0]] == model.body_weldid[bodies[1]]:
        raise ModelError(f'sites "{names[0]}" and "{names[1]}" are on one rigid body, so there is no bushing')
    inverse = float(model.body_invweight0[bodies, 0].sum())
    solref, solimp = solref_solimp(stiffness[:3].max(), damping[:3].max(), inverse)

    def between(changed: mujoco.MjSpec) -> mujoco.MjsEquality:
        equality = changed.add_equality(
            name=" to ".join(names), objtype=mujoco.mjtObj.mjOBJ_SITE, name1=names[0], name2=names[1],
            type=mujoco.mjtEq.mjEQ_WELD if len(stiffness) == 6 else mujoco.mjtEq.mjEQ_CONNECT,
        )  # fmt: skip
        equality.solref[:], equality.solimp[:] = solref, solimp
        write_numbers(changed, f"{MARK}bushing:{equality.name}", [*stiffness, *damping])
        note_softener(changed)
        return equality

    return change_spec(spec, between)[0]


def bushings_of(model: mujoco.MjModel) -> Iterator[SiteBushing]:
    """Yield the bushings of a model."""
    for i, prefix, suffix in marked_names(model, mujoco.mjtObj.mjOBJ_NUMERIC, f"{MARK}bushing:"):
        equality = find(model, "equality", prefix + suffix)
        axes, site = int(model.numeric_size[i]) // 2, int(model.eq_obj2id[equality])
        yield SiteBushing(prefix + suffix, equality, int(model.numeric_adr[i]), axes, site)
