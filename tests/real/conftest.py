"""Published records, which are not part of the project, and the experiments that read them."""

import importlib.util
import sys
from pathlib import Path

import pytest

from clearance_mj.io.real import real_folder

EXPERIMENTS = Path(__file__).parents[2] / "experiments"


@pytest.fixture(scope="session")
def real_data() -> Path:
    """The folder of the records, or skip."""
    folder = real_folder()
    if folder is None:
        pytest.skip("published records are missing: name their folder in CLEARANCE_REAL_DATA (README tells the source)")
    return folder


@pytest.fixture(scope="session")
def experiment():
    """Load an experiment by its name, with its folder in the path as where it runs alone."""
    sys.path.insert(0, str(EXPERIMENTS))

    def load(name):
        path = EXPERIMENTS / f"{name}.py"
        if not path.is_file():
            pytest.skip(f"{path} is missing: the experiments are not part of the installed package")
        spec = importlib.util.spec_from_file_location(name, path)
        module = importlib.util.module_from_spec(spec)
        sys.modules[name] = module  # dataclasses look themselves up there
        spec.loader.exec_module(module)
        return module

    yield load
    sys.path.remove(str(EXPERIMENTS))
