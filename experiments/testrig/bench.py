"""The bench: a rig with its hidden truth, shaken."""

from collections.abc import Callable, Sequence
from dataclasses import asdict

import numpy as np

from clearance_mj.core.errors import ExcitationError, RigError, SimulationError
from clearance_mj.rig import Rig
from clearance_mj.signals import Excitation, Response, sampling
from clearance_mj.version import __version__
from experiments.testrig import integrator
from experiments.testrig.fem import FiniteElements
from experiments.testrig.rigs import Truth

Course = Callable[[float], tuple[Rig, Sequence[Truth]]]
"""From time, s, to the rig, of which gaps and offsets count, and its bushings as they are then"""

FACTOR = 32  # Time steps per sample: 65 536 steps per second at 2048 Hz
BLOCK = 1024
"""Samples between two filterings: memory does not grow with the record. The grease drifts from block to block."""
DRIFT_INTERVAL = 8.0  # s between independent values of the grease's stiffness
DRIFT_STREAM = 1  # Second word of the drift's seed, so that no other generator of the same seed draws the same numbers


def simulate_rig(
    rig: Rig, truth: Truth | Sequence[Truth], excitation: Excitation, seed: int, course: Course | None = None
) -> Response:
    """Shake the virtual rig.

    Parameters
    ----------
    rig : Rig
        Shaft, masses, sensors, gaps and bushings' positions. Its grease and contact values are not used.
    truth : Truth or sequence of Truth
        Grease and contact as they really are, in all bushings or in each.
    excitation : Excitation
        Base acceleration, or force at the rig's shaker.
    seed : int
        Of the grease's drift.
    course : callable, optional
        How gaps and contacts change, such as by wear: from time, s, to rig and truth, every 1024 samples.

    Returns
    -------
    Response
        Every field, without sensor noise; ``provenance["contact_fraction"]`` is the share of time in which each
        bushing touches with at least one end.

    Raises
    ------
    ExcitationError
        If a force is given but the rig has no position for it.
    SimulationError
        If the implicit step does not converge; the message names rig and time.
    RigError
        If the rig is not a uniform cantilever, or a bushing has one wall only or moves with another point.
    """
    for j, bushing in enumerate(rig.bushings):
        if bushing.stops != "both":
            raise RigError(f'bushings[{j}].stops is "{bushing.stops}"; the virtual rig\'s bushings have both walls')
        if bushing.to is not None:
            raise RigError(f"bushings[{j}].to is {bushing.to!r}; the virtual rig's bushings stand on the base")
    if rig.beam is None:
        raise RigError(f"rig {rig.name!r} has no [beam]; the virtual rig is a uniform cantilever")
    truths = (truth,) * len(rig.bushings) if isinstance(truth, Truth) else tuple(truth)
    elements = FiniteElements.of_shaft(rig.beam, rig.point_masses)
    load = _load(rig, elements, excitation.kind)
    points = elements.points(
        [float(x) for b in rig.bushings for x in b.ends] + [float(b.position) for b in rig.bushings]
    )
    scheme = integrator.scheme(elements, load, points, 1 / (excitation.fs * FACTOR))
    motion = integrator.at_rest(elements, load, points, greases(truths, [b.offset for b in rig.bushings]))
    outputs, touching = _march(rig, truths, scheme, motion, elements, excitation, seed, course)
    bushings, sensors = len(rig.bushings), len(rig.sensors)
    acceleration, displacement, contact, grease = np.split(outputs.T, sensors + bushings * np.arange(3))
    provenance = {
        "source": "synthetic: virtual test rig", "rig": rig.to_dict(), "truth": [asdict(t) for t in truths],
        "excitation": dict(excitation.description), "seed": seed, "version": __version__,
        "contact_fraction": (touching / (excitation.value.size * FACTOR)).tolist(),
    }  # fmt: skip
    return Response(
        excitation.fs, excitation.value, acceleration, displacement=displacement, contact_force=contact,
        grease_force=grease, kind=excitation.kind, band=excitation.band, responses=tuple(rig.sensor_labels),
        reference=rig.shaker.label(excitation.kind), provenance=provenance,
    )  # fmt: skip


