"""A contact and a grease of one's own, in a file outside of the package: on every engine and in every use."""

import json
import sys

import numpy as np
import pytest

import clearance_mj as cm
from clearance_mj.cli import main

from ..conftest import ROOT

OWN = '''import math
from typing import ClassVar
from clearance_mj.clearance import contact, grease
from clearance_mj.clearance.vectors import along, answer, minus, plus, read, times, write
from clearance_mj.core.validation import NotNegative, Positive
@contact.register
class Sinh(contact.ContactModel):
    """K d sinh(δ/d) + c δ̇."""
    name: ClassVar[str] = "sinh"
    stiffness: Positive
    depth: Positive
    damping: NotNegative = 0.0
    @staticmethod
    def law(p, depth, speed, impact_speed, out):
        x = depth / p[1]
        out[0] = p[0] * (math.sinh(x) / x if x > 1e-6 else 1.0)
        out[1] = p[2]
    @staticmethod
    def energy(p, depth):
        return p[0] * p[1] ** 2 * (math.cosh(depth / p[1]) - 1.0)
    def largest(self, gap):
        return self.stiffness * math.cosh(gap / self.depth), self.damping
@grease.register
class Maxwell(grease.GreaseModel):
    """k x + k1 z with z' = x' - z/tau."""
    name: ClassVar[str] = "maxwell"
    k: NotNegative
    k1: Positive
    tau: Positive
    def parameters(self):
        return self.k, self.k1, self.tau
    def small_motion(self):
        return self.k + self.k1, 0.0
    @staticmethod
    def law(p, state, r, dr, spin, step, out):
        decay = math.exp(-step / p[2])
        z = plus(times(decay, read(state, 0, r)), times(p[2] / step * (1.0 - decay), dr))  # exact at constant speed
        write(state, 0, z)
        answer(out, plus(times(p[0], r), times(p[1], z)), 0.0)
    @staticmethod
    def energy(p, before, state, r, dr, out):
        then, z = read(before, 0, r), read(state, 0, r)
        out[0] = 0.5 * p[0] * along(r, r) + 0.5 * p[1] * along(z, z)
        out[1] = p[1] * 0.5 * along(plus(then, z), minus(dr, minus(z, then)))
'''


@pytest.fixture
def plugin(tmp_path, monkeypatch):
    (tmp_path / "own_models.py").write_text(OWN, encoding="utf-8")
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.delitem(sys.modules, "own_models", raising=False)
    import own_models

    yield own_models
    cm.clearance.contact.CONTACTS.pop("sinh"), cm.clearance.grease.GREASES.pop("maxwell")


def test_models_of_ones_own(rig, plugin, tmp_path, capsys):
    """Beside a model of the package in the other bushing; the energies balance as those of the package's models do."""
    law = cm.ContactLaw(
        (plugin.Sinh(2e4, 3e-4, 4.0), cm.clearance.Cubic(1e4, 1e10, 2.0)), plugin.Maxwell(3000, 1500, 3e-3)
    )
    law.save(tmp_path / "law.json")
    assert cm.load_law(tmp_path / "law.json") == law
    noise, spread = cm.excitation.random(0.5, 2048.0, rms=6.0, seed=0), []
    for engine in ("modal", "links"):
        balance = cm.energy_balance(rig, noise, law, engine)
        response = balance.response
        assert balance.imbalance < 1e-3 and min(balance.summary()["impacts"]) > 5 and balance.hysteresis[:, -1].all()
        spread.append(response.acceleration.std(axis=-1))
    np.testing.assert_allclose(spread, [spread[0]] * 2, rtol=0.1)
    given = ["--plugin", str(tmp_path / "own_models.py"), "--law", str(tmp_path / "law.json"), "--json"]
    short = ["--engine", "modal", "--duration", "0.2", "--quiet", "--out", str(tmp_path / "r.nc")]
    assert main(["simulate", str(ROOT / "models" / "table1_rig.toml"), *given, *short]) == 0
    assert json.loads(capsys.readouterr().out)["acceleration_rms"]


def test_refusals_name_the_place(plugin):
    with pytest.raises(cm.LawError, match=r"contact\.depth must be > 0, got -1"):
        plugin.Sinh(1e4, -1.0)
    data = cm.ContactLaw(plugin.Sinh(1e4, 1e-4)).to_dict()
    data["contact"][0]["stifness"] = 1.0
    with pytest.raises(cm.LawError, match=r"contact\[0\].stifness is not a known key; .* did you mean stiffness"):
        cm.clearance.law_files.law_from_dict(data)
