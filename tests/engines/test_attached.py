"""Simulations of rigs with what they stand on and have beside them: energy is conserved, engines agree or refuse."""

import dataclasses

import pytest

import clearance_mj as cm
from clearance_mj.core.errors import RigError
from clearance_mj.signals import excitation
from clearance_mj.structure import Spring
from clearance_mj.structure.attached import FixtureMode, Housing, Oscillator, Planes
from clearance_mj.structure.beam import Clamp

from ..conftest import TABLE1
from .alike import with_bushings

PUSH = excitation.random(1.0, 2048.0, (5.0, 200.0), rms=3.0, seed=1)
MOVING_CLAMP = dataclasses.replace(TABLE1.beam, clamp=Clamp(translation=2e6, mass=0.4, translation_damping=30.0))
RIGS = {
    "housings": with_bushings(TABLE1, housing=Housing(2e5, 0.15, 10.0)),
    "fixture": TABLE1.replace(fixture=(FixtureMode(170.0, 0.03, 0.4, 0.1),)),
    "springs": TABLE1.replace(springs=(Spring(0.6, 800.0, damping=1.0),)),
    "planes": TABLE1.replace(planes=Planes(0.03, 0.5)),
    "oscillators": TABLE1.replace(oscillators=(Oscillator(0.6, 0.05, 120.0, 0.03),)),
    "clamp": TABLE1.replace(beam=MOVING_CLAMP),
}
FIELDS = {"housings": "bushings.housing", "fixture": "fixture", "planes": "planes", "oscillators": "oscillators"}
"""What engine links does not run"""


@pytest.mark.parametrize("name", RIGS)
def test_no_energy_is_lost_or_won(name):
    """Of a rig without any of it 8e-6."""
    assert cm.energy_balance(RIGS[name], PUSH, engine="modal").imbalance < 5e-5


@pytest.mark.parametrize("name", RIGS)
def test_links_runs_it_or_names_what_it_cannot(name):
    if name in FIELDS:
        with pytest.raises(RigError, match=f"links knows no {FIELDS[name]}; use modal"):
            cm.simulate(RIGS[name], PUSH, engine="links")
        assert cm.simulate(RIGS[name], PUSH).provenance["engine"] == "modal"
    else:
        links, modal = (cm.simulate(RIGS[name], PUSH, engine=engine) for engine in ("links", "modal"))
        assert links.acceleration.std() == pytest.approx(modal.acceleration.std(), rel=1e-2)
