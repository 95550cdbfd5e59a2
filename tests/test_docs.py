"""The documentation's code runs as it stands, page by page from top to bottom, in a folder like a clone's."""

import dataclasses
import json
import operator
import re
import shlex
import shutil
import textwrap
import tomllib
from pathlib import Path

import numpy as np
import pytest

import clearance_mj as cm
from clearance_mj.beam import natural_frequencies
from clearance_mj.io.channels import Channel
from clearance_mj.io.dataset import Dataset
from clearance_mj.io.uff import read_uff
from clearance_mj.rig import Rig

from .conftest import ROOT
from .processes import run

DOCS = ROOT / "docs"


def blocks(page):
    """Language and text of every code block of a page."""
    return re.findall(r"^```(\w+)\n(.*?)^```$", (DOCS / page).read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)


def output(folder, *command):
    done = run(*command, patience=600, cwd=folder)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture
def clone(tmp_path) -> Path:
    for name in ("data", "models"):
        (tmp_path / name).symlink_to(ROOT / name)
    return tmp_path


def run_python(page, folder):
    """Run the blocks of a page as one script; a block that names its file in the first line is saved there."""
    script = []
    for _, text in (block for block in blocks(page) if block[0] == "python"):
        named = re.match(r"# (\w+\.py)\n", text)
        if named:
            (folder / named[1]).write_text(text, encoding="utf-8")
        else:
            script.append(text)
    (folder / "page.py").write_text("\n".join(script), encoding="utf-8")
    return output(folder, "page.py")


def test_what_the_page_of_datasets_calls_lists_the_priors():
    call = re.search(r"`clearance_mj\.(\S+)\(rig\)` lists", (DOCS / "dataset.md").read_text(encoding="utf-8"))[1]
    parameters = operator.attrgetter(call)(cm)(Rig.load(ROOT / "models" / "table1_rig.toml"))
    assert {"beam.young_modulus", "bushings[0].gap"} <= {parameter.name for parameter in parameters}
    assert cm.Channel is Channel


@pytest.mark.slow
def test_physical(clone):
    """A robot's feet, a ball, an arm, a box, a worm, and the gallery's scenes: each beside its closed form."""
    printed = run_python("physical.md", clone).splitlines()
    assert len([line for line in printed if re.fullmatch(r"stable below [\d.e-]+ s; no warning", line)]) == 1
    compared = [re.search(r" (-?[\d.]+)\D* expected (-?[\d.]+)", line) for line in printed if "expected" in line]
    assert len(compared) == 11
    for printed_number, expected in (map(float, match.groups()) for match in compared):
        assert printed_number == pytest.approx(expected, rel=2e-4)


@pytest.mark.slow
def test_drives(clone):
    """The synthetic drive's friction is found again, and goes into a MuJoCo model that says what it lacks."""
    printed = run_python("drives.md", clone)
    assert "friction that grows: 0.15" in printed
    assert "the model does not represent\n- the load's angle" in printed


@pytest.mark.slow
def test_random_excitation(clone):
    """The page's table is what its code prints."""
    out = run_python("random_excitation.md", clone)
    page = (DOCS / "random_excitation.md").read_text(encoding="utf-8")
    shown = re.search(r"prints a table like\n\n((?:    .+\n)+)", page)[1]
    assert out.startswith(textwrap.dedent(shown))


@pytest.mark.slow
def test_productions(clone):
    """Of the page's few designs some touch at 1.5 m/s², and the intervals hold the shares."""
    shares, low, high = (
        [float(value) for value in re.findall(r"[\d.]+(?:e-\d+)?", row)]
        for row in re.findall(r"\[([\d. e-]+)\]", run_python("production.md", clone))
    )
    assert shares[0] < shares[1] < shares[2] and all(a <= b <= c for a, b, c in zip(low, shares, high))


