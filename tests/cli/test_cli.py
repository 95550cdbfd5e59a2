"""The command line: exit statuses, one clear line for bad input, nothing left behind."""

import dataclasses
import json
import re
import shutil

import numpy as np
import pytest

from clearance_mj import ConstantLaw, Contact, Model, Rig, excitation, simulate
from clearance_mj.clearance import nominal_law
from clearance_mj.cli import COMMANDS, main, names
from clearance_mj.cli.command import Result, command, option, warn_of_depths
from clearance_mj.io.results import load
from clearance_mj.study import ENGINES, METHODS

from ..conftest import ROOT
from ..processes import run

RIG = str(ROOT / "models" / "table1_rig.toml")


def first_record(folder):
    return sorted(folder.glob("*.uff"))[0]


DAMAGE = {
    "truncated": lambda d: first_record(d).write_bytes(first_record(d).read_bytes()[:5000]),
    "garbage": lambda d: first_record(d).write_bytes(b"\x00\xff" * 4000),
    "not TOML": lambda d: (d / "rig.toml").write_text("beam = {"),
    "unknown table": lambda d: (d / "rig.toml").write_text((d / "rig.toml").read_text() + "\n[nonsense]\nx = 1\n"),
    "unit": lambda d: (d / "rig.toml").write_text((d / "rig.toml").read_text().replace("0.0003", '"0.3 mm"', 1)),
    "negative gap": lambda d: (d / "rig.toml").write_text((d / "rig.toml").read_text().replace("0.0003", "-0.0003")),
    "missing record": lambda d: first_record(d).unlink(),
    "empty": lambda d: [p.unlink() for p in d.iterdir()],
    "gone": shutil.rmtree,
}
NAMED = {
    "unknown table": "nonsense", "unit": "bushings[0].gap must be a plain number", "negative gap": "bushings[0].gap",
}  # fmt: skip


@pytest.mark.parametrize("damage", DAMAGE)
def test_damaged_dataset(small_dataset, tmp_path, damage, refused):
    data, out = tmp_path / "data", tmp_path / "out"
    shutil.copytree(small_dataset, data)
    DAMAGE[damage](data)
    message = refused("study", data, "--out", out)
    assert str(data) in message and NAMED.get(damage, "") in message and not out.exists()


def test_record_shorter_than_one_segment(rig, tmp_path, refused):
    from clearance_mj.io.dataset import write_dataset

    from ..conftest import record_of

    write_dataset(tmp_path / "data", rig, [record_of(rig, "short", "validate", 1.0, 3, duration=1.0)])
    assert "shorter" in refused("study", tmp_path / "data", "--methods", "nominal", "--out", tmp_path / "out")


def test_simulate_writes_a_response(answer, tmp_path):
    out = tmp_path / "response.nc"
    found = answer("simulate", RIG, "--engine", "modal", "--duration", 2, "--rms", 2, "--out", out)
    rms = found["acceleration_rms"]
    assert found["contact_share"] == load(out).contact_share.tolist() and max(found["contact_share"]) > 0.01
    assert list(rms) == [f"{n}:+Z" for n in range(1, 9)]
    assert rms["8:+Z"] == pytest.approx(load(out).acceleration[7].std())
    beyond = np.abs(load(out).displacement).max(axis=1) - 3e-4  # the gaps
    assert found["depth"] == pytest.approx(np.maximum(beyond, 0.0), abs=1e-9) and max(found["depth"]) > 1e-5


def test_a_force_says_how_deep_it_presses(rig, capsys):
    """3.3 N at 1e4 N/m are 0.33 mm, in a gap of 0.15 mm; 0.2 N are 20 µm, less than a fifth of it."""
    gaps = tuple(dataclasses.replace(b, gap=1.5e-4, contact=Contact(1e4, 4.0)) for b in rig.bushings)
    model = Model(rig.replace(bushings=gaps))
    warn_of_depths(model, np.array([3.3, 0.2]), "contact_force")
    (line,) = capsys.readouterr().err.splitlines()
    assert "6:+Z: the shaft is 0.33 mm deep in the wall, beyond a fifth of the gap (0.15 mm)" in line
    warn_of_depths(model, np.array([3.3, 0.2]), "acceleration")
    assert capsys.readouterr().err == ""


def test_simulate_takes_a_folder_with_rig_and_law(answer, rig, tmp_path):
    """A rig of another gap and its law, as an identification leaves them; with another law; or the datasheet's."""
    found = rig.replace(bushings=tuple(dataclasses.replace(b, gap=2 * b.gap, offset=5e-5) for b in rig.bushings))
    law, other = ConstantLaw(6e3, 12.0), ConstantLaw(9e3, 1.0)
    found.save(tmp_path / "rig.toml")
    law.save(tmp_path / "law.json")
    other.save(tmp_path / "other.json")

    def simulated(*arguments):
        answer("simulate", *arguments, "--engine", "modal", "--duration", 1, "--rms", 5, "--out", tmp_path / "x.nc")
        return load(tmp_path / "x.nc")

    excited = excitation.random(1.0, 2048.0, (5.0, 220.0), 5.0, 0)
    of_folder = simulated(tmp_path)
    np.testing.assert_array_equal(of_folder.displacement, simulate(found, excited, law, "modal").displacement)
    assert of_folder == simulated(tmp_path / "rig.toml", "--law", tmp_path / "law.json")
    assert simulated(tmp_path, "--law", tmp_path / "other.json").provenance["law"] == other.to_dict()
    (tmp_path / "law.json").unlink()
    assert simulated(tmp_path).provenance["law"] == nominal_law(found).to_dict()