def _load(rig: Rig, elements: FiniteElements, kind: str) -> np.ndarray:
    if kind == "base":
        return -elements.inertia
    if rig.shaker.position is None:
        raise ExcitationError(f'rig "{rig.name}" has no shaker.position: a force needs one')
    positions, factors = zip(*rig.shaker.forces)
    return np.array(factors) @ elements.points([float(x) for x in positions]).dense(elements.count)


def _march(
    rig: Rig, truths: Sequence[Truth], scheme: integrator.Scheme, motion: integrator.Motion, elements: FiniteElements,
    excitation: Excitation, seed: int, course: Course | None,
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Run the integrator block by block; return the filtered outputs and the counts of touching steps."""
    bushings, n = len(rig.bushings), excitation.value.size
    contacts, grease = _contacts(rig, truths), greases(truths, [b.offset for b in rig.bushings])
    starts = np.arange(0, n, BLOCK)
    drift = _drift(truths, starts / excitation.fs, seed)
    sensors = elements.points([float(s.position) for s in rig.sensors])
    follows = 1.0 if excitation.kind == "base" else 0.0
    fast = sampling.interpolate(excitation.value, FACTOR)
    decimator = sampling.Decimator(sensors.start.size + 3 * bushings, FACTOR)
    touching, slow = np.zeros(bushings, dtype=np.int64), []
    for first, change in zip(starts, drift):
        block = fast[first * FACTOR : (first + BLOCK) * FACTOR]
        out = np.zeros((block.size, sensors.start.size + 3 * bushings))
        now = grease._replace(stiffness=grease.stiffness * change)
        if course:
            contacts = _contacts(*course(first / excitation.fs))
        done = integrator.march(
            scheme, motion, contacts, now, block, follows, sensors.start, sensors.weight, out, touching
        )
        if done < block.size or not np.all(np.isfinite(out[-1])):
            time = first / excitation.fs + done * scheme.step
            raise SimulationError(f'rig "{rig.name}": the bushings\' forces did not converge at {time:.6f} s')
        slow.append(decimator.push(out))
    slow.append(decimator.flush())
    return np.concatenate(slow)[:n], touching


def _contacts(rig: Rig, truths: Sequence[Truth]) -> integrator.Contacts:
    """Both ends of every bushing; each has half of its stiffness."""
    places = np.array([(b.gap, b.offset) for b in rig.bushings for _ in b.ends]).reshape(-1, 2).T
    rows = [(t.contact_stiffness / 2, t.contact_exponent, t.contact_dissipation) for t in truths for _ in range(2)]
    return integrator.Contacts(*places.copy(), *np.array(rows, dtype=float).reshape(-1, 3).T.copy())


def greases(truths: Sequence[Truth], offsets: Sequence[float] = ()) -> integrator.Greases:
    """Grease of every bushing as the integrator reads it."""

    def column(name: str) -> np.ndarray:
        return np.array([getattr(t, name) for t in truths], dtype=float)

    models = [t.hysteresis for t in truths]
    parameters = np.zeros((len(models), max((m.parameters.size for m in models), default=0)))
    for row, model in zip(parameters, models):
        row[: model.parameters.size] = model.parameters
    kinds, states = np.array([(m.model, m.states) for m in models], dtype=np.int64).reshape(-1, 2).T.copy()
    film_damping, film_height, film_limit = map(column, ("film_damping", "film_height", "film_limit"))
    offset = np.array(offsets or [0.0] * len(models), dtype=float)
    stiffness, ratio = column("grease_stiffness"), column("elastic_ratio")
    return integrator.Greases(
        stiffness, ratio, kinds, states, parameters, film_damping, film_height, film_limit, offset
    )


def _drift(truths: Sequence[Truth], time: np.ndarray, seed: int) -> np.ndarray:
    """Grease stiffness over its nominal value, shape (len(time), bushings): straight lines between random values."""
    knots = int(time[-1] / DRIFT_INTERVAL) + 2
    largest = np.array([[t.drift] for t in truths]).reshape(-1, 1)
    values = np.random.default_rng((seed, DRIFT_STREAM)).uniform(-largest, largest, (len(truths), knots))
    return 1 + np.array([np.interp(time, DRIFT_INTERVAL * np.arange(knots), row) for row in values]).T
