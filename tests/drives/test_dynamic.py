"""Logs of fast motion: of both ends, whose torques the slow chain does not explain, and of motor and load's angle."""

import numpy as np
import pytest

from clearance_mj.core.jit import jit
from clearance_mj.drives import DriveRecord, fit_drive, fit_motor_side

PLAY, STIFFNESS, COUNT = 4.4e-3, 150.0, 2 * np.pi / 4096


@jit
def march(wanted, fine):
    """Motor and pendulum with play and teeth between, under a PD loop: angles and torques (n, 4), Euler at 2e-5 s."""
    out = np.empty((wanted.size, 4))
    x_m, v_m, x_l, v_l, bristle, before = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    h = 1e-3 / fine
    for i in range(wanted.size):
        seen = np.round(x_l / COUNT) * COUNT
        torque = min(max(12.0 * (wanted[i] - seen) - 0.25 * (seen - before) * 1e3, -2.5), 2.5)
        before = seen
        for j in range(fine):
            lag, rate = x_m - x_l, v_m - v_l
            teeth = 0.0
            if lag > PLAY:
                teeth = max(STIFFNESS * (lag - PLAY) + 0.3 * rate, 0.0)
            elif lag < -PLAY:
                teeth = min(STIFFNESS * (lag + PLAY) + 0.3 * rate, 0.0)
            if j == 0:
                out[i] = x_m, torque, x_l, teeth
            bristle = min(max(bristle + h * v_m, -5e-5), 5e-5)
            v_m += h * (torque - teeth - 2e3 * bristle - 0.08 * v_m) / 0.012
            v_l += h * (teeth - 0.35 * np.sin(x_l) - 0.01 * v_l) / 0.012
            x_m += h * v_m
            x_l += h * v_l
    return out


@pytest.fixture(scope="module")
def runs():
    time, records = np.arange(10000) * 1e-3, []
    for seed in range(2):
        rng = np.random.default_rng(seed)
        wanted = np.repeat(rng.uniform(-0.25, 0.25, 13), 800)[: time.size]
        for a, f in ((0.36, 0.23), (0.18, 0.61), (0.09, 1.37), (0.036, 2.9)):
            wanted = wanted + a * np.sin(2 * np.pi * f * time + rng.uniform(0, 6.28))
        states = march(wanted, 50)
        states[:, [0, 2]] = COUNT * np.round(states[:, [0, 2]] / COUNT)
        records.append(DriveRecord(f"run {seed}", 1000.0, *states.T))
    return records


def test_both_ends_of_fast_motion_are_not_told(runs):
    fit = fit_drive(runs, parts=("backlash", "inertia"))
    assert fit.unexplained > 0.25
    assert "efficiency, stiffness, friction and play are not told by these runs" in fit.not_told[0]


@pytest.mark.slow
def test_the_load_angle_tells_play_and_stiffness(runs):
    """Without the load's torque; both within what is asked, as is the efficiency of teeth without loss."""
    fit = fit_motor_side([DriveRecord(r.name, r.fs, r.motor_angle, r.motor_torque, r.load_angle) for r in runs])
    assert fit.values["play"] == pytest.approx(PLAY, rel=0.03)
    assert fit.values["stiffness"] == pytest.approx(STIFFNESS, rel=0.1)
    assert fit.values["efficiency"] == pytest.approx(1.0, abs=0.03)
    assert fit.values["ratio"] == pytest.approx(1.0, rel=1e-3)
    assert not any(words.startswith(("play", "stiffness", "efficiency")) for words in fit.not_told)
