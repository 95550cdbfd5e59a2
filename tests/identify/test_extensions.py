"""The contact and the grease of docs/extending.md, each in one file, are identified and preferred by evidence.

Forces are computed here, by formulae of their own.
"""

import math
import sys

import numpy as np
import pytest

from clearance_mj.clearance import family
from clearance_mj.identify.laws.comparison import fit_families
from clearance_mj.identify.laws.measured_motion import MeasuredMotion

from ..test_docs import blocks
from .test_families import FINE, FS, GAPS, NOMINAL, recorded, shaken, wall_force

STIFFNESS, DEPTH, DAMPING = 6e3, 2e-4, 4.0  # N/m, m, N s/m, of the contact
K, K1, TAU = 3500.0, 2500.0, 3e-3  # N/m, N/m, s, of the grease


@pytest.fixture
def extensions(tmp_path, monkeypatch):
    """Import the two files of the page; what they register goes with the test."""
    for families in (family.CONTACT_FAMILIES, family.FILLING_FAMILIES):
        for name in ("hyperbolic", "Maxwell element"):
            monkeypatch.setitem(families, name, None)
            monkeypatch.delitem(families, name)
    monkeypatch.syspath_prepend(tmp_path)
    files = {text.partition("\n")[0]: text for language, text in blocks("extending.md") if language == "python"}
    for name in ("sinh_contact", "maxwell_grease"):
        (tmp_path / f"{name}.py").write_text(files[f"# {name}.py"])
        monkeypatch.delitem(sys.modules, name, raising=False)
        __import__(name)
    yield
    for name in ("sinh_contact", "maxwell_grease"):
        del sys.modules[name]


def relaxing(x, v):
    """k x + k1 z with ż = ẋ - z/τ, z by the trapezoidal rule."""
    step = 1 / (FS * FINE)
    z = np.zeros(x.shape[1])
    for i in range(1, z.size):
        push = 0.5 * step * (v[0, i] + v[0, i - 1])
        z[i] = (z[i - 1] * (1 - 0.5 * step / TAU) + push) / (1 + 0.5 * step / TAU)
    return K * x[0] + K1 * z


@pytest.mark.slow
def test_extensions_are_identified_and_preferred(rig, extensions):
    x, v = shaken(1e-3, 1, 5.0)
    force = wall_force(x, v, lambda depth, speed: STIFFNESS * DEPTH * np.sinh(depth / DEPTH) + DAMPING * speed)
    motion = MeasuredMotion([recorded(x, v, relaxing(x, v) + force, 2e-3)], rig.replace(bushings=(NOMINAL,)), 0, GAPS)
    best, *others = fit_families(motion)
    assert (best.contact, best.grease) == ("hyperbolic", "Maxwell element")
    assert best.weight > 0.9
    assert {other.contact for other in others} == {*family.CONTACT_FAMILIES}
    values = dict(zip(best.fit.estimates.names, best.fit.estimates.value))
    assert values["contact stiffness"] == pytest.approx(STIFFNESS, rel=0.05)
    assert values["contact depth"] == pytest.approx(DEPTH, rel=0.05)
    assert values["grease stiffness"] == pytest.approx(K, rel=0.02)
    assert values["grease relaxation time"] == pytest.approx(TAU, rel=0.05)
    assert math.isclose(sum(f.weight for f in (best, *others)), 1.0)
