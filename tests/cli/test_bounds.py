"""Arguments beyond what can be computed are refused with the bound, before anything is; odd rigs say what is odd."""

import dataclasses
import resource

import pytest

from clearance_mj import ClearanceError, Rig, RigError, simulate
from clearance_mj.beam import natural_frequencies
from clearance_mj.clearance import nominal_law
from clearance_mj.core.memory import require_memory
from clearance_mj.engines.base import step_factor
from clearance_mj.placement import candidates, grid
from clearance_mj.rig.extremes import extremes
from clearance_mj.signals.excitation import random

from ..conftest import ROOT
from ..structures import chain, two_shafts
from .conftest import RIG


@pytest.mark.parametrize("line, words", [
    ("simulate {} --engine modal --duration 1e300", "duration 1e+300: must be less than 2147483648 samples"),
    ("simulate {} --engine modal --duration 1e12", "must be less than 2147483648 samples"),
    ("simulate {} --engine modal --fs 1e15", "must be less than 2147483648 samples"),
    ("simulate {} --engine modal --seed -1", "seed -1: must be a whole number >= 0"),
    ("place {} --candidates 1000000", "at most 1000 candidates are compared"),
    ("place {} --candidates 10000", "at most 1000 candidates are compared"),
    ("place {} --modes 99999999999", "modes must be 1 to 60, got 99999999999"),
    ("response {} --level 1 --harmonics 99999999", "at most 500 harmonics"),
    ("response {} --level 1 --workers -1", "workers must be 1 to 1024, got -1"),
    ("response {} --level 1 --from 5e-324 --to 9 --harmonics 1 --modes 2", "Hz is too slow beside the stiffest"),
    ("response {} --level 1 --from 8 --to 5e-324 --harmonics 1 --modes 2", "Hz is too slow beside the stiffest"),
    ("response {} --level 1 --from 1e-6 --to 9 --harmonics 1 --modes 2", "give frequencies from 0.0"),
    ("response {} --level 1 --to 1e308", "two different frequencies > 0 Hz and at most 1e+06 Hz, got 5 and 1e+308"),
    ("backbone {} --workers 0", "workers must be 1 to 1024, got 0"),
    ("motion {} --engine modal --duration 0.1 --workers -1", "workers must be 1 to 1024, got -1"),
    ("animate {} --engine modal --duration 0.1 --seconds 0", "seconds 0: must be above 0"),
    ("study " + str(ROOT / "data" / "table1_rig") + " --methods=", 'method "" is unknown'),
])  # fmt: skip
def test_arguments(line, words, refused, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert words in refused(*line.format(RIG).split(), "--quiet") and not [*tmp_path.iterdir()]


def test_memory_is_looked_at_before_it_is_taken():
    with pytest.raises(ClearanceError, match=r"10 rigs need 1e\+03 GiB of memory, .* GiB are left; take less"):
        require_memory(1000 * 2**30, "10 rigs", "take less")
    require_memory(2**20, "one rig", "")


def test_memory_within_the_limit_of_the_process():
    before = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (8 * 2**30, before[1]))
    try:
        with pytest.raises(ClearanceError, match=r"40000 s at 8192 Hz need 14\.6 GiB of memory"):
            random(40_000.0, 8192.0)
    finally:
        resource.setrlimit(resource.RLIMIT_AS, before)


def test_a_rig_that_cannot_be_computed_says_what_is_odd(rig):
    odd = rig.replace(beam=dataclasses.replace(rig.beam, density=1e-300))
    with pytest.raises(RigError, match=r"; look at beam\.density = 1e-300 \(ordinary: 10 to 100000\)"):
        natural_frequencies(odd, 5)
    assert extremes(rig.to_dict()) == ""
    data = two_shafts().to_dict()
    data["structure"]["parts"][1]["material"]["young_modulus"] = 1e-300
    with pytest.raises(RigError, match=r"look at structure\.parts\[1\]\.material\.young_modulus = 1e-300"):
        natural_frequencies(Rig.from_dict(data), 5)


@pytest.mark.parametrize("engine", ["links", "modal"])
def test_what_arithmetic_ends_with_is_said_of_the_rig(rig, engine):
    """A length at which all points are one, and a damping matrix that cannot be inverted, ended with tracebacks."""
    push = random(0.05, 1024.0)
    if engine == "links":
        odd, words = (rig.replace(beam=dataclasses.replace(rig.beam, length=1.7e308)),
                      r"look at beam\.length = 1\.7e\+308")  # fmt: skip
    else:
        damping = [[1.0, 0.0, 1e150], [0.0, 0.2, 0.0], [0.0, 0.0, 0.8]]
        odd = Rig.from_dict(chain().to_dict() | {"structure": chain().to_dict()["structure"] | {"damping": damping}})
        words = r"look at .*structure\.damping\[0\]\[2\] = 1e\+150"
    with pytest.raises(RigError, match=words):
        simulate(odd, push, nominal_law(odd), engine)


def test_a_shaft_that_tapers_to_nothing():
    """From 1e12 m to 8 mm: hundreds of elements, of dense matrices."""
    data = two_shafts().to_dict()
    data["structure"]["parts"][0]["sections"] = [{"length": 0.9, "diameter": [1e12, 0.008]}]
    with pytest.raises(RigError, match=r"would be divided more than 100 times.*diameter\[0\] = 1e\+12"):
        natural_frequencies(Rig.from_dict(data), 2)


@pytest.mark.slow
def test_a_shaft_whose_modes_lanczos_does_not_find():
    """ARPACK ended with an error of its own."""
    data = two_shafts().to_dict()
    data["structure"]["parts"][1]["sections"] = [
        {"length": 0.7, "diameter": [0.03, 1e12], "inner_diameter": [0.024, 0.024]}
    ]
    data["structure"]["parts"][0]["material"]["poisson_ratio"] = 0.03
    odd = Rig.from_dict(data)
    with pytest.raises(RigError, match=r"no modes are found.*sections\[0\]\.diameter\[1\] = 1e\+12"):
        candidates(odd, grid(odd, 8).tolist(), [1, 2], 1.0, 1.0, [])


def test_steps_that_cannot_be_counted():
    assert step_factor(1024.0, 0.0) == step_factor(1024.0, 1e-320) == 2**53
    assert step_factor(1000.0, 1e-4) == 10
