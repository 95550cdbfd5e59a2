"""The engine mjx: many cases of the links' model as one JAX program, each with its own law, rig and excitation.

A case's model is the compiled one of the engine links, with the mass matrix of its straight chains: see
`LinksRun.equations`. Before every step each case's contacts get the stiffness and damping that its law has at that
moment, with which MuJoCo's soft constraints give exactly the law's force; the step is MuJoCo's Euler step. `mjx.step`
of that model, which computes matrices and contacts anew each time, takes some ten thousand times as long on a CPU, for
the same motion to 5e-5 over impacts and 3e-8 in the gap.
"""

from __future__ import annotations

import collections
import functools
import itertools
from collections.abc import Callable, Sequence
from typing import Annotated, Any, ClassVar, NamedTuple, cast

import numpy as np
from numba.core.errors import NumbaError
from pydantic import Field

from ..clearance.follower import SLOWEST_IMPACT
from ..clearance.lanes import choose, larger, root, signed, where_above
from ..clearance.law import Law
from ..clearance.record import BUSHING, fillings_of, laws_of, shared_kinds
from ..clearance.vectors import TINY
from ..core.errors import ClearanceError, LawError
from ..core.validation import Positive, Whole
from ..linear import linear_model
from ..physical.packages import naming_package
from ..rig import Rig
from ..rig.instruments import Kinds
from .base import Engine, SeveralRuns, SimulationRun, in_columns, register
from .links import Links
from .links_plant import IN_MUJOCO, links_plant
from .links_run import LinksRun
from .scheme import driven
from .turning import as_probes

__all__ = ["Mjx", "MjxRun", "MjxRuns"]

ROOM = 2**24  # numbers of a program's output
LONGEST = 8192  # largest number of steps of a program


@register
class Mjx(Engine):
    """MuJoCo flexible links in JAX."""

    name: ClassVar[str] = "mjx"
    at_once: ClassVar[int] = 1024
    links: Annotated[Whole, Field(ge=3)] = 16
    """number of links of each shaft"""
    safety: Positive = 0.6
    """time step over its stability limit, with contacts at their stiffest"""

    def largest_step(self, rig: Rig, law: Law) -> float:
        """Return the largest step of the engine links."""
        return Links(self.links, self.safety).largest_step(rig, law)

    def start(self, rig: Rig, law: Law, kind: Kinds, step: float) -> SimulationRun:
        """Begin a simulation at rest; see `Engine.start`."""
        with naming_package("simulations", "clearance-mj[mjx]", "engine mjx"):
            import jax  # noqa: F401
        driven(linear_model(rig), kind)  # refuses what cannot be excited so
        _require_supported(rig, law)
        return MjxRun(LinksRun(self, rig, law, kind, step, links_plant(rig, self.links)), law)


def _require_supported(rig: Rig, law: Law) -> None:
    of_rig = {"gravity": rig.gravity, "loads": rig.loads, "a spin": rig.spin, "orders": rig.orders}
    unknown = [what for what, value in of_rig.items() if value]
    for j, (bushing, filling) in enumerate(zip(rig.bushings, fillings_of(rig, law))):
        of_bushing = {
            "friction": bushing.friction is not None, f"walls {bushing.wall_model.name!r}":
            type(bushing.wall_model) not in IN_MUJOCO, "an oil film that turns": filling.is_circulatory,
        }  # fmt: skip
        unknown += [f"{what} at bushings[{j}]" for what, value in of_bushing.items() if value]
    if unknown:
        raise ClearanceError(f"rig {rig.name!r}: the mjx engine does not simulate {unknown[0]}; use links or modal")


class _CompiledClearance(NamedTuple):
    """Static data of a clearance in a program, the same for all of its cases."""

    middle: tuple[int, ...]  # rows of displacements
    ends: tuple[tuple[int, ...], ...]  # rows of each end
    filling: Callable[..., None]
    contact: Callable[..., None]
    record: Any  # of `BUSHING`


_Record: Any = collections.namedtuple("_Record", BUSHING.names or ())  # type: ignore[misc]


