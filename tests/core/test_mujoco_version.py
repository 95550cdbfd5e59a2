"""The MuJoCo that is installed: none, too old, a wrong one, and what the distributions of the package require."""

import importlib.metadata
import importlib.util
import tomllib
import warnings
from pathlib import Path
from types import SimpleNamespace

import pytest

from clearance_mj.core import mujoco_version

from ..processes import run
from ..refusals import assert_refused

ROOT = Path(__file__).parents[2]


def installed(monkeypatch, **versions):
    """Let these distributions be installed, and no others."""

    def distribution(name):
        if name.replace("-", "_") not in versions:
            raise importlib.metadata.PackageNotFoundError(name)
        return SimpleNamespace(version=versions[name.replace("-", "_")], locate_file=lambda path: Path("there") / path)

    monkeypatch.setattr(importlib.metadata, "distribution", distribution)


@pytest.mark.parametrize("versions", [{"mujoco": "3.10.0"}, {"mujoco": "3.17.0"}, {"mujoco_core": "4.0.1"}, {}])
def test_a_mujoco_that_will_do(monkeypatch, versions):
    installed(monkeypatch, **versions)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        mujoco_version.check()


def test_none_and_one_that_is_too_old(monkeypatch):
    installed(monkeypatch, mujoco="3.9.0")
    old = '^clearance_mj needs MuJoCo 3.10 or newer, not 3.9.0: pip install "mujoco-core'
    assert_refused(ImportError, old, mujoco_version.check)
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    none = '^clearance_mj needs MuJoCo: pip install .*, or a "mujoco" from 3.10 on'
    assert_refused(ImportError, none, mujoco_version.check)


def test_a_version_that_is_known_to_be_wrong(monkeypatch):
    installed(monkeypatch, mujoco="4.0.0", mujoco_core="4.0.0")
    words = '^MuJoCo 4.0.0: its sparse Cholesky factorisation is wrong .*; pip install "mujoco-core'
    with pytest.warns(UserWarning, match=words):
        mujoco_version.check()
    installed(monkeypatch, mujoco="4.0.0", mujoco_core="4.0.1")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        mujoco_version.check()


def test_two_that_lie_one_over_the_other(monkeypatch):
    """The distributions mujoco 3 and mujoco-core have files of the same names."""
    installed(monkeypatch, mujoco="3.17.0", mujoco_core="4.0.1")
    with pytest.warns(UserWarning, match=r"^mujoco-core 4.0.1 and mujoco 3.17.0 are installed one over the other; pip"):
        mujoco_version.check()


def test_the_distribution_for_mujoco_users_has_what_laws_import():
    """Everything that a Softener loads is the standard library's, MuJoCo's or numba's own, or of the extra laws."""
    project = tomllib.loads((ROOT / "packaging" / "physical" / "pyproject.toml").read_text())["project"]
    names = [*project["dependencies"], *project["optional-dependencies"]["laws"]]
    allowed = {name.partition(">")[0].replace("-", "_") for name in names}
    program = """
import sys
import annotated_types, mujoco, numba, pydantic, scipy.linalg, scipy.optimize, scipy.signal, scipy.sparse
import scipy.interpolate
before = {name.partition(".")[0] for name in sys.modules}
from clearance_mj import physical
physical.Softener
print(*sorted({name.partition(".")[0] for name in sys.modules} - before - set(sys.stdlib_module_names)))
"""
    process = run("-c", program)
    assert process.returncode == 0, process.stderr
    assert {name for name in process.stdout.split() if not name.startswith("_")} - allowed == {"clearance_mj"}
    whole = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert set(names) <= set(whole["dependencies"])
    assert not any("mujoco" in name for name in (*names, *whole["dependencies"]))
