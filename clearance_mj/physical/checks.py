"""Checks of a model for what changes the requested softness of its contacts, limits and clearances."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from ..core.errors import ModelError
from .bristles import bristles_of, pairs_with_bristles
from .bushings import bushings_of
from .drives import drives
from .elements import KINDS, apply, compile_target, inverse_inertia, requested_softness, require_spec, write_softness
from .limits import add_missing_pairs, uncovered_contacts
from .packages import naming_package
from .rows import ParasiticMass, bent_poses, parasitic_mass, softness_of
from .softness import LARGEST_IMPEDANCE
from .step import Stable, limiting_element

__all__ = ["ModelWarning", "check", "compile", "points_of"]

_TOLERANCE = 1e-5  # relative, of softness, after MJCF's six digits
_ITERATIONS = 10  # of the solver, below which it may not converge
_MAX_SLOWER = 1e-3  # relative, tolerated loss of ringing frequency
_POINTS = {
    ("PLANE", "CAPSULE"): 2, ("PLANE", "CYLINDER"): 4, ("PLANE", "BOX"): 4, ("PLANE", "MESH"): 4,
    ("CAPSULE", "CAPSULE"): 2, ("CAPSULE", "CYLINDER"): 4, ("CAPSULE", "BOX"): 2, ("CAPSULE", "MESH"): 4,
    ("CYLINDER", "CYLINDER"): 4, ("CYLINDER", "BOX"): 4, ("CYLINDER", "MESH"): 4, ("BOX", "BOX"): 8,
    ("BOX", "MESH"): 4, ("MESH", "MESH"): 4,
}  # fmt: skip
"""Largest number of contact points between two geoms, where above one"""


class ModelWarning(UserWarning):
    """A compiled model that deviates from its specification; see `check`."""


def compile(spec: mujoco.MjSpec, poses: ArrayLike | None = None) -> mujoco.MjModel:
    """Compile a specification with the requested softness, applied again after any change.

    Parameters
    ----------
    spec : mujoco.MjSpec
        Its contacts, limits and clearances get their solver parameters anew.
    poses : array_like, shape (n, nq), optional
        Poses at which the step must be stable; without them the model's initial pose and its keyframes.

    Returns
    -------
    mujoco.MjModel
        The model.

    Raises
    ------
    ModelError
        If the specification does not compile, an element was removed, or the time step is too long.

    Warns
    -----
    ModelWarning
        For settings that change a softness, contacts that keep MuJoCo's, a step that is too long in poses within the
        joints' ranges, and what acts only while a `Softener` is in use.
    """
    model = compile_target(require_spec(spec))
    if add_missing_pairs(spec, model):
        model = compile_target(spec)
    acts = any(bristles_of(model)) or any(drives(model)) or any(bushings_of(model))
    if acts or any(element.softness.law for element in requested_softness(model)):
        with naming_package("laws, friction and drives"):
            from .softener import reserve  # numba

        if reserve(spec, model):
            model = compile_target(spec)
    write_softness(spec, model)
    apply(model)
    for problem in _unstable_step(model, poses):
        raise ModelError(problem)
    softener = "; ".join(_without_softener(model))
    for problem in (*_compile_problems(model), *([softener] if softener else []), *_unstable_elsewhere(model, poses)):
        warnings.warn(problem, ModelWarning, stacklevel=2)
    return model


def check(model: mujoco.MjModel, poses: ArrayLike | None = None) -> tuple[str, ...]:
    """Return what changes the stiffness and damping of a model's contacts and limits.

    Parameters
    ----------
    model : mujoco.MjModel
        The model, which is not changed.
    poses : array_like, shape (n, nq), optional
        Poses at which the step must be stable; without them the model's initial pose and its keyframes.

    Returns
    -------
    tuple of str
        Problems, one line each. Contacts and limits whose solref is not in physical units are left alone.
    """
    problems = [*_compile_problems(model), *_without_softener(model), *_element_problems(model)]
    problems += [*_slow_ringing(model, poses), *_geom_problems(model), *_solver_problems(model)]
    return *problems, *(_unstable_step(model, poses) or _unstable_elsewhere(model, poses))


def _compile_problems(model: mujoco.MjModel) -> Iterator[str]:
    """Yield the problems that `compile` warns of: settings, and contacts that keep MuJoCo's softness."""
    yield from _setting_problems(model)
    yield from _uncovered_contacts(model)
    yield from _height_fields(model)