class _Equations(NamedTuple):
    """A case: q₊ = q + h v₊, v₊ = v + h a, a = of_position q + of_velocity v + of_input u - of_force f."""

    step: Any  # s
    of_position: Any  # (nv, nv)
    of_velocity: Any  # (nv, nv)
    of_input: Any  # (nv, n_inputs)
    of_force: Any  # (nv, n_rows)
    at_rows: Any  # (n_rows, nv) displacements of clearances
    at_sensors: Any  # (n_sensors, nv) per a
    on_base: Any  # (n_sensors, n_inputs)
    readings: Any  # (n_sensors, 2, nv), or (0, 2, nv)
    numbers: Any  # (n,) as of `Clearance`


class _Columns(NamedTuple):
    """Columns of the clearances in a step, in the order of `SimulationRun.advance`."""

    displacement: list[Any]
    contact_force: list[Any]
    grease_force: list[Any]
    touches: list[Any]


class _Motion(NamedTuple):
    """State of a case between steps."""

    position: Any  # (nv,)
    velocity: Any  # (nv,)
    clearances: Any  # of each (displacement, envelope, states of the filling, speed of impact along the wall per end)


class MjxRun(SimulationRun):
    """A simulation by the engine mjx."""

    def __init__(self, links: LinksRun, law: Law):
        self.links, self.step, rig = links, links.step, links.rig
        maps, whole, (mass, damping, stiffness) = links.maps, links.plant.whole, links.equations
        inertia, free = mass + self.step / 2 * damping, whole.free
        mobility = free @ np.linalg.solve(free.T @ inertia @ free, free.T)
        # Accelerometers read MuJoCo's accelerations before the implicit dampers of joints.
        implicit = np.zeros_like(mass) if links.plant.explicit or whole.bends_across else np.diag(whole.damping)
        before = np.linalg.solve(inertia - self.step * implicit, inertia)
        drive, rows = links.driving, maps.at_rows
        self.equations = _Equations(
            np.float64(self.step), -mobility @ stiffness, -mobility @ damping,
            mobility @ (drive.push + drive.lift @ maps.influence.T).T, mobility @ rows.T, rows,
            maps.at_sensors @ before, drive.on_base.T, maps.readings, links.clearance.numbers,
        )  # fmt: skip
        records = links.clearance.bushings
        self.clearances = tuple(
            _CompiledClearance(
                tuple(range(at[0], at[0] + record["coordinates"])),
                tuple(tuple(dict.fromkeys(at[1 + 2 * end : 3 + 2 * end].tolist())) for end in range(2)), filling,
                contact, _Record(*record.tolist()),
            ) for at, record, (_, filling, contact) in zip(maps.places, records, laws_of(rig, law))
        )  # fmt: skip
        self.kinds = shared_kinds(rig, law)
        self.columns = links.columns
        self.alone: MjxRuns | None = None

    def advance(self, excitation: np.ndarray) -> np.ndarray:
        """Simulate one block; see `SimulationRun.advance`."""
        self.alone = self.alone or MjxRuns([self])
        return self.alone.advance(excitation)[0]

    def batch_key(self) -> object | None:
        """Return step, sizes and laws; see `SimulationRun.batch_key`."""
        return self.step, self.kinds, self.clearances, tuple(part.shape for part in self.equations)

    def combine(self, runs: Sequence[SimulationRun]) -> MjxRuns:
        """Combine runs in one program; see `SimulationRun.combine`."""
        return MjxRuns(cast(Sequence[MjxRun], runs))

    def rest(self) -> _Motion:
        """Return the motion at rest."""
        zeros = np.zeros(len(self.equations.of_position))
        clearances = [
            (np.zeros(len(c.middle)), np.zeros(()), np.zeros(c.record.states), np.zeros((2, len(c.middle))))
            for c in self.clearances
        ]  # fmt: skip
        return _Motion(zeros, zeros, tuple(clearances))