def test_simulate_refuses(tmp_path, refused):
    assert "rms" in refused("simulate", RIG, "--rms", "-1", "--out", tmp_path / "x.nc")
    assert "warp" in refused("simulate", RIG, "--engine", "warp", "--duration", "1", "--out", tmp_path / "x.nc")
    assert "no.toml" in refused("simulate", "no.toml", "--out", tmp_path / "x.nc")
    law = tmp_path / "law.json"
    law.write_text('{"kind": "constant", "k": [1, 2, 3], "c": [0]}')
    short = ("--duration", "1", "--out", tmp_path / "x.nc")
    assert "3 bushings, the rig has 2" in refused("simulate", RIG, "--law", law, *short)
    assert not (tmp_path / "x.nc").exists()


@pytest.mark.parametrize("arguments, wrote", [
    (["place", RIG, "--sensors", 4, "--out"], "placement.csv"),
    (["simulate", RIG, "--duration", 0.1, "--engine", "modal", "--out", "r.nc", "--energy"], "energy.csv"),
])  # fmt: skip
def test_a_folder_that_is_written_into_keeps_files_of_others(answer, tmp_path, monkeypatch, arguments, wrote):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "paper" / "figures").mkdir(parents=True)
    foreign = {tmp_path / "paper" / name: name for name in ("thesis.tex", "figures/photo.png", "raw.csv")}
    for path, text in foreign.items():
        path.write_text(text)
    answer(*arguments, "paper")
    assert (tmp_path / "paper" / wrote).exists()
    assert {path: path.read_text() for path in foreign} == foreign


def test_a_calibration_does_not_replace_the_rig_it_started_from(refused, tmp_path):
    (tmp_path / "rig.toml").write_text("my rig")
    (tmp_path / "f.csv").write_text("frequency_hz\n10\n")
    arguments = ("calibrate", tmp_path / "rig.toml", tmp_path / "f.csv", "--free", "bushings[0].position")
    assert "rig.toml is read by this command" in refused(*arguments, "--out", tmp_path)
    assert (tmp_path / "rig.toml").read_text() == "my rig"


@pytest.mark.parametrize("arguments, said", [
    (["studdy"], "clearance-mj: 'studdy' is no command, did you mean study? (see clearance-mj --help)"),
    (["simulate", RIG, "--duraton", "1"], "clearance-mj simulate: '--duraton' is not known, did you mean --duration?"),
    (["place", RIG, "--sensor=4x"], "clearance-mj place: argument --sensors: invalid int value: '4x'"),
    (["simulate"], "clearance-mj simulate: the following arguments are required: rig"),
    ([], "clearance-mj: the following arguments are required: COMMAND"),
])  # fmt: skip
def test_wrong_usage(capsys, arguments, said):
    with pytest.raises(SystemExit) as stopped:
        main(arguments)
    assert stopped.value.code == 2
    error = capsys.readouterr().err
    assert error.startswith(said) and error.count("\n") == 1


def test_every_command_has_help_json_and_out(capsys):
    for name in names():
        with pytest.raises(SystemExit) as stopped:
            main([name, "--help"])
        said = capsys.readouterr().out
        assert stopped.value.code == 0 and "--json" in said and "--out" in said


def test_commands_are_listed_once_by_task(capsys):
    with pytest.raises(SystemExit):
        main(["--help"])
    said = capsys.readouterr().out
    assert "\nidentify from records:\n  identify " in said and "\nshafts that turn:\n  campbell " in said
    assert sorted(re.findall(r"^  ([a-z][a-z-]*) +\S", said, re.MULTILINE)) == sorted(names())


def test_the_command_studies_what_the_library_does(capsys):
    with pytest.raises(SystemExit):
        main(["study", "--help"])
    words = "".join(capsys.readouterr().out.split())
    assert f"(default:thoseof{','.join(METHODS)}that" in words
    assert f"(default:{','.join(ENGINES)};modalalonewherelinkscannot)" in words


def test_a_command_is_one_registration(capsys):
    """Of a file outside of the package too."""

    @command("mass", option("rig", "rig file"))
    def mass(options):
        """Tell a rig's mass."""
        return Result({"mass": Rig.load(options.rig).total_mass})

    try:
        assert main(["mass", RIG, "--json"]) == 0
        assert json.loads(capsys.readouterr().out)["mass"] == pytest.approx(0.8918, abs=1e-4)
    finally:
        del COMMANDS["mass"]


def test_as_a_module():
    assert run("-m", "clearance_mj", "studdy").returncode == 2