@pytest.mark.slow
def test_readme(clone):
    """Its four scripts: what the bench's prints is better than its table's worst record, the others run.

    The rotor's critical speeds are where docs/rotors.md has its resonance without contact, at 1400 rev/min.
    """
    bench, model, designer, rotor = (text for language, text in blocks("../README.md") if language == "python")
    printed = [_printed(clone, text) for text in (bench, model, designer, rotor)]
    assert float(printed[0]) < 0.13
    assert printed[1] == ""
    first = [float(value) for value in re.findall(r"rattles from ([\d.]+) m/s² on", printed[2])]
    assert len(first) == 2 and first[1] < first[0]
    assert 50 < float(re.search(r"touches for (\d+)% of the time", printed[3])[1]) < 100
    critical = [float(value) for value in re.findall(r"^\d +(\d+\.\d+) +(?:for|back)ward", printed[3], re.MULTILINE)]
    assert critical == pytest.approx([1400.0, 1400.0], rel=0.01)


def _printed(folder, script) -> str:
    (folder / "script.py").write_text(script, encoding="utf-8")
    return output(folder, "script.py")


@pytest.mark.slow
def test_identify_model(tmp_path):
    """Gap and stiffness that the record was made with: 0.02 rad, 400 N m/rad."""
    out = run_python("identify_model.md", tmp_path)
    gap, k = (float(re.search(rf"backlash\.{name} +([\d.]+)", out)[1]) for name in ("gap", "k"))
    assert gap == pytest.approx(0.02, rel=0.02)
    assert k == pytest.approx(400, rel=0.05)


@pytest.mark.slow
def test_get_started(clone):
    out = run_python("get_started.md", clone)
    assert out.startswith("[  9.25  39.75  92.85 188.85]\n")
    assert float(re.search(r"RMSE ([\d.]+) dB", out)[1]) < 0.5


@pytest.mark.slow
def test_periodic(clone):
    """What the page says is printed."""
    out = run_python("periodic.md", clone)
    page = (DOCS / "periodic.md").read_text(encoding="utf-8")
    shown = re.findall(r"^prints\n\n((?:    .+\n)+)", page, re.MULTILINE)
    assert out == textwrap.dedent("".join(shown))


@pytest.mark.slow
def test_live(clone):
    out = run_python("live.md", clone)
    assert "x = 0.7918 m: rattles" in out and "(8, 431) 0.0002" in out


@pytest.mark.slow
def test_rotors(clone):
    """The rub of the run-up ends where the page says, and is hardly beyond the gap."""
    last, radius = re.search(r"to (\d+) rev/min; 1X at most (\d+) µm", run_python("rotors.md", clone)).groups()
    page = (DOCS / "rotors.md").read_text(encoding="utf-8")
    assert float(last) == pytest.approx(float(re.search(r"without contact, to (\d+) rev/min", page)[1]), abs=15)
    assert 0.9 * 120 < float(radius) < 1.05 * 120  # the gap is 120 µm


def test_gears(clone):
    """What the page says is printed; its rig is the one that is shipped, but for names."""
    page = (DOCS / "gears.md").read_text(encoding="utf-8")
    shown = re.findall(r"^prints\n\n((?:    .+\n)+)", page, re.MULTILINE)
    assert run_python("gears.md", clone) == textwrap.dedent("".join(shown))
    (of_page,) = (tomllib.loads(text) for language, text in blocks("gears.md") if language == "toml")
    rig, shipped = Rig.from_dict(of_page), Rig.load(ROOT / "models" / "gear_pair.toml")
    loads = tuple(dataclasses.replace(load, name="") for load in shipped.loads)
    assert rig == shipped.replace(description="", loads=loads)


@pytest.mark.slow
def test_wear(clone):
    """Lives in words and their quantiles where coefficients scatter; what is left is asserted on the page."""
    words, quantiles = run_python("wear.md", clone).splitlines()
    life = float(re.match(r"life ([\d.e+]+) h: the gap of 7:\+Z \(0\.45 mm\)", words)[1])
    early, middle = (float(each) for each in quantiles.split()[:2])
    assert 0 < early < middle < life  # those go to 0.33 mm alone


@pytest.mark.slow
def test_sound(clone):
    """Its script runs, at 1 m/s² as loud as the page's command says within 10 %, and its plate is one of a rig's."""
    pytest.importorskip("mosqito")
    loud = float(re.match(r"([\d.]+) sone exceeded", run_python("sound.md", clone))[1])
    page = (DOCS / "sound.md").read_text(encoding="utf-8")
    assert loud == pytest.approx(float(re.search(r"([\d.]+) sone to 3\.0", page)[1]), rel=0.1)
    (plate,) = (tomllib.loads(text) for language, text in blocks("sound.md") if language == "toml")
    assert (
        Rig.from_dict(tomllib.loads((ROOT / "models" / "table1_rig.toml").read_text("utf-8")) | plate).plate.area == 0.1
    )


