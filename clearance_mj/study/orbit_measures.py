"""Measures of agreement between orbits and between run-ups.

Source of the 1X motion: Bently & Hatch, Fundamentals of Rotating Machinery Diagnostics, 2002, chapters 4 to 8.
"""

from __future__ import annotations

import math

import numpy as np

from ..signals.orbits import Orbits

__all__ = ["compare_orbits", "compare_run_ups", "onset_of_contact"]

RPM = 30 / math.pi
TOUCHES = 0.98  # of the gap: from so far on the shaft counts as on the wall
PERSISTS = 5  # turns in succession that touch, after as many that do not


def compare_orbits(test: Orbits, model: Orbits) -> dict[str, float]:
    """Return how far a model's orbit at one speed is from the test's.

    Orbits are compared at equal angles of the shaft, as means over their turns. ``error`` is the RMS of their
    difference about their middles over the RMS radius of the test's orbit; ``middle_m`` is the distance of the
    middles.

    Parameters
    ----------
    test, model : Orbits
        Of one bushing, with as many points a turn.
    """
    filtered = test.filtered(), model.filtered()
    turns = [np.mean(o.position[:, 0] + 1j * o.position[:, 1], axis=0) for o in (test, model)]
    about = [w - w.mean() for w in turns]
    size = _rms(about[0])
    errors = {"error": _rms(about[1] - about[0]) / size if size else math.nan}
    errors["middle_m"] = abs(filtered[1].centre - filtered[0].centre)
    for side, orbits, once in zip(("test", "model"), (test, model), filtered):
        whole = orbits.position[:, 0] + 1j * orbits.position[:, 1]
        errors |= {
            f"radius_{side}_m": _rms(whole - whole.mean()),
            f"forward_{side}_m": abs(once.forward), f"forward_phase_{side}_deg": math.degrees(np.angle(once.forward)),
            f"backward_{side}_m": abs(once.backward),
        }  # fmt: skip
    return errors


def compare_run_ups(test: Orbits, model: Orbits) -> dict[str, float]:
    """Return how far a model's 1X motion over speed is from the test's.

    ``forward_error`` and ``backward_error`` are RMS differences over the speeds of the test's turns, amplitude and
    phase together, over the RMS amplitude of the test's forward motion; ``peak_*_rpm`` is where the forward amplitude
    is largest.

    Parameters
    ----------
    test, model : Orbits
        Of one bushing in a run-up.
    """
    speed = np.abs(test.speed)
    order = np.argsort(np.abs(model.speed), kind="stable")
    of_model = np.abs(model.speed)[order]
    shared = (speed >= of_model[0]) & (speed <= of_model[-1])
    size = _rms(test.harmonic()[0][shared]) if shared.any() else 0.0
    errors = {}
    for name, of_test, other in zip(("forward", "backward"), test.harmonic(), model.harmonic()):
        between = np.interp(speed[shared], of_model, other[order])
        errors[f"{name}_error"] = _rms(between - of_test[shared]) / size if size else math.nan
    for side, orbits in (("test", test), ("model", model)):
        forward = np.abs(orbits.harmonic()[0])
        errors[f"peak_{side}_m"] = float(forward.max())
        errors[f"peak_{side}_rpm"] = RPM * abs(float(orbits.speed[np.argmax(forward)]))
    return errors


def onset_of_contact(orbits: Orbits, rest: np.ndarray, gap: float) -> float:
    """Return the spin, rev/min, at which a shaft begins to touch its bushing in a run-up; nan if it never does.

    It begins where `PERSISTS` turns that come near the wall, within 2 % of the gap, follow as many that do not.

    Parameters
    ----------
    orbits : Orbits
        From where the shaft rests, m.
    rest : ndarray, shape (2,)
        Where it rests, from the bushing's middle, m.
    gap : float
        Radial gap, m.
    """
    reach = np.hypot(*(orbits.position + rest[:, None]).transpose(1, 0, 2)).max(axis=1)
    touching = reach >= TOUCHES * gap
    for k in range(PERSISTS, touching.size - PERSISTS + 1):
        if touching[k : k + PERSISTS].all() and not touching[k - PERSISTS : k].any():
            return RPM * abs(float(orbits.speed[k]))
    return math.nan


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.abs(values) ** 2))) if values.size else 0.0
