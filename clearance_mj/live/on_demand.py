"""Long computations, made on demand: response branches, stepped sines, sweeps of a control."""

from __future__ import annotations

import functools
from collections.abc import Mapping

import numpy as np

from ..core.errors import ClearanceError, ExcitationError
from ..engines import get_engine
from ..engines.simulation import Simulation
from ..linear.refusals import refuse_across
from ..periodic.summaries import stable_points
from ..signals.stepped_sines import harmonic_amplitudes
from ..study.periodic import from_both_ends
from .control import Value
from .controls import build_model
from .excite import stepped
from .figures import Numbers, motion
from .session import Session, Watch

__all__ = ["branch", "steps", "sweep"]

HARMONICS = 9  # of response branches: what finds folds within 0.002 % on the Table-1 rig
MAX_CASES = 200  # of a sweep, and steps of a sine
CYCLES = 4  # of the lowest frequency that a step must hold; its second half is looked at
DIFFERENT = 0.05  # of the larger amplitude: from here on a sine upwards and one downwards show different vibrations


def branch(session: Session, values: Mapping[str, Value], low: float, high: float, watch: Watch) -> Numbers:
    """Follow the periodic vibration of a setting between two frequencies, at √2 times its level.

    Parameters
    ----------
    session : Session
        Whose rig and law.
    values : mapping
        As `Session.setting` returns.
    low, high : float
        From and to, Hz; if the branch ends early, it is followed from the other end too.
    watch : callable
        Receives the fraction that is done.

    Returns
    -------
    Numbers
        Arrays "frequency" (n,) Hz, "amplitude" (n_sensors, n) m/s² and "stable" (n,); nan between two parts.

    Raises
    ------
    ClearanceError
        As `periodic.follow_response`.
    """
    model = build_model(session.model, values)
    rig = model.rig
    refuse_across(rig, "the branch of periodic vibrations")
    kind, level = str(values.get("kind", rig.shaker.kind)), np.sqrt(2) * float(values["level"])
    heard = lambda f: watch(min(max((f - low) / (high - low), 0.0), 1.0) if high != low else 0.0)  # noqa: E731
    pieces = from_both_ends(model, level, (low, high), n_harmonics=HARMONICS, kind=kind, watch=heard)
    special = [{"kind": p.kind, "frequency": p.frequency} for part in pieces for p in part.special]
    facts = {"special": special, "ended": "; ".join(part.ended for part in pieces if part.ended), "level": float(level)}
    gap = np.full((1, len(rig.sensors) + 2), np.nan)
    rows = [np.column_stack((part.frequency, stable_points(part), part.amplitude())) for part in pieces]
    table = np.concatenate([row for part in rows for row in (part, gap)][:-1])
    return Numbers(facts, {"frequency": table[:, 0], "stable": table[:, 1], "amplitude": table[:, 2:].T})


def steps(
    session: Session, values: Mapping[str, Value], low: float, high: float, count: int, hold: float, watch: Watch
) -> Numbers:
    """Simulate a sine of √2 times the level that is stepped through frequencies, upwards and back: it shows jumps.

    Parameters
    ----------
    session, values, watch
        As in `branch`; the engine is the setting's.
    low, high : float
        Lowest and highest frequency, Hz.
    count : int
        Number of frequencies, 2 to 200.
    hold : float
        s at each of them.

    Returns
    -------
    Numbers
        Arrays "frequency" (count,) Hz, "up" and "down" (n_sensors, count): amplitudes of the acceleration's first nine
        harmonics in the second half of each step, m/s². Fact "differ": the frequencies between which they differ by
        more than 5 %, or None.

    Raises
    ------
    ClearanceError
        For impossible numbers, or a simulation that diverges.
    """
    if not (2 <= count <= MAX_CASES and 0 < low < high):
        raise ExcitationError(f"needs 2 to {MAX_CASES} rising frequencies, got {count} from {low:g} to {high:g} Hz")
    if hold * low < CYCLES:
        raise ExcitationError(f"steps of {hold:g} s hold fewer than {CYCLES} cycles of {low:g} Hz; hold them longer")
    model = build_model(session.model, values)
    rig, law = model.rig, model.law
    frequency = np.linspace(low, high, count)
    excitation = stepped(rig, values, [*frequency, *frequency[::-1]], hold)
    response = Simulation(rig, excitation, law, get_engine(str(values["engine"]))).whole(watch)
    each = response.channels.reshape(len(rig.sensors), 2 * count, -1)
    steady = each[:, :, each.shape[2] // 2 :]
    at = excitation.description["frequency"]
    amplitude = np.stack([harmonic_amplitudes(steady[:, i], excitation.fs, f) for i, f in enumerate(at)], axis=1)
    up, down = amplitude[:, :count], amplitude[:, : count - 1 : -1]
    apart = frequency[(np.abs(up - down) > DIFFERENT * np.maximum(up, down)).any(axis=0)]
    differ = [float(apart[0]), float(apart[-1])] if apart.size else None
    facts = {"differ": differ, "level": float(np.abs(excitation.value).max())}
    return Numbers(facts, {"frequency": frequency, "up": up, "down": down})


def sweep(
    session: Session, values: Mapping[str, Value], name: str, low: float, high: float, count: int, watch: Watch
) -> Numbers:
    """Simulate a setting with one control at several values.

    Parameters
    ----------
    session, values, watch
        As in `branch`.
    name : str
        Name of a control whose value is a number.
    low, high : float
        First and last value, SI units; between them as the slider goes.
    count : int
        Number of values, 2 to 200.

    Raises
    ------
    ClearanceError
        For an unknown name or impossible numbers. Values at which a simulation fails are nan.
    """
    control = session.controls.get(name)
    if control is None or control.choices:
        raise ClearanceError(f"{name!r} is no number that can be swept")
    if not 2 <= count <= MAX_CASES:
        raise ClearanceError(f"a sweep has 2 to {MAX_CASES} values, got {count}")
    log = control.log and low > 0 and high > 0
    at = np.geomspace(low, high, count) if log else np.linspace(low, high, count)
    contact_share = np.full((len(session.rig.bushings), count), np.nan)
    rms, failed = np.full((len(session.rig.sensors), count), np.nan), ""
    for i, value in enumerate(at):
        part: Watch = functools.partial(_part_of, watch, i, count)
        part(0.0)
        try:
            shown = session.simulated({**values, name: float(value)}, part)
        except ClearanceError as error:
            failed = str(error)
            continue
        contact_share[:, i] = [row["share"] for row in motion(shown.model.rig, shown.seen).facts["clearances"]]
        rms[:, i] = shown.response.channels.std(axis=1)
    return Numbers({"name": name, "failed": failed, "log": log}, {"at": at, "share": contact_share, "rms": rms})


def _part_of(watch: Watch, completed: int, count: int, fraction: float) -> None:
    watch((completed + fraction) / count)
