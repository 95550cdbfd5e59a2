"""The package without its source tree, as a wheel installs it."""

import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

import clearance_mj
from experiments.testrig import RIGS

from ...conftest import ROOT, TABLE1

MAKE_RIGS = "from experiments.testrig import RIGS; print(*(make().rig.name for make in RIGS.values()))"


def run(site, folder, *arguments):
    """Run Python in a folder with the package of another one."""
    folder.mkdir()
    environment = {"PYTHONPATH": f"{site}", "PATH": "", "NUMBA_CACHE_DIR": str(folder)}
    command = [sys.executable, *arguments]
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_table1_is_the_rig_of_the_models():
    assert RIGS["table1"]().rig == TABLE1


def test_every_virtual_rig_is_made_from_the_package_alone(tmp_path):
    site = tmp_path / "site"
    ignore = shutil.ignore_patterns("__pycache__")
    shutil.copytree(Path(clearance_mj.__file__).parent, site / "clearance_mj", ignore=ignore)
    assert run(site, tmp_path / "empty", "-c", MAKE_RIGS).split() == list(RIGS)


@pytest.mark.slow
def test_wheel(tmp_path):
    """What is in it; and from an empty folder its test rig makes the dataset of table1, as the sources did."""
    build = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "-w", str(tmp_path), str(ROOT)]
    subprocess.run(build, check=True)
    (wheel,) = tmp_path.glob("clearance_mj-*.whl")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(tmp_path / "site")
        folders = {name.partition("/")[0] for name in archive.namelist()}
        assert "clearance_mj/py.typed" in archive.namelist()
    assert {f for f in folders if not f.endswith(".dist-info")} == {"clearance_mj"}
    run(tmp_path / "site", tmp_path / "empty", "-m", "experiments.testrig", "made")
    made, kept = tmp_path / "empty" / "made", ROOT / "data" / "table1_rig"
    assert {p.name for p in made.iterdir()} == {p.name for p in kept.iterdir()}
    for name in ("rig.toml", "dataset.toml"):
        assert (made / name).read_text() == (kept / name).read_text()
