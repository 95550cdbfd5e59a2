"""The command line: exit statuses, one clear line for bad input, nothing left behind."""

import dataclasses
import re
import shutil

import numpy as np
import pytest

from clearance_mj import ConstantLaw, Contact, Model, Rig, excitation, simulate, write_dataset
from clearance_mj.clearance import nominal_law
from clearance_mj.cli import COMMANDS, main, names
from clearance_mj.cli.command import Result, command, option, warn_of_depths
from clearance_mj.io.results import load
from clearance_mj.study import ENGINES, METHODS

from ..conftest import record_of
from ..processes import run
from .conftest import RIG


def first_changed(change):
    """The bytes of the first record are changed."""

    def damage(folder):
        path = sorted(folder.glob("*.uff"))[0]
        path.write_bytes(change(path.read_bytes()))

    return damage


def rig_changed(change):
    return lambda folder: (folder / "rig.toml").write_text(change((folder / "rig.toml").read_text()))


DAMAGE = {
    "truncated": (first_changed(lambda data: data[:5000]), ""),
    "garbage": (first_changed(lambda data: b"\x00\xff" * 4000), ""),
    "not TOML": (rig_changed(lambda text: "beam = {"), ""),
    "unknown table": (rig_changed(lambda text: text + "\n[nonsense]\nx = 1\n"), "nonsense"),
    "unit": (rig_changed(lambda t: t.replace("0.0003", '"0.3 mm"', 1)), "bushings[0].gap must be a plain number"),
    "negative gap": (rig_changed(lambda text: text.replace("0.0003", "-0.0003")), "bushings[0].gap"),
    "missing record": (lambda folder: sorted(folder.glob("*.uff"))[0].unlink(), ""),
    "empty": (lambda folder: [p.unlink() for p in folder.iterdir()], ""),
    "gone": (shutil.rmtree, ""),
}


@pytest.mark.parametrize("damage, words", DAMAGE.values(), ids=DAMAGE)
def test_damaged_dataset(small_dataset, tmp_path, damage, words, refused):
    data, out = tmp_path / "data", tmp_path / "out"
    shutil.copytree(small_dataset, data)
    damage(data)
    message = refused("study", data, "--out", out)
    assert str(data) in message and words in message and not out.exists()


def test_record_shorter_than_one_segment(rig, tmp_path, refused):
    write_dataset(tmp_path / "data", rig, [record_of(rig, "short", "validate", 1.0, 3, duration=1.0)])
    assert "shorter" in refused("study", tmp_path / "data", "--methods", "nominal", "--out", tmp_path / "out")


def test_simulate_writes_a_response(answer, tmp_path):
    out = tmp_path / "response.nc"
    result = answer("simulate", RIG, "--engine", "modal", "--duration", 2, "--rms", 2, "--out", out)
    rms = result["acceleration_rms"]
    assert result["contact_share"] == load(out).contact_share.tolist() and max(result["contact_share"]) > 0.01
    assert list(rms) == [f"{n}:+Z" for n in range(1, 9)]
    assert rms["8:+Z"] == pytest.approx(load(out).acceleration[7].std())
    beyond = np.abs(load(out).displacement).max(axis=1) - 3e-4  # the gaps
    assert result["depth"] == pytest.approx(np.maximum(beyond, 0.0), abs=1e-9) and max(result["depth"]) > 1e-5


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
    changed = rig.replace(bushings=tuple(dataclasses.replace(b, gap=2 * b.gap, offset=5e-5) for b in rig.bushings))
    law, other = ConstantLaw(6e3, 12.0), ConstantLaw(9e3, 1.0)
    changed.save(tmp_path / "rig.toml")
    law.save(tmp_path / "law.json")
    other.save(tmp_path / "other.json")

    def simulated(*arguments):
        answer("simulate", *arguments, "--engine", "modal", "--duration", 1, "--rms", 5, "--out", tmp_path / "x.nc")
        return load(tmp_path / "x.nc")

    excited = excitation.random(1.0, 2048.0, (5.0, 220.0), 5.0, 0)
    of_folder = simulated(tmp_path)
    np.testing.assert_array_equal(of_folder.displacement, simulate(changed, excited, law, "modal").displacement)
    assert of_folder == simulated(tmp_path / "rig.toml", "--law", tmp_path / "law.json")
    assert simulated(tmp_path, "--law", tmp_path / "other.json").provenance["law"] == other.to_dict()
    (tmp_path / "law.json").unlink()
    assert simulated(tmp_path).provenance["law"] == nominal_law(changed).to_dict()


@pytest.mark.parametrize("arguments, words", [
    ([RIG, "--rms", "-1"], "rms"), ([RIG, "--engine", "warp", "--duration", "1"], "warp"), (["no.toml"], "no.toml"),
    ([RIG, "--law", "law.json", "--duration", "1"], "3 bushings, the rig has 2"),
])  # fmt: skip
def test_simulate_refuses(tmp_path, monkeypatch, refused, arguments, words):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "law.json").write_text('{"kind": "constant", "k": [1, 2, 3], "c": [0]}')
    assert words in refused("simulate", *arguments, "--out", "x.nc")
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
    with pytest.raises(SystemExit, match="2"):
        main([*map(str, arguments)])
    error = capsys.readouterr().err
    assert error.startswith(said) and error.count("\n") == 1


def help_of(capsys, *command):
    with pytest.raises(SystemExit, match="0"):
        main([*command, "--help"])
    return capsys.readouterr().out


def test_every_command_has_help_json_and_out(capsys):
    for name in names():
        said = help_of(capsys, name)
        assert "--json" in said and "--out" in said


def test_commands_are_listed_once_by_task(capsys):
    said = help_of(capsys)
    assert "\nidentify from records:\n  identify " in said and "\nshafts that turn:\n  campbell " in said
    assert sorted(re.findall(r"^  ([a-z][a-z-]*) +\S", said, re.MULTILINE)) == sorted(names())


def test_the_command_studies_what_the_library_does(capsys):
    words = "".join(help_of(capsys, "study").split())
    assert f"(default:thoseof{','.join(METHODS)}that" in words
    assert f"(default:{','.join(ENGINES)};modalalonewherelinkscannot)" in words


def test_a_command_is_one_registration(answer):
    """Of a file outside of the package too."""

    @command("mass", option("rig", "rig file"))
    def mass(options):
        """Tell a rig's mass."""
        return Result({"mass": Rig.load(options.rig).total_mass})

    try:
        assert answer("mass", RIG)["mass"] == pytest.approx(0.8918, abs=1e-4)
    finally:
        del COMMANDS["mass"]


def test_as_a_module():
    assert run("-m", "clearance_mj", "studdy").returncode == 2
