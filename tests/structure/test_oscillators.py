"""What moves on its own on a structure, against the closed form of a dynamic absorber put to the rig without it."""

import dataclasses

import numpy as np
import pytest

from clearance_mj.beam import linear_frf
from clearance_mj.rig import Sensor, Shaker
from clearance_mj.structure.attached import FixtureMode, Oscillator, Planes

from ..conftest import TABLE1

FREQUENCY = np.linspace(5.0, 250.0, 100)
HUNG = Oscillator(TABLE1.sensors[1].position, 0.08, 120.0, 0.03)
MODES = 60


def apparent_mass(hung: Oscillator, frequency: np.ndarray) -> np.ndarray:
    """What its foot feels, kg: m (k + iωc) / (k + iωc - mω²); Den Hartog, Mechanical Vibrations, 1956, section 3.2."""
    omega, natural = 2 * np.pi * frequency, 2 * np.pi * hung.frequency
    spring = hung.mass * (natural**2 + 2j * hung.damping_ratio * natural * omega)
    return hung.mass * spring / (spring - hung.mass * omega**2)


ATTACHED = [{}, {"fixture": (FixtureMode(170.0, 0.03, 0.4, 0.1),)}, {"planes": Planes(0.05, 0.5)}]


@pytest.mark.parametrize("changes", ATTACHED, ids=str)
@pytest.mark.parametrize("kind", ["base", "force"])
def test_it_answers_with_its_apparent_mass(kind: str, changes: dict) -> None:
    rig = TABLE1.replace(**changes)
    if kind == "force":
        rig = rig.replace(shaker=Shaker(kind="force", position=0.9))
    from_there = rig.replace(shaker=Shaker(kind="force", position=HUNG.position))
    free, pulled = (linear_frf(r, FREQUENCY, MODES) for r in (rig, from_there))
    force = -apparent_mass(HUNG, FREQUENCY) * free[1] / (1 + apparent_mass(HUNG, FREQUENCY) * pulled[1])
    expected = free + pulled * force
    frf = linear_frf(rig.replace(oscillators=(HUNG,)), FREQUENCY, MODES)
    assert np.abs(frf - expected).max() < 1e-3 * np.abs(expected).max()
    assert np.abs(frf - free).max() > 0.05 * np.abs(free).max()


@pytest.mark.parametrize("fixture", [(), (FixtureMode(170.0, 0.03, 0.4, 1.5),)], ids=["rigid base", "rocking base"])
def test_an_arm_feels_the_slope_where_it_is_fixed(fixture: tuple) -> None:
    """The same absorber under the motion of its arm's end: deflection and slope from two points without it."""
    x, lever, apart = HUNG.position, -0.15, 1e-3 * HUNG.position
    hung = dataclasses.replace(HUNG, lever=lever)
    points = (x, x - apart)
    rig = TABLE1.replace(sensors=tuple(Sensor(i + 1, p) for i, p in enumerate(points)), masses=(), fixture=fixture)
    arm = np.array([1 + lever / apart, -lever / apart])
    pulls = [Shaker(kind="force", position=p) for p in points]
    free = linear_frf(rig, FREQUENCY, MODES)
    pulled = np.stack([linear_frf(rig.replace(shaker=s), FREQUENCY, MODES) for s in pulls], axis=1)
    mass = apparent_mass(hung, FREQUENCY)
    force = -mass * (arm @ free) / (1 + mass * np.einsum("p,pqf,q->f", arm, pulled, arm))
    expected = free + np.einsum("pqf,q,f->pf", pulled, arm, force)
    frf = linear_frf(rig.replace(oscillators=(hung,)), FREQUENCY, MODES)
    assert np.abs(frf - expected).max() < 5e-3 * np.abs(expected).max()
    without = linear_frf(rig.replace(oscillators=(HUNG,)), FREQUENCY, MODES)
    assert np.abs(frf - without).max() > np.abs(free).max() / 20
