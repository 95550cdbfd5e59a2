"""Plans for the tests of sweeps."""

from clearance_mj.core.files import is_sealed
from clearance_mj.sweep import load_plan

from ..conftest import ROOT

RIG = ROOT / "models" / "table1_rig.toml"
EXCITATION = '[excitation]\ngenerator = "random"\nduration = 1\nfs = 1024\nrms = 2\n'
GAP = '[[vary]]\npath = "rig.bushings.gap"\nlow = 2e-4\nhigh = 5e-4\n'
LEVEL = '[[vary]]\npath = "excitation.rms"\nlow = 0.5\nhigh = 5\nscale = "log"\n'
DESIGN = '[design]\nmethod = "latin-hypercube"\nsamples = {samples}\nseed = 1\n'
OUTPUTS = "[outputs]\nresolution = 2\nfrf = [7]\n"


def varied(path, values):
    """A table of a plan: a number that takes each of some values."""
    return f'[[vary]]\npath = "{path}"\nvalues = {values}\n'


def text(*tables, head="", rig=RIG):
    """A plan's file."""
    return f'rig = "{rig}"\n{head}\n' + "\n".join(tables)


def small(samples):
    """A plan of cheap cases."""
    tables = EXCITATION, DESIGN.format(samples=samples), OUTPUTS, GAP, LEVEL
    return text(*tables, head='engine = { name = "modal", modes = 4 }')


def loaded(tmp_path, content):
    """The plan of a file with this content."""
    path = tmp_path / "plan.toml"
    path.write_text(content, encoding="utf-8")
    return load_plan(path)


def finished(out) -> int:
    """How many files of finished cases wait in a sweep's folder."""
    return sum(map(is_sealed, (out / "cases").glob("*.npz")))
