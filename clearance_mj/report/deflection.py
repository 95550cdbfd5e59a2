"""The shape of shafts that rattle or whirl in their bushings, out of a response.

A response holds the shaft's displacement at its bushings only. The rest of its shape follows from the forces: between
the bushings the shaft is linear, so its modes (`linear_model`) under weight, unbalance, excitation and the recorded
grease and contact forces move as the shaft did, whichever engine recorded them. Two things are lost: what the
recorder's anti-alias filter took from the forces, and how the two ends of a bushing shared the contact force; they get
half each. What that leaves between shape and record at the bushings is taken up by the static deflection under forces
there. The shape is then within 1 % (RMS, of the tip's) of the modal engine's coordinates all along the shipped
rig's shaft, from soft contact to 2e5 N/m, at 2048 samples/s and above; without the last step it is up to 5 % off.
Forces are straight lines between samples; gyroscopic moments are those of the spin within 1 %.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np
import scipy.linalg
from scipy.interpolate import barycentric_interpolate

from ..core.errors import RecordError
from ..core.jit import jit
from ..linear import LinearModel, linear_model
from ..rig import Rig
from ..rig.loads import order_forces
from ..rotors.whirling import clearance_places, spin_and_angle
from ..signals.response import Response

__all__ = ["deflection"]

MODES = 16  # of the shaft's shape
SPIN_CHANGE = 0.01  # fraction of the highest spin by which it may change while gyroscopic moments stay the same
NODES = 6  # spins at which flows are computed where the spin changes


def deflection(rig: Rig, response: Response, x: Sequence[float | str] | np.ndarray) -> np.ndarray:
    """Return the displacement of points x relative to the base, from the forces of a response from rest.

    At the bushings it is as recorded.

    Parameters
    ----------
    rig : Rig
        The rig.
    response : Response
        Simulated.
    x : sequence of Point, length n_x
        Positions, m, or degrees of freedom.

    Returns
    -------
    ndarray, shape (n_t, n_x), or (n_t, 2, n_x) along y and z of a rig that moves along both
        m, from the line of the unloaded shaft.

    Raises
    ------
    RecordError
        If the response has no forces or displacements, as a test record.
    """
    contact, grease = response.contact_force, response.grease_force
    if response.displacement is None or contact is None or grease is None:
        raise RecordError(
            "the shaft's shape needs displacements, contact and grease forces at the bushings, which only simulated "
            "responses have"
        )
    model, moved = linear_model(rig, MODES), clearance_places(rig, response).T - rig.row_offsets
    middles = model.at_bushings
    steady = model.weight - grease.T @ middles - contact.T @ model.ends_by_row.mean(axis=1)
    driven = response.inputs.T @ [model.input(kind, i) for i, kind in enumerate(response.kinds)]
    motion = _modal_motion(model, steady, driven, *spin_and_angle(rig, response), 1 / response.fs)
    flexible = np.divide(1.0, model.omega**2, out=np.zeros(model.size), where=model.omega > 0)
    shapes = model.moved(x).reshape(-1, model.size) if rig.moves_across else model.shapes(x)
    flexibility_x, flexibility = (shapes * flexible) @ middles.T, (middles * flexible) @ middles.T
    lateral = motion @ shapes.T + (moved - motion @ middles.T) @ np.linalg.solve(flexibility, flexibility_x.T)
    return np.asarray(lateral.reshape(len(motion), -1, 2).transpose(0, 2, 1)) if rig.moves_across else lateral


def _modal_motion(
    model: LinearModel, steady: np.ndarray, driven: np.ndarray, spin: np.ndarray | None, angle: np.ndarray | None,
    step: float,
) -> np.ndarray:  # fmt: skip
    """Return modal coordinates (n_t, n) from rest under steady and driving forces (n_t, n) and unbalance."""
    force = steady + driven
    if spin is not None and angle is not None:
        force = force + _unbalance_force(model, spin, angle, step)
    else:
        spin = np.zeros(len(steady))
    change = np.diff(force, axis=0, append=force[-1:])
    n, scale = model.size, np.maximum(model.omega, 1.0)
    state = np.concatenate((scale * np.linalg.lstsq(model.stiff(spin[0]), steady[0], rcond=None)[0], np.zeros(n)))
    motion = np.empty_like(force)
    flows = _steps(model, spin, step, scale)
    for first, last in _constant_spin_blocks(spin):
        flow, of_force, of_change = map(np.ascontiguousarray, flows(float(spin[first:last].mean())))
        driven = force[first:last] @ of_force.T + change[first:last] @ of_change.T
        state = _integrate(flow, driven, state, motion[first:last])
    return motion / scale


@jit
def _integrate(flow: np.ndarray, driven: np.ndarray, state: np.ndarray, motion: np.ndarray) -> np.ndarray:
    """Fill ``motion`` with the first half (n_t, n) of the states, and return the state after the last."""
    for i in range(len(driven)):
        motion[i] = state[: motion.shape[1]]
        state = flow @ state + driven[i]
    return state


def _unbalance_force(model: LinearModel, spin: np.ndarray, angle: np.ndarray, step: float) -> np.ndarray:
    """Return forces (n_t, n) of orders and unbalance on modes: Ω² along the angle, across it where spin changes."""
    rate, square, cos, sin = np.gradient(spin, step), spin**2, np.cos(angle), np.sin(angle)
    orders = model.rig.orders
    turns = [part(each.order * angle) for each in orders for part in (np.cos, np.sin)]
    factors = np.stack((square * cos + rate * sin, square * sin - rate * cos, *turns), axis=1)
    return np.asarray(factors @ np.vstack((model.unbalance, order_forces(orders, model.directed, model.size))))


def _constant_spin_blocks(spin: np.ndarray) -> Iterator[tuple[int, int]]:
    """Yield the first sample of each interval of nearly constant spin, and the one after its last."""
    fine = SPIN_CHANGE * np.abs(spin).max()
    level = np.round(spin / fine) if fine else np.zeros(spin.size)
    edges = np.flatnonzero(np.diff(level)) + 1
    yield from zip((0, *edges), (*edges, spin.size))


def _steps(model: LinearModel, spin: np.ndarray, step: float, scale: np.ndarray) -> Callable[[float], list[np.ndarray]]:
    """Return `_step` as a function of spin: polynomials through few nodes, as its exponentials are smooth."""
    middle, half = (spin.min() + spin.max()) / 2, np.ptp(spin) / 2 if model.gyroscopic.size else 0.0
    nodes = middle + half * np.cos(np.pi * (np.arange(NODES) + 0.5) / NODES) if half else np.array([middle])
    flows = np.array([np.hstack(_step(model, node, step, scale)) for node in nodes])
    ends = [2 * model.size, 3 * model.size]
    return lambda at: np.split(barycentric_interpolate(nodes, flows, at) if half else flows[0], ends, axis=1)


def _step(model: LinearModel, spin: float, step: float, scale: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the exact step's matrices of the state (scale q, q̇), the force, and the force's change."""
    n = model.size
    rates = np.zeros((4 * n, 4 * n))
    rates[:n, n : 2 * n] = step * np.diag(scale)
    rates[n : 2 * n, : 3 * n] = step * np.hstack((-model.stiff(spin) / scale, -model.viscous(spin), np.eye(n)))
    rates[2 * n : 3 * n, 3 * n :] = np.eye(n)
    transition = scipy.linalg.expm(rates)[: 2 * n]
    return transition[:, : 2 * n], transition[:, 2 * n : 3 * n], transition[:, 3 * n :]
