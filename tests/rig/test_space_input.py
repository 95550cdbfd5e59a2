"""What a rig file says wrongly of motion in space: one line with what would be right; and what it says comes back."""

from __future__ import annotations

import dataclasses
import tomllib
from pathlib import Path
from typing import Any

import pytest

import clearance_mj as cm
from clearance_mj import Rig
from clearance_mj.core.errors import ClearanceError, RigError

from ..refusals import assert_refused

TABLE1 = Path(__file__).parents[2] / "models" / "table1_rig.toml"
SPACE = 'motion = "spatial"\n'
SPIN = "\n[spin]\nspeed = 50.0\n"
UNBALANCE = "\n[[unbalances]]\nposition = 0.5\nmoment = 1e-4\n"


def text(head: str = SPACE, tail: str = "", of_bushing: str = "") -> str:
    lines = head + TABLE1.read_text(encoding="utf-8")
    return lines.replace("[[bushings]]", f"[[bushings]]\n{of_bushing}", 1) + tail


@pytest.mark.parametrize(("file", "said"), [
    (text(of_bushing="probe_angle = [0.0, 1.2]\n"), "bushings[0].probe_angle [0.0, 1.2] rad are not at right angles"),
    (text(SPACE + "gravity = 9.81\n"), "gravity 9.81 has no direction; give a vector (x, y, z) in m/s², such as"),
    (text(SPACE + "gravity = [0.0, 0.0, 0.0]\n"), "gravity (0, 0, 0) has no direction; leave it out"),
    (text("gravity = [0.0, 0.0, 0.0]\n"), "gravity (0, 0, 0) has no direction; leave it out"),
    (text("", of_bushing="friction = {coefficient = 0.1}"), 'bushings[0].friction.along "@0.5484:Y": nothing slides'),
    (text("", of_bushing="offset_y = 1e-5"), 'bushings[0].offset_y needs shape = "round"'),
    (text('motion = "sideways"\n'),
     'motion "sideways" is unknown; leave it out, and give round bushings shape = "round"'),
    (text("", of_bushing='shape = "stop"'), 'bushings[0].shape "stop" stands beside stops "both", which is a slot'),
    (text("", of_bushing='shape = "square"'), 'shape "square" is unknown; known: oval, round, slot, stop'),
    (text("", of_bushing='shape = "oval"\nwall = {tall = 1e-5}'),
     'shape "oval".tall is not a known key; known: wide, across'),
    (text("", of_bushing='shape = "oval"\nwall = {wide = 2e-4, across = -2.5e-4}'),
     "bushings[0].wall {'wide': 0.0002, 'across': -0.00025} leaves no room in the gap 0.0003 m"),
    (
        text(of_bushing="offset_y = 2.5e-4\noffset = 2.5e-4"),
        "bushings[0].offset (0.00025, 0.00025) m along y, z lies beyond the gap 0.0003 m: at rest the shaft "
        "touches no wall",
    ),
    (text(of_bushing="friction = {coefficient = -0.1}"), "bushings[0].friction.coefficient must be >= 0, got -0.1"),
    (text(of_bushing="friction = {coefficient = 0.1, static_ratio = 1.5}"),
     "stribeck_speed is missing; static_ratio > 1 needs a speed over which the friction falls"),
    (text(of_bushing="film = {viscosity = 0.05}"),
     "bushings[0].film is oil and grease has a stiffness or damping: one of them fills the gap"),
    (text(of_bushing='stops = "upper"'), 'bushings[0].stops "upper" is one wall; a round clearance has its wall'),
    (text(tail=UNBALANCE), "unbalances act on a shaft that turns; give [spin] with its speed"),
    (text(tail=SPIN + UNBALANCE.replace("1e-4", "-1e-4")), "unbalances[0].moment must be > 0, got -0.0001"),
    (text(tail=SPIN + UNBALANCE.replace("0.5", "5.0")), "unbalances[0].position 5 m lies outside the beam"),
    (text(tail=SPIN + "rate = 5.0\nuntil = 20.0\n"),
     "spin.until 20 rad/s is never reached from speed 50 rad/s at a rate of 5 rad/s²"),
    (text(tail="\n[[fixture]]\nfrequency = 100.0\n"),
     "a rig that moves along y and z knows no fixture and no planes; leave them out"),
])  # fmt: skip
def test_one_line_says_what_is_wrong(file: str, said: str, tmp_path: Path) -> None:
    path = tmp_path / "rig.toml"
    path.write_text(file, encoding="utf-8")
    assert said in assert_refused(RigError, None, Rig.load, path)