class MjxRuns(SeveralRuns):
    """Runs from their start in one program, with equal `MjxRun.batch_key`."""

    def __init__(self, runs: Sequence[MjxRun]):
        import jax

        self.runs, self.steps = runs, 0
        first = runs[0]
        parts = list(zip(*(run.equations for run in runs)))
        shared = [all(np.array_equal(part[0], other) for other in part[1:]) for part in parts]
        self.axes = _Equations(*(None if alike else 0 for alike in shared))
        self.size = 2 ** int(np.log2(np.clip(ROOM // (len(runs) * first.columns), 1, LONGEST)))
        with jax.enable_x64(True):
            each = (part[0] if alike else np.stack(part) for part, alike in zip(parts, shared))
            self.equations = _Equations(*map(jax.numpy.asarray, each))
            self.motion = jax.tree.map(lambda part: np.broadcast_to(part, (len(runs), *part.shape)), first.rest())
            args = (_Equations(*(part[0] for part in parts)), first.rest(), np.zeros(first.equations.of_input.shape[1]))
            try:
                jax.eval_shape(functools.partial(_step, first.clearances), *args, 0.0)
            except (TypeError, NumbaError) as error:
                raise LawError(
                    f"rig {first.links.rig.name!r}: JAX cannot trace its laws ({', '.join(map(_kinds, first.kinds))}); "
                    "write them with the functions of clearance.lanes, or use links"
                ) from error

    def advance(self, excitation: np.ndarray) -> np.ndarray:
        """Simulate one block; see `SimulationRun.advance`. Excitations (n_runs, n, n_inputs) differ from run to run."""
        import jax

        if excitation.ndim < 3:
            excitation = np.broadcast_to(in_columns(excitation), (len(self.runs), *in_columns(excitation).shape))
        parts = []
        for start in range(0, excitation.shape[1], self.size):
            part = excitation[:, start : start + self.size]
            count = part.shape[1]
            padded = np.pad(part, ((0, 0), (0, self.size - count), (0, 0)))
            with jax.enable_x64(True):
                self.motion, out = _program()(
                    self.runs[0].clearances, self.axes, self.equations, self.motion, padded, self.steps, count
                )
            parts.append(np.asarray(out)[:count].swapaxes(0, 1))
            self.steps += count
        columns = np.concatenate(parts, axis=1) if parts else np.empty((len(self.runs), 0, self.runs[0].columns))
        for run, rows in zip(self.runs, columns):
            as_probes(run.links.rig, rows)
        return columns


def _kinds(kind: object) -> str:
    return ", ".join(each.__name__ for each in kind if isinstance(each, type)) if isinstance(kind, tuple) else ""


@functools.cache
def _program() -> Callable[..., Any]:
    """Return the loop over the steps, which is compiled for each pair of first arguments and sizes."""
    import jax

    def loop(
        clearances: tuple[_CompiledClearance, ...], axes: _Equations, equations: _Equations, motion: Any,
        excitation: Any, steps: Any, count: Any,
    ) -> Any:  # fmt: skip
        step = jax.vmap(functools.partial(_step, clearances), (axes, 0, 0, None), (0, 0))
        now = motion, excitation[:, 0], 0.0
        row = jax.eval_shape(step, equations, *now)[1]

        def advanced(i: Any, carried: Any) -> Any:
            motion, out = carried
            time = (steps + i) * equations.step.ravel()[0]
            motion, row = step(equations, motion, excitation[:, i], time)
            return motion, out.at[i].set(row)

        out = jax.numpy.zeros((excitation.shape[1], *row.shape))
        return jax.lax.fori_loop(0, count, advanced, (motion, out))

    return jax.jit(loop, static_argnums=(0, 1))


def _step(
    clearances: tuple[_CompiledClearance, ...], case: _Equations, motion: _Motion, excitation: Any, time: Any
) -> tuple[_Motion, Any]:  # fmt: skip
    """Return the motion after a step, and its columns of `SimulationRun.advance`."""
    from jax import numpy as jp

    q, v, _ = motion
    x, u = case.at_rows @ q, case.at_rows @ v
    force, divergence, columns, after = jp.zeros_like(x), jp.zeros(()), _Columns([], [], [], []), list[Any]()
    for clearance, before in zip(clearances, motion.clearances):
        pull, normals, now = _evaluate(clearance, case.numbers, x, u, before, time)
        force = force.at[jp.array(clearance.middle)].add(pull)
        for rows, normal in zip(clearance.ends, normals):
            force = force.at[jp.array(rows)].add(normal)
        after.append(now)
        touch = jp.any(now[3] != 0.0).astype(float)[None]
        for column, value in zip(columns, (now[0], normals.sum(axis=0), pull, touch)):
            column.append(value)
        limit = case.numbers[clearance.record.limit]
        divergence = larger(divergence, where_above(jp.inf, jp.abs(now[0]).sum() - limit))
    acceleration = case.of_position @ q + case.of_velocity @ v + case.of_input @ excitation - case.of_force @ force
    v_next = v + case.step * acceleration
    sensors = case.at_sensors @ acceleration + case.on_base @ excitation
    if case.readings.size:
        sensors = sensors + case.readings[:, 0] @ q + case.readings[:, 1] @ (v + v_next) / 2
    row = jp.concatenate([sensors + 0.0 * divergence, *itertools.chain(*columns)])  # 0 times infinity is nan
    return _Motion(q + case.step * v_next, v_next, tuple(after)), row


def _evaluate(
    clearance: _CompiledClearance, numbers: Any, x: Any, u: Any, before: Any, time: Any
) -> tuple[Any, Any, Any]:
    """Return the forces of filling (size,) and contacts (2, size), N, at displacements x, and the next state."""
    from jax import numpy as jp

    record, size = clearance.record, len(clearance.middle)
    previous, envelope, states, impacts = before
    at = jp.array(clearance.middle)
    place, offset = x[at], numbers[record.offset : record.offset + size]
    r, out, memory = place + offset, [0.0] * (size + size * size), list(states)
    clearance.filling(numbers[record.filling :], memory, tuple(r), tuple(place - previous), 0.0, record.step, out)
    elastic = jp.stack(out[:size]) - numbers[record.preload : record.preload + size]
    pull = elastic + jp.stack(out[size:]).reshape(size, size) @ u[at]
    envelope = larger(root(r @ r), envelope * numbers[record.decay])
    law = _contact_parameters(record, numbers, envelope, time)
    forces, speeds = [], []
    for rows, impact in zip(clearance.ends, impacts):
        depth, normal = _penetration(record, numbers, x[jp.array(rows)], offset)
        inwards = normal @ u[jp.array(rows)]
        impact_speed = where_above(root(impact @ impact), impact @ normal)
        impact_speed = where_above(choose(impact_speed, larger(inwards, SLOWEST_IMPACT), impact_speed), depth)
        answer = [0.0, 0.0]
        clearance.contact(law, depth, inwards, impact_speed, answer)
        push = 0.5 * answer[0] * depth + 0.5 * answer[1] * inwards  # each end has half of both
        forces.append(where_above(larger(push, 0.0), depth) * normal)
        speeds.append(impact_speed * normal)
    return pull, jp.stack(forces), (place, envelope, jp.array(memory), jp.stack(speeds))


def _contact_parameters(record: Any, numbers: Any, envelope: Any, time: Any) -> Any:
    """Return the contact's parameters at a time, s, or an amplitude, m; see `kernel.follow_law`."""
    from jax import numpy as jp

    if record.rows == 1:
        return numbers[record.contact : record.contact + record.width]
    abscissa = numbers[record.abscissa : record.abscissa + record.rows]
    table = numbers[record.table : record.table + record.rows * record.width].reshape(record.rows, record.width)
    period = numbers[record.period]
    now = envelope if record.by_amplitude else choose(time % larger(period, TINY), time, period)
    return jp.stack([jp.interp(now, abscissa, column) for column in table.T])


def _penetration(record: Any, numbers: Any, place: Any, offset: Any) -> tuple[Any, Any]:
    """Return the penetration of an end, m, and the wall's normal (size,)."""
    if record.coordinates == 1:
        depth = larger(place - numbers[record.wall + 1], 0.0) - larger(numbers[record.wall] - place, 0.0)
        return abs(depth[0]), signed(1.0, depth)
    r = place + offset
    e = larger(root(r @ r), TINY)
    return larger(e - numbers[record.wall], 0.0), r / e
