"""Machine code that is kept on disk: an edit of anything that went into it is seen, and nothing else compiles again."""

import json
import os
import shutil
from pathlib import Path

import clearance_mj

from ..processes import run

PACKAGE = Path(clearance_mj.__file__).parent

PART = """
from typing import NamedTuple
from numba import types
from numba.extending import intrinsic, overload, register_jitable
from clearance_mj.core.jit import jit
FACTOR, TABLE = 2.0, (1.0, 5.0)
class Pair(NamedTuple):
    a: float
    b: float
@jit
def called(x):
    '''Docstring.'''
    return 3.0 * x
@jit(inline="always")
def inlined(x):
    return 4.0 * x  # comment
@register_jitable
def helper(x):
    return 6.0 * x
def overloaded(x):
    return x
@overload(overloaded)
def _overloaded(x):
    return lambda x: 7.0 * x
@intrinsic
def built(typing, x):
    def generate(context, builder, signature, values):
        return builder.fmul(values[0], context.get_constant(types.float64, 8.0))
    return types.float64(types.float64), generate
def made(size):
    @jit
    def closed(x):
        return size * x
    return closed
OPTIONS = {"error_model": "python"}
"""
LOOP = """
import json, sys
import part
from numba.core import event
from part import FACTOR, OPTIONS, TABLE, Pair, built, called, helper, inlined, made, overloaded
from clearance_mj.core.jit import jit
compiled = []
@jit
def unrelated(x):
    return 10.0 * x
class Listener(event.Listener):
    def on_start(self, happened):
        compiled.append(happened.data["dispatcher"].py_func.__name__)
    def on_end(self, happened):
        pass
event.register("numba:compile", Listener())
within = made(9.0)
@jit
def of_constant(x):
    return FACTOR * x
@jit
def of_table(x):
    return TABLE[1] * x
@jit
def of_called(x):
    return called(x)
@jit
def of_inlined(x):
    return inlined(x)
@jit
def of_helper(x):
    return helper(x)
@jit
def of_overloaded(x):
    return overloaded(x)
@jit
def of_intrinsic(x):
    return built(x)
@jit
def of_closure(x):
    return within(x)
@jit
def of_module(x):
    return part.called(x) + 1.0
@jit
def of_pair(pair):
    return pair.a
@jit(**OPTIONS)
def of_options(x):
    return x / 0.0
def value(function, x):
    try:
        return function(x)
    except ZeroDivisionError:
        return "ZeroDivisionError"
functions = [each for name, each in sorted(globals().items()) if name.startswith("of_")]
found = {each.__name__: value(each, Pair(a=1.0, b=2.0) if each is of_pair else 1.0) for each in functions}
print(json.dumps({"values": found, "compiled": compiled}))
"""
EDITS = {
    "FACTOR, TABLE = 2.0, (1.0, 5.0)": "FACTOR, TABLE = 2.5, (1.0, 5.5)", "3.0 * x": "3.5 * x", "4.0 * x": "4.5 * x",
    "6.0 * x": "6.5 * x", "7.0 * x": "7.5 * x", "float64, 8.0": "float64, 8.5",
    "return size * x": "return (size + 0.5) * x", "    a: float\n    b: float": "    b: float\n    a: float",
    '"python"': '"numpy"',
}  # fmt: skip
BEFORE = {
    "of_called": 3.0, "of_closure": 9.0, "of_constant": 2.0, "of_helper": 6.0, "of_inlined": 4.0, "of_intrinsic": 8.0,
    "of_module": 4.0, "of_options": "ZeroDivisionError", "of_overloaded": 7.0, "of_pair": 1.0, "of_table": 5.0,
}  # fmt: skip
AFTER = {
    "of_called": 3.5, "of_closure": 9.5, "of_constant": 2.5, "of_helper": 6.5, "of_inlined": 4.5, "of_intrinsic": 8.5,
    "of_module": 4.5, "of_options": float("inf"), "of_overloaded": 7.5, "of_pair": 1.0, "of_table": 5.5,
}  # fmt: skip


def test_an_edit_of_whatever_goes_into_machine_code_is_seen(tmp_path):
    def seen(part, loop=LOOP):
        (tmp_path / "part.py").write_text(part)
        (tmp_path / "loop.py").write_text(loop)
        return computed(tmp_path, "-m", "loop")

    assert seen(PART)["values"] == BEFORE
    edited = PART
    for old, new in EDITS.items():
        assert edited.count(old) == 1
        edited = edited.replace(old, new)
    assert seen(edited)["values"] == AFTER
    # Lines move, comments, docstrings and functions that nothing calls change; the former version is still there.
    other = "\n\n" + edited.replace("# comment", "# changed").replace("Docstring.", "Changed.")
    assert seen(other, LOOP.replace("10.0 * x", "-x")) == {"values": AFTER, "compiled": []}
    assert seen(PART) == {"values": BEFORE, "compiled": []}