@pytest.mark.slow
def test_data_model(clone):
    """Its asserts hold."""
    run_python("data_model.md", clone)


@pytest.mark.slow
def test_twin(clone):
    run_python("twin.md", clone)


@pytest.mark.slow
def test_extending(clone):
    """One file for each of the eleven kinds, used from Python, then by the commands of the page's table."""
    run_python("extending.md", clone)
    assert (clone / "gap" / "gap_frequencies.csv").read_text().splitlines()[1].startswith("1,9.25")
    for model in ("sinh", "maxwell"):
        law = json.loads((clone / "law.json").read_text())
        law |= {"grease": None} if model == "sinh" else {"contact": [{"model": "kelvin-voigt", "stiffness": 2e4}]}
        (clone / f"{model}.json").write_text(json.dumps(law))
    page = (DOCS / "extending.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| [\w ]+ \| `(\S+)` \| `(\S+)` \| `clearance-mj (.+)` \|$", page, re.MULTILINE)
    assert len(rows) == 10
    for file, folder, command in rows:
        assert (clone / file).is_file()
        assert (ROOT / "clearance_mj" / folder).is_dir()
        output(clone, "-m", "clearance_mj", *command.split())
    assert "contact_time" in (clone / "section" / "report.html").read_text()
    assert (clone / "first.uff").is_file()


def follow(page, clone):
    """Run a page's commands in their order, then its Python; return what that printed."""
    script = []
    for language, text in blocks(page):
        if language == "python":
            script.append(text)
            continue
        for line in text.replace("\\\n", "").splitlines():
            program, *arguments = shlex.split(line)
            if program == "cp":
                shutil.copy(*(clone / path for path in arguments))
            else:
                assert program == "clearance-mj"
                output(clone, "-m", "clearance_mj", *arguments)
    (clone / "page.py").write_text("\n".join(script), encoding="utf-8")
    return output(clone, "page.py")


@pytest.mark.slow
def test_tutorial(clone):
    """Commands and Python in the order of the page, and the figures that the page names."""
    out = follow("tutorial.md", clone)
    figures = re.findall(r"RMSE ([\d.]+) dB, FRAC ([\d.]+)", out)
    page = (DOCS / "tutorial.md").read_text(encoding="utf-8")
    assert re.search(r"records: ([\d.]+) dB and ([\d.]+) with", page).groups() == figures[0]
    assert re.search(r"contact, ([\d.]+) dB and ([\d.]+) with", page).groups() == figures[1]
    assert textwrap.dedent("".join(re.findall(r"^prints\n\n((?:    .+\n)+)", page, re.MULTILINE))) in out
    for path in (
        "identified/index.html",
        "over_amplitude/figures/contact_over_amplitude.png",
        "over_amplitude/figures/restoring_force.png",
        "comparison",
        "mydata",
    ):
        assert (clone / path).exists()
    assert [r.role for r in Dataset.load(clone / "mydata").records] == ["identify", "validate"]


NUMBER = r"-?\d+(?:\.\d+)?(?:e[-+]\d+)?"


def words(text):
    return re.sub(NUMBER, "#", text)


def numbers(text):
    return [float(number) for number in re.findall(NUMBER, text)]


@pytest.mark.slow
def test_tutorial_of_the_stepped_shaft(clone):
    """What the page says is printed and drawn, what impacts depend on as closely as rounding leaves it."""
    out = follow("tutorial_stepped_shaft.md", clone)
    page = (DOCS / "tutorial_stepped_shaft.md").read_text(encoding="utf-8")
    shown = textwrap.dedent("".join(re.findall(r"^prints\n\n((?:    .+\n)+)", page, re.MULTILINE)))
    for printed, line in zip(out.splitlines(), shown.splitlines(), strict=True):
        if line.startswith("gap"):
            assert words(printed) == words(line)
            (gap, touched, *rest), (of_page, known, *others) = numbers(printed), numbers(line)
            assert gap == of_page and rest == others and abs(touched - known) <= 1  # point, which rounding moves it by
        else:
            assert printed == line
    for path in ("rig.png", "motion/waterfall.png", "comparison"):
        assert (clone / path).exists()
    pump = (ROOT / "models" / "stepped_shaft.toml").read_text(encoding="utf-8")
    for lines in re.findall(r"(^    \[.+\n(?:    \w+ = .+\n)+)", page, re.MULTILINE):
        assert textwrap.dedent(lines) in pump


