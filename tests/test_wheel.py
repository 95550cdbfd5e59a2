"""The package as a wheel installs it, without its source tree."""

import os
import zipfile

import pytest

from .conftest import ROOT
from .processes import run


@pytest.mark.slow
def test_wheel(tmp_path):
    """It holds every file of the package and nothing else; what it installs simulates the rig of a folder."""
    site, package = tmp_path / "site", ROOT / "clearance_mj"
    run("-m", "pip", "wheel", "--quiet", "--no-deps", "-w", tmp_path, ROOT, patience=600, check=True)
    (wheel,) = tmp_path.glob("clearance_mj-*.whl")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(site)
        names = {name for name in archive.namelist() if ".dist-info/" not in name}
    source = {path for path in package.rglob("*") if path.is_file() and "__pycache__" not in path.parts}
    assert names == {str(path.relative_to(ROOT)) for path in source}
    options = {"cwd": tmp_path, "env": os.environ | {"PYTHONPATH": str(site), "NUMBA_CACHE_DIR": str(tmp_path)}}
    done = run("-m", "clearance_mj", "new", "bench", "--out", "rig.toml", **options)
    assert done.returncode == 0, done.stderr
    done = run("-m", "clearance_mj", "place", "rig.toml", "--out", "page", **options)
    assert done.returncode == 0, done.stderr
    process = run("-c", "import clearance_mj; print(clearance_mj.__file__)", **options)
    assert process.stdout.strip() == str(site / "clearance_mj" / "__init__.py")