def _height_fields(model: mujoco.MjModel) -> Iterator[str]:
    """Yield pairs with a height field that do not share their softness: each touched prism is a contact point."""
    shared = {name for kind, name, softness in requested_softness(model) if kind == "pair" and softness.shared}
    for pair, geoms in enumerate(zip(model.pair_geom1, model.pair_geom2)):
        if int(mujoco.mjtGeom.mjGEOM_HFIELD) in model.geom_type[[*geoms]] and model.pair_solref[pair, 0] < 0:
            if (name := model.pair(pair).name or str(pair)) not in shared:
                yield f'contact "{name}": each prism of its height field has k and c; points="share" shares them'


def _uncovered_contacts(model: mujoco.MjModel) -> Iterator[str]:
    """Yield contacts with MuJoCo's softness although their geom was given one."""
    for geom, _, _, pairs in uncovered_contacts(model):
        name = model.geom(geom).name
        others = ", ".join(sorted(f'"{model.geom(g).name or g}"' for pair in pairs for g in pair if g != geom))
        collides, affinity = model.geom_contype[geom], model.geom_conaffinity[geom]
        flexes = [i for i in range(model.nflex)
                  if collides & model.flex_conaffinity[i] or affinity & model.flex_contype[i]]  # fmt: skip
        if pairs:
            yield f'geom "{name}" touches {others} with MuJoCo\'s softness, for they came later; use compile()'
        for i in flexes:
            flex = model.flex(i).name or i
            yield f'geom "{name}" touches flex "{flex}" with MuJoCo\'s softness: flexes have no pairs'


def _physical_elements(model: mujoco.MjModel) -> Iterator[tuple[str, int, str]]:
    """Yield kind, index and name of each contact and limit in physical units, actual or requested."""
    known = {(kind, name) for kind, name, _ in requested_softness(model)}
    for kind, fields in KINDS.items():
        solref = getattr(model, fields.model[0])
        for i in range(len(solref)):
            name = getattr(model, kind)(i).name or str(i)
            if solref[i, 0] < 0 or (kind, name) in known:
                yield kind, i, name


def _setting_problems(model: mujoco.MjModel) -> Iterator[str]:
    kinds = {kind for kind, _, _ in _physical_elements(model)}
    off, on, flags, more = model.opt.disableflags, model.opt.enableflags, mujoco.mjtDisableBit, mujoco.mjtEnableBit
    limits, contacts, integrator = bool(kinds & {"joint", "tendon"}), "pair" in kinds, model.opt.integrator
    implicit = any(element.softness.implicit for element in requested_softness(model))
    for applies, message in (
        (kinds and off & flags.mjDSBL_CONSTRAINT, "flag constraint is disabled: no contact or limit acts"),
        (limits and off & flags.mjDSBL_LIMIT, "flag limit is disabled: no joint or tendon limit acts"),
        (contacts and off & flags.mjDSBL_CONTACT, "flag contact is disabled: no contact acts"),
        (contacts and on & more.mjENBL_OVERRIDE, "flag override replaces the softness of every contact; disable it"),
        (kinds and on & more.mjENBL_DIAGEXACT, "flag diagexact scales stiffness with the pose; disable it"),
        (kinds and integrator == getattr(mujoco.mjtIntegrator, "mjINT_DISCRETE", None),
         "integrator discrete scales stiffness with the step where there is damping, and damps all ringing; use "
         "Euler, implicitfast or RK4, or add_backlash(..., native=True), which is exact there"),
        (implicit and integrator == mujoco.mjtIntegrator.mjINT_RK4,
         "integrator RK4 takes implicit contacts and limits for soft ones with a mass; use Euler or implicitfast"),
    ):  # fmt: skip
        if applies:
            yield message