@pytest.mark.parametrize(("length", "viscosity", "words"), [
    (0.0, 0.05, r"bushing.film needs the bushing's length: a short bearing carries with its cube"),
    (0.01, 0.0, r"viscosity must be > 0, got 0 \(Pa s\)"),
])  # fmt: skip
def test_a_film_that_builds_no_pressure_is_refused(length: float, viscosity: float, words: str) -> None:
    film = {"viscosity": viscosity, "cavitated": True}
    with pytest.raises(RigError, match=words):
        cm.Bushing(0.5, 3e-4, length, cm.Grease(0.0), cm.Contact(1e4), film=film)  # type: ignore[arg-type]


def test_a_film_is_thicker_than_its_asperities() -> None:
    film = {"viscosity": 0.05, "asperities": 3e-4}
    with pytest.raises(RigError, match=r"film.asperities 0.0003 m are as high as the gap 0.0003 m is wide"):
        cm.Bushing(0.5, 3e-4, 0.01, cm.Grease(0.0), cm.Contact(1e4), film=film)  # type: ignore[arg-type]


def test_unequal_sections_do_not_turn() -> None:
    rig = Rig.load(TABLE1)
    width = {"diameter": None, "width": 0.02, "height": 0.01}
    data = rig.with_shape("round").to_dict()
    data["beam"] = {key: value for key, value in (data["beam"] | width).items() if value is not None}
    Rig.from_dict(data)  # may move in space
    words = r"spin: sections\[0\] is .* a shaft that turns needs sections that are as stiff"
    assert_refused(RigError, words, Rig.from_dict, data | {"spin": {"speed": 10.0}})


def test_what_turns_is_known_of_shafts_alone() -> None:
    rig = Rig.load(TABLE1.with_name("pump_frame.toml")).replace(bushings=())
    words = "spin needs a beam or one shaft: of other structures it is not known what turns"
    assert_refused(RigError, words, rig.replace, spin=cm.rig.Spin(10.0))


def everything() -> Rig:
    """A rig file with all that space has."""
    file = text(
        SPACE + "gravity = [0.0, -1.0, -9.81]\n",
        "\n[spin]\nspeed = 5.0\nrate = 2.0\nuntil = 50.0\nangle = 0.1\n" + UNBALANCE,
        "offset_y = 1e-5\nradius = 0.005\nprobe_angle = 0.78\n"
        "friction = {coefficient = 0.1, stiffness = 1e5, damping = 2.0, static_ratio = 1.4, stribeck_speed = 0.01}",
    )

    return Rig.from_dict(tomllib.loads(file), TABLE1.parent)


def test_a_file_holds_all_of_it(tmp_path: Path) -> None:
    rig = everything()
    rig.save(tmp_path / "rig.toml")
    assert Rig.load(tmp_path / "rig.toml") == rig
    written = (tmp_path / "rig.toml").read_text(encoding="utf-8")
    assert written.count('shape = "round"') == 2 and "motion" not in written  # as older files say it
    assert rig.probe_labels == ["6:+Y", "6:+Z", "7:+Y", "7:+Z"]
    assert "turns at 47.75 to 477.5 rev/min" in repr(rig)


def test_digests_of_older_files_stay() -> None:
    """What caches and records are known by is what the file said: in space with `motion`, in the plane without."""
    older = {"motion": "spatial"} | Rig.load(TABLE1).to_dict()
    assert Rig.from_dict(older).content() == older
    assert Rig.load(TABLE1).content() == Rig.load(TABLE1).to_dict()


def test_a_planar_file_says_nothing_of_space(tmp_path: Path) -> None:
    Rig.load(TABLE1).save(tmp_path / "rig.toml")
    names = ("motion", "gravity", "spin", "unbalances", "friction", "film", "radius", "offset_y", "probe_angle")
    written = (tmp_path / "rig.toml").read_text(encoding="utf-8")
    assert not [name for name in names if f"{name} =" in written]


def test_what_knows_the_plane_alone_says_so() -> None:
    rig = everything()
    dataset: Any = cm.Dataset.load(TABLE1.parents[1] / "data" / "table1_rig")
    for call, method in ((cm.identify.identify, "constant"), (cm.identify.law, "output-error")):
        assert_refused(ClearanceError, "planar|alone", call, dataclasses.replace(dataset, rig=rig), method)
