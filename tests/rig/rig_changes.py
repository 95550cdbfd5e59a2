"""The rig file of the article with single values changed."""

import copy
import re
import tomllib
from pathlib import Path

from clearance_mj.core.errors import RigError
from clearance_mj.rig import Rig

from ..refusals import assert_refused

FILE = Path(__file__).parents[2] / "models" / "table1_rig.toml"


TABLES = tomllib.loads(FILE.read_text(encoding="utf-8"))


MISSING = object()


def changed(path, value):
    """Return the tables of the rig file with the value at a path such as bushings[0].gap changed, or taken out."""
    tables = copy.deepcopy(TABLES)
    if path.startswith("shaker.also["):
        tables["shaker"] = {"kind": "force", "position": 0.5, "also": [{"position": 1.0}]}
    *above, last = (int(step) if step.isdigit() else step for step in re.findall(r"\w+", path))
    place = tables
    for step in above:
        place = place[step]
    if value is MISSING:
        del place[last]
    else:
        place[last] = value
    return tables


def refused(path, value):
    """Return the message, one line, of a rig with another value at a path."""
    return assert_refused(RigError, None, Rig.from_dict, changed(path, value))


NUMBER = "must be a plain number in SI units, got"


STEEL = {"young_modulus": 210e9, "density": 7850.0}


SECTIONS = [{"length": 0.6, "diameter": 0.01}, {"length": 0.4, "diameter": 0.02}]
SHAFT = {"kind": "shaft", "material": STEEL, "sections": SECTIONS}