# An edit of a file of the package, and functions of other files into whose machine code it goes
PAIRS = {
    ("engines/modal_loop.py", "SWEEPS = 2", "SWEEPS = 3"): ["engines.links_loop.advance_links",
                                                            "engines.modal_loop.advance_whole"],
    ("engines/energies.py", "= joined(kinetic, ONE), 0.25", "= joined(kinetic, ONE), 0.5"): [
        "engines.modal_loop.advance"
    ],
    ("clearance/vectors.py", "size = root(r[0] * r[0] + r[1] * r[1])", "size = r[0]"): [
        "clearance.greases.maxwell_slip:MaxwellSlip.law"
    ],
    ("clearance/kernel.py", "depth = larger(load(numbers", "depth = smaller(load(numbers"): [
        "clearance.along._fill_forces",
        "engines.interact.find_contacts",
    ],
    ("periodic/loops.py", "SLOW = 0.1", "SLOW = 0.2"): ["periodic.solver:Solver.loops.onwards"],
    ("clearance/greases/bouc_wen.py", "half = plus(z, times(0.5", "half = plus(z, times(0.4"): [
        "identify.laws.grease._bouc_wen",
        "experiments.joints.hysteresis.loop_force",
    ],
    ("clearance/walls/slot.py", "max(x - d, 0.0)", "max(x - d, 1.0)"): ["experiments.joints.hysteresis.loop_force"],
    ("clearance/lanes.py", "larger(b * log2, -1020.0)", "larger(b * log2, -1000.0)"): ["engines.modal_loop.advance"],
    ("clearance/pointers.py", "builder.gep(view.data, [values[1]])", "view.data"): ["periodic.forces._add_element"],
    ("periodic/harmonic_balance.py", "+= re * c + im * s", "-= re * c + im * s"): ["periodic.balance.residual"],
    ("vehicle/lost_motion.py", "torque = p.damping", "torque = -p.damping"): ["vehicle.steering._lost_motion",
                                                                          "vehicle.twin.simulate"],
    ("vehicle/magic_formula.py", "z = B * slip", "z = -B * slip"): ["vehicle.commonroad.multi_body"],
    ("physical/library.py", "n, np.float64", "n + 1, np.float64"): ["physical.softener_loop._apply_law"],
}  # fmt: skip

NUMBERS = """
import importlib, json, operator, sys
import numpy as np
from clearance_mj.core.jit import digest
from clearance_mj.identify.laws.grease import _bouc_wen
from experiments.joints.hysteresis import loop_force
from clearance_mj.vehicle.lost_motion import LostMotion
from clearance_mj.vehicle.steering import _lost_motion
def digest_of(name):
    module, _, function = name.rpartition(".") if ":" not in name else name.partition(":")
    module = module if module.startswith("experiments.") else "clearance_mj." + module
    return digest(operator.attrgetter(function)(importlib.import_module(module)))
x = np.linspace(0.0, 1e-4, 9)
play = LostMotion(half_gap=1e-3, stiffness=1e4, damping=5.0)
print(json.dumps({
    "digests": {name: digest_of(name) for name in sys.argv[1:]},
    "values": [
        _bouc_wen(x, 1.0, 5e3, 5e3, 1.0, 1e-6)[-1],
        loop_force(x, 1e5, 0.1, 2e-5, 0.5, 1.0, 1e-5, 0.0, False)[-1],
        _lost_motion(np.zeros(3), np.full(3, 1e-4), np.full(3, 2.0), play)[0][-1],
    ],
}))
"""


def test_an_edit_of_a_file_reaches_the_machine_code_of_others(tmp_path):
    shutil.copytree(PACKAGE, tmp_path / "clearance_mj", ignore=shutil.ignore_patterns("__pycache__"))
    (tmp_path / "numbers_of.py").write_text(NUMBERS)
    names = sorted({name for pair in PAIRS.values() for name in pair})
    before = computed(tmp_path, "-m", "numbers_of", *names)
    for file, old, new in PAIRS:
        path = tmp_path / "clearance_mj" / file
        text = path.read_text()
        assert old in text, file
        path.write_text(text.replace(old, new))
    after = computed(tmp_path, "-m", "numbers_of", *names)
    assert [name for name in names if before["digests"][name] == after["digests"][name]] == []
    assert all(now != then for then, now in zip(before["values"], after["values"], strict=True))


def computed(folder, *arguments):
    """What Python prints as JSON in a folder, with the package that stands there, if one does."""
    places = os.pathsep.join(map(str, (folder, PACKAGE.parent)))
    done = run(*arguments, cwd=folder, env=os.environ | {"PYTHONPATH": places, "NUMBA_CACHE_DIR": str(folder / "kept")})
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)
