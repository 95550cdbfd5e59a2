"""What channels show of forces in the clearances of a rig whose open parameters have other values."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ...beam import ModalModel, ritz_model
from ...rig import Rig
from ...rotors.gains import SpatialGains
from ...rotors.spatial import spatial_model
from ...structure import Beam, Shaft
from ...structure.base import ratios_of_modes
from .priors import rig_with

__all__ = ["Lines", "displacement_at_ends", "force_gains", "gains_at", "model_with"]

MODES, SPATIAL_MODES = 16, 10  # of the structure or of each of its planes, to which the static shapes are added
STRUCTURAL = "beam", "1/", "structure", "masses", "springs", "oscillators", "fixture", "planes"  # paths begin so
AnyModel = ModalModel | SpatialGains


class Lines(NamedTuple):
    """Spectral lines of a record."""

    kind: str  #: of the excitation
    omega: np.ndarray  #: (n_f,) complex frequencies, rad/s
    tested: Rig  #: whose shaker and spin are those of the record


def force_gains(rig: Rig, values: Mapping[str, float], probes: bool, lines: Sequence[Lines]) -> list[np.ndarray]:
    """Return the gains (n_f, n_channels, n_forces + 1) of forces and excitation, for each record.

    A force acts half in the clearance's middle, where the filling does, and half at its ends, where contact does.
    """
    model = model_with(rig, values)
    at = (model.at_bushings + displacement_at_ends(model).mean(axis=1)) / 2
    return gains_at(model, values, probes, lines, at)


def gains_at(
    model: AnyModel, values: Mapping[str, float], probes: bool, lines: Sequence[Lines], at: np.ndarray
) -> list[np.ndarray]:
    """Return the gains of forces that act at rows (n_forces, n_modes), and of the excitation, for each record."""
    rows = model.at_probes(values) if probes else np.zeros((0, model.size))
    if isinstance(model, SpatialGains):
        return [model.driven(each.tested).channel_gains(rows, each.kind, each.omega, at) for each in lines]
    return [model.channel_gains(rows, each.kind, each.omega, at) for each in lines]


def displacement_at_ends(model: AnyModel) -> np.ndarray:
    """Return the displacement (n_forces, 2, n_modes) at both ends of each clearance, y and z of a round one."""
    return model.at_ends.reshape(-1, 2, model.size)


def model_with(rig: Rig, values: Mapping[str, float]) -> AnyModel:
    """Return the modes of the structure with values by name, without the filling's stiffness.

    Values that are no part of the structure's matrices leave the modes as they are: these are kept for later calls.
    """
    whole, structural = rig_with(rig, values), {n: v for n, v in values.items() if _structural(n)}
    linear, reduce = whole.linear, _spatial if rig.is_spatial else _planar
    if whole.attached:  # modes of the whole are not those that the damping ratios are of
        return reduce(rig_with(rig, structural), whole, ())
    ratios = linear.damping_ratios or () if isinstance(linear, Beam | Shaft) else ()
    if isinstance(linear, Beam | Shaft):
        field = "beam" if whole.beam else "structure"
        # Modes are damped by ratios of their own: these leave the reduction as it is.
        structural |= {f"{field}.damping_ratios[{i}]": 0.0 for i in range(len(ratios))}
    return reduce(rig_with(rig, structural), whole, ratios)


def _planar(structural: Rig, whole: Rig, ratios: Sequence[float]) -> AnyModel:
    model = ritz_model(structural, MODES)
    damping = model.damping + 2 * model.omega * ratios_of_modes(ratios, model.size)
    return dataclasses.replace(model, rig=whole, damping=damping)


def _spatial(structural: Rig, whole: Rig, ratios: Sequence[float]) -> AnyModel:
    model = spatial_model(structural, SPATIAL_MODES, turning=bool(whole.linear.shafts) and whole.spin is not None)
    y, z = model.planes
    planes = [y.stop, z.stop - y.stop] if y != z else [model.size]
    damping = model.damping + 2 * model.omega * np.concatenate([ratios_of_modes(ratios, n) for n in planes])
    return SpatialGains(dataclasses.replace(model, rig=whole, damping=damping))


def _structural(name: str) -> bool:
    """Whether a parameter is in the matrices of the structure and what is attached to it."""
    return name.startswith(STRUCTURAL) or ".housing." in name
