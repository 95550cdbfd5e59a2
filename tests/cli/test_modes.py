"""clearance-mj modes: FRFs to a structure that a rig file can name; simulate says what its truncation costs."""

import dataclasses
import json

import numpy as np
import pytest
import pyuff

from clearance_mj import Contact, Rig, write_uff

from ..structure.test_measured import OMEGA, frf
from ..structure.test_modes import cantilever, normal_modes, rig_of


def test_structure_of_a_universal_file(tmp_path, answer):
    """Two files, one for each reference; the closed-form frequencies come back, and a rig file takes the table."""
    for i, reference in enumerate((1, 3)):
        write_uff(tmp_path / f"{i}.uff", frf((reference,)))
    out = tmp_path / "found"
    result = answer("modes", tmp_path / "0.uff", tmp_path / "1.uff", "--out", out)
    np.testing.assert_allclose(result["frequency"], OMEGA[:4] / (2 * np.pi), rtol=1e-3)
    assert len(result["functions"]) == 8 and min(f["frac"] for f in result["functions"]) > 0.99
    assert json.loads((out / "modes.json").read_text()) == result
    assert (out / "synthesis.png").stat().st_size > 10_000
    rig_of(cantilever()).save(tmp_path / "whole.toml")
    text = (tmp_path / "whole.toml").read_text().partition("[structure]")[0]
    (tmp_path / "rig.toml").write_text(text + '[structure]\nkind = "modes"\nfile = "found/modes.csv"\n')
    assert Rig.load(tmp_path / "rig.toml").structure.dofs == ("1:+Z", "2:+Z", "3:+Z", "4:+Z")


@pytest.mark.parametrize("more, message", [
    (["--driving-point", "4:+Z"], "needs REFERENCE=DOF"),
    (["--driving-point", "5:+Z=4:+Z"], "driving point of 5:+Z: the FRFs are to 4:+Z"),
    (["--driving-point", "4:+Z=9:+Z"], "no response is where a force acts (9:+Z)"),
    (["--band", "2", "3"], "modes need at least 18 lines"),
])  # fmt: skip
def test_refusals(tmp_path, refused, more, message):
    write_uff(tmp_path / "h.uff", frf())
    said = refused("modes", tmp_path / "h.uff", "--out", tmp_path / "found", *more)
    assert message in said and said.count("\n") == 1 and not (tmp_path / "found").exists()


def test_simulate_says_what_truncation_costs(tmp_path, output_of):
    """One line where a contact of 80 kN/m is too stiff by more than 3 %; none where more modes are known."""
    for n, lines in ((3, 1), (12, 0)):
        rig = rig_of(cantilever(n))
        stiff = dataclasses.replace(rig.bushings[0], contact=Contact(8e4, 4.0))
        rig.replace(bushings=(stiff,)).save(tmp_path / "rig.toml")
        arguments = ["simulate", str(tmp_path / "rig.toml"), "--engine", "modal", "--duration", "0.1"]
        assert output_of(*arguments, "--out", tmp_path / "r.nc").err.count("the modes lack flexibility there") == lines


def test_what_a_file_of_modes_does_not_say(tmp_path, output_of):
    """No units (data set 164): one line, of the command."""
    sets = list(normal_modes(cantilever(), 55))
    pyuff.UFF(str(tmp_path / "modes.uff")).write_sets(sets, "overwrite")
    rig_of(cantilever()).save(tmp_path / "whole.toml")
    text = (tmp_path / "whole.toml").read_text().partition("[structure]")[0]
    (tmp_path / "rig.toml").write_text(text + '[structure]\nkind = "modes"\nfile = "modes.uff"\n')
    arguments = ["simulate", str(tmp_path / "rig.toml"), "--engine", "modal", "--duration", "0.1"]
    said = output_of(*arguments, "--out", tmp_path / "r.nc").err
    assert said == f"clearance-mj: warning: {tmp_path / 'modes.uff'}: has no units (data set 164); taken for SI\n"
