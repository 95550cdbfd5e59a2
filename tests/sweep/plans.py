"""Plans for the tests of sweeps."""

from clearance_mj.core.files import is_sealed
from clearance_mj.sweep import load_plan

from ..conftest import ROOT

RIG = ROOT / "models" / "table1_rig.toml"
EXCITATION = """
[excitation]
generator = "random"
duration = 1
fs = 1024
rms = 2
"""
GAP = """
[[vary]]
path = "rig.bushings.gap"
low = 2e-4
high = 5e-4
"""
LEVEL = """
[[vary]]
path = "excitation.rms"
low = 0.5
high = 5
scale = "log"
"""
DESIGN = """
[design]
method = "latin-hypercube"
samples = {samples}
seed = 1
"""
OUTPUTS = """
[outputs]
resolution = 2
frf = [7]
"""


def text(*tables, head="", rig=RIG):
    """A plan's file."""
    return f'rig = "{rig}"\n{head}\n' + "\n".join(tables)


def small(samples):
    """A plan of cheap cases."""
    return text(
        EXCITATION, DESIGN.format(samples=samples), OUTPUTS, GAP, LEVEL, head='engine = { name = "modal", modes = 4 }'
    )


def loaded(tmp_path, content):
    """The plan of a file with this content."""
    path = tmp_path / "plan.toml"
    path.write_text(content, encoding="utf-8")
    return load_plan(path)


def finished(out) -> int:
    """How many files of finished cases wait in a sweep's folder."""
    return sum(map(is_sealed, (out / "cases").glob("*.npz")))