@pytest.mark.slow
def test_tutorial_of_the_modal_test(clone):
    """What the page says is printed; its universal file is what its script makes."""
    out = follow("tutorial_modal_test.md", clone)
    page = (DOCS / "tutorial_modal_test.md").read_text(encoding="utf-8")
    shown = re.findall(r"^prints\n\n((?:    .+\n)+)", page, re.MULTILINE)
    assert out == textwrap.dedent("".join(shown))
    assert (clone / "pipe" / "synthesis.png").exists() and Rig.load(clone / "pipe.toml").structure.dofs
    output(ROOT, "-m", "experiments.modal_test", str(clone / "again.uff"))
    again, committed = read_uff(clone / "again.uff"), read_uff(ROOT / "models" / "modal_test.uff")
    np.testing.assert_allclose(again.value, committed.value, rtol=1e-9)


@pytest.mark.slow
def test_tutorial_of_matrices(clone):
    """What the page says is printed, but for responses that are chaotic: any rounding changes them."""
    out = follow("tutorial_matrices.md", clone)
    page = (DOCS / "tutorial_matrices.md").read_text(encoding="utf-8")
    shown = re.findall(r"^prints\n\n((?:    .+\n)+)", page, re.MULTILINE)
    lines = out.splitlines(keepends=True)
    assert "".join(lines[:3] + lines[5:]) == textwrap.dedent("".join(shown))
    assert Rig.load(clone / "frame.toml").structure == Rig.load(ROOT / "models" / "pump_frame.toml").structure


def test_structures():
    """Its rig files are read, and their natural frequencies found."""
    files = [text for language, text in blocks("structures.md") if language == "toml"]
    assert len(files) >= 2
    for text in files:
        rig = Rig.from_dict(tomllib.loads(text))
        assert np.all(natural_frequencies(rig, 3) > 1)


@pytest.mark.slow
def test_turning_shafts(clone):
    """The page's rotor is what its script loads as rotor.toml."""
    (rotor,) = (text for language, text in blocks("structures.md") if language == "toml" and "pump rotor" in text)
    (clone / "rotor.toml").write_text(rotor, encoding="utf-8")
    run_python("structures.md", clone)


@pytest.mark.slow
def test_sweeps(clone):
    """The page's plan of two cases without what is optional, then its results; of the hour a minute; no cluster."""
    plan, results, of_python, _, long_run = (text for language, text in blocks("sweeps.md") if language != "sh")
    kept = re.sub(r"^(law|reference) = .*$", "", plan, flags=re.MULTILINE).replace("samples = 500", "samples = 2")
    (clone / "plan.toml").write_text(kept.replace("duration = 8", "duration = 2"), encoding="utf-8")
    for text in (of_python.replace("workers=8", "workers=1"), results, long_run.replace("3600", "60")):
        _printed(clone, text)


@pytest.mark.slow
@pytest.mark.parametrize("page", ["dataset.md", "energy_balance.md", "files.md"])
def test_what_prints_nothing_that_the_page_states(clone, page):
    run_python(page, clone)


def test_every_page_with_python_is_run():
    text = Path(__file__).read_text(encoding="utf-8")
    pages = {page.name for page in DOCS.glob("*.md") if any(language == "python" for language, _ in blocks(page.name))}
    assert {page for page in pages if f'"{page}"' not in text} == set()


@pytest.mark.slow
def test_hammer(tmp_path):
    """The modes that the page states of its beam are found."""
    out = run_python("hammer.md", tmp_path)
    printed_numbers = [float(number) for number in re.findall(r"[\d.]+", out)]
    assert printed_numbers[::2] == pytest.approx([18, 72, 162, 288], rel=1e-3)
    assert printed_numbers[1::2] == pytest.approx([0.8, 0.6, 0.5, 0.7], rel=0.03)
