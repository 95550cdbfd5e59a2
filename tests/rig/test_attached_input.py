"""What a rig file says wrongly of housings, springs, fixture and clamp: one line with what would be right."""

from pathlib import Path

import pytest

from clearance_mj import Rig
from clearance_mj.core.errors import RigError

from ..refusals import assert_refused

TABLE1 = Path(__file__).parents[2] / "models" / "table1_rig.toml"
SPRING = "\n[[springs]]\nposition = 0.5\nstiffness = 100.0\n"
OSCILLATOR = "\n[[oscillators]]\nposition = 0.5\nmass = 0.1\nfrequency = 120.0\n"
FIXTURE = "\n[[fixture]]\nfrequency = 100.0\ndamping_ratio = 0.02\nparticipation = 0.1\n"


@pytest.mark.parametrize(("added", "said"), [
    ("\n[housing]\nstiffness = 1e5\n", "housing is not a known key"),
    ("\n[[housings]]\nbushing = 7\nstiffness = 1e5\n", "housings is not a known key"),
    ("\n[[masses]]\nposition = 0.5\nmass = -0.1\n", "mass must be > 0, got -0.1 (kg)"),
    (2 * SPRING, "springs[1] joins what another spring joins; add its numbers to that one"),
    (SPRING.replace("0.5", "5.0"), "springs[0].position 5 m lies outside the beam (0 < x <= 1 m)"),
    (SPRING.replace("100.0", "-100.0"), "springs[0].stiffness must be >= 0, got -100 (N/m)"),
    (2 * FIXTURE, "fixture[1].frequency 100 Hz is another mode's; put both into one"),
    (OSCILLATOR.replace("0.1", "-0.1"), "oscillators[0].mass must be > 0, got -0.1 (kg)"),
    (OSCILLATOR.replace("0.5", "2.0"), "oscillators[0].position 2 m lies outside the beam (0 < x <= 1 m)"),
    (OSCILLATOR.replace("0.5", '"5:+Z"') + "lever = 0.1\n",
     'oscillators[0].lever 0.1 m needs a position along a shaft, not "5:+Z"'),
    (FIXTURE.replace("100.0", "0.0"), "fixture[0].frequency must be > 0, got 0 (Hz)"),
    ("\n[beam.clamp]\ntranslation = 1e6\nmass = -1.0\n", "beam.clamp.mass must be >= 0, got -1 (kg"),
])  # fmt: skip
def test_one_line_says_what_is_wrong(added: str, said: str, tmp_path: Path):
    path = tmp_path / "rig.toml"
    path.write_text(TABLE1.read_text(encoding="utf-8") + added, encoding="utf-8")
    assert said in assert_refused(RigError, None, Rig.load, path)


def test_a_housing_has_no_negative_mass(tmp_path: Path):
    housing = "[[bushings]]\nhousing = {stiffness = 1e5, mass = -0.1, damping = 1.0}"
    path = tmp_path / "rig.toml"
    path.write_text(TABLE1.read_text(encoding="utf-8").replace("[[bushings]]", housing, 1), encoding="utf-8")
    assert_refused(RigError, r"bushings\[0\]\.housing\.mass must be > 0, got -0.1 \(kg", Rig.load, path)
