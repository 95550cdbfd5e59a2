"""Energy balance of structures with pins, springs, dashpots, relative clearances, or nothing that holds them."""

import dataclasses

import numpy as np
import pytest

from clearance_mj.clearance import ConstantLaw
from clearance_mj.engines import Links, Modal, simulate
from clearance_mj.engines.energy import energy_balance
from clearance_mj.rig import Friction, Spin, Unbalance
from clearance_mj.signals.excitation import random

from ..conftest import TABLE1
from ..structures import chain, stepped, two_shafts
from .alike import with_bushings

LAW = ConstantLaw(8e3, 5.0)


def free():
    """The stepped shaft without supports: its grease alone carries it."""
    return supported()


def supported(*supports):
    rig = stepped()
    return rig.replace(structure=dataclasses.replace(rig.structure, supports=supports))


def damped(dashpot):
    """The stepped shaft with another dashpot (N s/m) under it."""
    first, spring, last = stepped().structure.supports
    return supported(first, dataclasses.replace(spring, translation_damping=dashpot), last)


@pytest.mark.parametrize("make", [stepped, two_shafts, chain, free])
def test_energy_is_balanced(make, measured):
    balance = energy_balance(make(), random(1.0, 2048.0, rms=6.0, seed=3), LAW, "modal")
    assert np.abs(balance.response.contact_force).max(axis=1).min() > 0.5
    assert balance.damping[-1] > 0 and len(balance.impacts) > 10
    measured.below(f"{make.__name__}, modal: imbalance", balance.imbalance, 1e-3, "conservation of energy")


def test_energy_of_links_in_space_is_balanced(measured):
    """A turning shaft that rubs: the balance closes, and what is put in and lost is that of the modal engine."""
    rig, noise = TABLE1.with_shape("round"), random(0.5, 2048.0, rms=6.0, seed=3)
    rig = with_bushings(rig, friction=Friction(0.2, damping=0.5))
    rig = rig.replace(gravity=(0.0, 0.0, -9.81), spin=Spin(100.0), unbalances=(Unbalance(0.5, 1e-5),))
    links, modal = (energy_balance(rig, noise, LAW, engine) for engine in ("links", "modal"))
    assert modal.friction is not None and modal.friction[:, -1].min() > 1e-3 and len(modal.impacts) > 10
    measured.below("rubbing shaft in space, links: imbalance", links.imbalance, 1e-3, "conservation of energy")
    for name in ("put_in", "lost", "friction", "contact_loss", "drive"):
        ends = (getattr(balance, name)[..., -1] for balance in (links, modal))
        np.testing.assert_allclose(*ends, rtol=0.02, err_msg=name)


def test_a_strong_dashpot_is_stable_and_exact(measured):
    """It couples the modes far beyond 1/step: the balance closes, and a tenth of the step changes the motion by 1 %."""
    rig, base = damped(2e4), random(1.0, 2048.0, rms=6.0, seed=3)
    balance, fine = energy_balance(rig, base, LAW, "modal"), simulate(rig, base, LAW, Modal(resolution=0.1))
    measured.below("dashpot of 2e4 N s/m, modal: imbalance", balance.imbalance, 1e-3, "conservation of energy")
    np.testing.assert_allclose(*(r.displacement.std(axis=1) for r in (balance.response, fine)), rtol=0.01)


def test_dashpots_of_links():
    """Within the gaps as the modal engine has them."""
    base = random(0.3, 2048.0, rms=0.05, seed=3)
    computed, expected = (simulate(damped(200.0), base, LAW, engine).displacement for engine in (Links(40), "modal"))
    assert np.abs(computed - expected).max() < 0.006 * np.abs(expected).max()