def _without_softener(model: mujoco.MjModel) -> Iterator[str]:
    condition = "until a Softener(model) is in use, or its update() is called in every step"
    elsewhere = f"{condition}; in MJX until physical.mjx steps it, in MuJoCo Warp until physical.warp puts it there"
    if mujoco.get_mjcb_control() is not None:  # that of a Softener in use, or one that may call its update()
        return
    for bristles in bristles_of(model):
        yield f'friction of {bristles.kind} "{bristles.name}" does not act {elsewhere}'
    for bushing in bushings_of(model):
        yield f'bushing "{bushing.name}" has one stiffness in all directions {condition}'
    for drive in drives(model):
        yield f'actuator "{drive.name}" exerts nothing, for its drive does not turn {elsewhere}'
    for element in requested_softness(model):
        if element.softness.law:
            yield f'{KINDS[element.kind].noun} "{element.name}" keeps one stiffness and follows no law {condition}'


def _element_problems(model: mujoco.MjModel) -> Iterator[str]:
    requested = {(kind, name): softness for kind, name, softness in requested_softness(model)}
    bristle_pairs = pairs_with_bristles(model)
    for kind, i, name in _physical_elements(model):
        where, asked_for = f'{KINDS[kind].noun} "{name}"', requested.get((kind, name))
        solimp = getattr(model, KINDS[kind].model[1])[i]
        if inverse_inertia(model, kind, i) <= 0:
            yield f"{where} is rigid, since MuJoCo finds no inertia behind it in the initial pose; apply() gives it one"
        elif solimp[0] != solimp[1]:
            yield f"{where}: impedance changes from {solimp[0]:g} to {solimp[1]:g} with depth, and so does stiffness"
        elif solimp[0] > 10 * LARGEST_IMPEDANCE and not (asked_for and asked_for.implicit):
            yield f"{where}: impedance {solimp[0]:g} adds a mass that makes it ring too slow; 1e-4 does not"
        elif asked_for:
            has = softness_of(model, kind, i) or (np.nan, np.nan)
            ask = asked_for.at_step(inverse_inertia(model, kind, i), model.opt.timestep)
            if not np.allclose(has, ask, rtol=_TOLERANCE, atol=0):
                yield (
                    f"{where} has k = {has[0]:.6g}, c = {has[1]:.6g}, but k = {ask[0]:.6g}, c = {ask[1]:.6g} "
                    "was asked; use compile() or apply()"
                )
        starts = [getattr(model, field)[i] for field in KINDS[kind].starts.values()]
        if offset := starts[0] - sum(starts[1:]):
            yield f"{where}: its margin lets the force begin {offset:g} before zero; set margin to 0"
        if kind == "pair":
            yield from _pair_problems(model, i, where, bool(asked_for and asked_for.shared), bristle_pairs)


def _pair_problems(model: mujoco.MjModel, i: int, where: str, shared: bool, bristle_pairs: set[str]) -> Iterator[str]:
    if model.pair_dim[i] > 1 and model.pair(i).name not in bristle_pairs:
        cone, effect = "a pyramidal", "multiplies its normal stiffness"
        if model.opt.cone == mujoco.mjtCone.mjCONE_ELLIPTIC:
            cone, effect = "an elliptic", "changes its normal force while it slides"
        yield f"{where}: friction (condim {model.pair_dim[i]}) in {cone} cone {effect}; use condim 1"
    first, second, points = points_of(model, int(model.pair_geom1[i]), int(model.pair_geom2[i]))
    if points > 1 and not shared:
        yield f"{where}: {first} and {second} touch in up to {points} points, each with this stiffness"


