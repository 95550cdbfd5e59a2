"""A controller of one's own: one file that is no part of the package, as docs/extending.md shows it."""

import json
import os
import sys
import textwrap

import numpy as np
import pytest

from clearance_mj.core.errors import ManoeuvreError
from clearance_mj.report.vehicle import CYCLE, histories, look, write_report
from clearance_mj.vehicle import tune as tuning
from clearance_mj.vehicle.controllers import CONTROLLERS, Controller, Registration, get_controller, register
from clearance_mj.vehicle.experiment import Case, run_case

from ..conftest import ROOT
from ..processes import run

PAGE = (ROOT / "docs" / "extending.md").read_text(encoding="utf-8")
PLUGIN = PAGE.partition("# proportional.py\n")[2].partition("```")[0]
COMPENSATED = """
from clearance_mj.vehicle.controllers import with_clearance_model

register(Registration("proportional-cm", "Proportional-CM", Proportional, adapt=with_clearance_model, prior="half-gap"))
"""


@pytest.fixture(scope="module")
def plugin(tmp_path_factory):
    """The file, imported from a folder that is on the path, as ``--plugin`` does it; forgotten afterwards."""
    folder, before = tmp_path_factory.mktemp("plugin"), dict(CONTROLLERS)
    path = folder / "proportional_plugin.py"
    path.write_text(PLUGIN + COMPENSATED, encoding="utf-8")
    sys.path.insert(0, str(folder))
    __import__(path.stem)
    yield path
    sys.path.remove(str(folder))
    del sys.modules[path.stem]
    CONTROLLERS.clear()
    CONTROLLERS.update(before)


@pytest.fixture(scope="module")
def outcomes(plugin):
    return [run_case(Case(name, 72.0)) for name in ("proportional", "proportional-cm", "smc")]


def test_it_drives_and_is_compensated(outcomes):
    """Its settings are its defaults; the clearance model needs nothing of it but commands, and takes out most."""
    plain, compensated, _ = (o.run.metrics()["rms_e_y"] for o in outcomes)
    assert get_controller("proportional").tuned_controller().gain == 0.05
    assert 0.01 < plain < 0.2 and compensated < 0.8 * plain


@pytest.mark.filterwarnings("ignore:The balance properties of Sobol")
def test_it_is_tuned(plugin, monkeypatch):
    monkeypatch.setattr(tuning, "MANOEUVRES", (tuning.Course(72.0, 1.5, "torque"),))
    tuned = tuning.tune("proportional", generations=1, population=5, workers=1)
    kind = type(get_controller("proportional").tuned_controller())
    assert tuned["evaluations"] == 10
    assert tuned["cost"] < tuning.cost(get_controller("proportional"), kind(gain=1e-3, look_ahead=2.0))
    again = Registration("proportional-tuned", "tuned", kind, tuned=tuned["settings"])
    assert again.tuned_controller() == kind(**tuned["settings"])


def test_it_is_in_figures_and_tables(outcomes, tmp_path):
    assert look("proportional")["color"] == "#117733" and look("proportional")["ls"] == ":"
    assert look("proportional-cm")["color"] == CYCLE[0]
    lines = histories(outcomes, "histories", ["e_y"]).figure.axes[0].lines
    assert [line.get_label() for line in lines] == ["Proportional", "Proportional-CM", "SMC"]
    np.testing.assert_allclose(lines[0].get_ydata(), 1e3 * outcomes[0].run.e_y)
    summary = write_report(outcomes, tmp_path)
    assert [row["controller"] for row in summary["runs"]] == ["proportional", "proportional-cm", "smc"]
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert page.count(">Proportional-CM<") >= 3  # metrics, timing, prior information


@pytest.mark.slow
def test_on_the_command_line(tmp_path):
    """In a process of its own, which starts others that do not share its memory."""
    path = tmp_path / "own_plugin.py"
    path.write_text(PLUGIN, encoding="utf-8")
    program = f"""
        import multiprocessing
        if __name__ == "__main__":
            multiprocessing.set_start_method("spawn")
            from clearance_mj.cli import main
            options = ["--speed", "72", "--controller", "proportional", "--json", "--quiet"]
            files = ["--plugin", {str(path)!r}, "--out", {str(tmp_path / "out")!r}]
            raise SystemExit(main(["vehicle", *options, *files]))
    """
    (tmp_path / "program.py").write_text(textwrap.dedent(program), encoding="utf-8")
    done = run("program.py", cwd=tmp_path, env=os.environ | {"PYTHONPATH": str(ROOT)})
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["runs"][0]["controller"] == "proportional"


@pytest.mark.parametrize(("name", "text", "words"), [
    ("json.py", "", "another module has this name"),
    ("wrong_plugin.py", "1 / 0", "ZeroDivisionError: division by zero"),
])  # fmt: skip
def test_file_that_cannot_be_used(name, text, words, tmp_path, refused, monkeypatch):
    monkeypatch.setattr(sys, "path", list(sys.path))
    (tmp_path / name).write_text(text, encoding="utf-8")
    assert words in refused("vehicle", "--plugin", tmp_path / name, "--out", tmp_path / "out")


def test_impossible_registrations():
    class Straight(Controller):
        def start(self, task):
            """Never begins: it cannot be registered."""

    with pytest.raises(ManoeuvreError, match='"smc" is registered already'):
        register(Registration("smc", "SMC", Straight))
    with pytest.raises(ManoeuvreError, match="\"straight\": bounds of 'gain', but its settings are"):
        register(Registration("straight", "Straight", Straight, bounds={"gain": (1.0, 2.0)}))


HIDDEN = """
import sys
sys.modules["vehiclemodels"] = sys.modules["osqp"] = None
import clearance_mj
from clearance_mj.cli import main
try:
    main(["--help"])
except SystemExit as end:
    assert not end.code
raise SystemExit(main(["vehicle", "--out", sys.argv[1]]))
"""


def test_without_the_extra(tmp_path):
    """The package and its help need neither package; the vehicle part says in one line how to get them."""
    done = run("-c", HIDDEN, tmp_path / "out")
    assert done.returncode == 2
    assert "vehicle" in done.stdout  # in the help
    needs = "the vehicle part needs vehiclemodels and osqp, not installed: pip install 'clearance-mj[vehicle]'"
    assert done.stderr == f"clearance-mj: {needs}\n"