def points_of(model: mujoco.MjModel, *geoms: int) -> tuple[str, str, int]:
    """Return the types of two geoms and their largest number of contact points; 1 per prism of a height field."""
    names = [mujoco.mjtGeom(int(g)).name.removeprefix("mjGEOM_") for g in sorted(model.geom_type[[*geoms]])]
    first, second = names
    return first.lower(), second.lower(), _POINTS.get((first, second), 1)


def _slow_ringing(model: mujoco.MjModel, poses: ArrayLike | None) -> Iterator[str]:
    cases = parasitic_mass(model, poses)
    for kind, i, name in _physical_elements(model):
        case = cases.get(f'{kind} "{name}"', ParasiticMass(0.0, 0.0, 0))
        slower = 1 - 1 / np.sqrt(1 + case.ratio)
        fields = KINDS[kind]
        if slower > _MAX_SLOWER and getattr(model, fields.model[1])[i, 0] <= 10 * LARGEST_IMPEDANCE:
            factor = case.inverse_inertia / inverse_inertia(model, kind, i)
            yield (
                f'{fields.noun} "{name}" rings {100 * slower:.2g} % too slow in pose {case.pose}, where the inertia '
                f"behind it is {factor:.0f} times less than MuJoCo's estimate: write more "
                f"into model.{fields.inverse} and apply()"
            )


def _geom_problems(model: mujoco.MjModel) -> Iterator[str]:
    collide = model.geom_contype | model.geom_conaffinity
    for i in np.flatnonzero((model.geom_solref[:, 0] < 0) & (collide != 0)):
        name = model.geom(i).name or f"{i} of body {model.body(model.geom_bodyid[i]).name}"
        yield (
            f'geom "{name}" has a solref of its own, which is mixed with that of whatever it touches, and scaled with '
            "that one's inertia; contact() makes explicit pairs of it"
        )


def _solver_problems(model: mujoco.MjModel) -> Iterator[str]:
    """Yield a warning of few solver iterations, where friction or implicit softness couples the rows."""
    coupled = any(bristles_of(model)) or any(element.softness.implicit for element in requested_softness(model))
    if coupled and model.opt.iterations < _ITERATIONS:
        yield f"iterations {model.opt.iterations}: the solver may end before contacts have their force; use 100"


def _unstable_step(model: mujoco.MjModel, poses: ArrayLike | None) -> list[str]:
    return _step_problem(model, limiting_element(model, poses), "pose {}".format)


def _unstable_elsewhere(model: mujoco.MjModel, poses: ArrayLike | None) -> list[str]:
    """Return a message if the step is unstable within the joints' ranges; [] if poses were given."""
    if poses is not None or not len(bent := bent_poses(model)):
        return []
    return _step_problem(
        model, limiting_element(model, bent, contacts=False),
        lambda i: f"at qpos {np.round(bent[i], 2).tolist()}, which the joints' ranges allow"
    )  # fmt: skip


def _step_problem(model: mujoco.MjModel, stable: Stable, where: Callable[[int], str]) -> list[str]:
    if model.opt.timestep < stable.step:
        return []
    k, c = stable.hardest_at(model.opt.timestep)
    explicit = {f'{kind} "{name}"' for kind, name, softness in requested_softness(model) if not softness.implicit}
    hint = ""
    if stable.element.startswith("teeth"):
        hint = "; add_backlash(..., implicit=True) is stable at any step"
    elif stable.element in explicit:
        hint = "; implicit=True makes it stable at any step"
    euler = model.opt.integrator == mujoco.mjtIntegrator.mjINT_EULER
    if euler and model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_EULERDAMP and model.dof_damping.any():
        hint += "; flag eulerdamp is disabled, so dampers of joints are explicit: enable it, or take implicitfast"
    return [
        f"timestep {model.opt.timestep:g} s is too long: {stable.element} is stable below {stable.step:.3g} s "
        f"({where(stable.pose)}), and at this step up to k = {k:.3g} and c = {c:.3g}; accuracy takes about "
        f"{stable.step / 10:.1g} s{hint}"
    ]
