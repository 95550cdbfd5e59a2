"""Floquet multipliers by ways that share nothing with the package's: marched differences, and an ODE solver."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from clearance_mj import Modal, Model, periodic
from clearance_mj.clearance import ConstantLaw, ContactLaw, HuntCrossley1975
from experiments.periodic.verification import modal_state

from ..conftest import TABLE1
from .test_published import DUFFING, HARDENING, STIFFNESS, TURN, UNILATERAL


def leading(matrix, count):
    values = np.linalg.eigvals(matrix)
    return values[np.argsort(-np.abs(values))][:count]


def three_points(branch):
    """Three points next to one frequency between both folds, of which that in the middle is unstable."""
    up, down = (branch.frequency[p.index] for p in branch.special if p.kind == "fold")
    crossings = np.flatnonzero(np.diff(np.sign(branch.frequency - (up + down) / 2)))
    assert list(branch.stable[crossings]) == [True, False, True]
    return crossings


def by_differences(branch, i, after):
    """Derivative of the state after a period by that before, by central differences.

    The state is that of a branch's point, moved onto the periodic orbit by Newton's method.
    """
    order, omega = np.arange(branch.displacement.shape[2]), TURN * branch.frequency[i]
    harmonics = branch.displacement[i]
    state = np.concatenate((harmonics.real.sum(axis=1), (1j * omega * order * harmonics).real.sum(axis=1)))
    for _ in range(3):
        steps = 1e-5 * np.eye(state.size)
        monodromy = np.array([after(state + step, omega) - after(state - step, omega) for step in steps]).T / 2e-5
        state = state + np.linalg.solve(np.eye(state.size) - monodromy, after(state, omega) - state)
    return monodromy


def test_duffing_by_an_ode_solver():
    branch = periodic.follow_response(Model(DUFFING, HARDENING), 0.18, (0.9 / TURN, 1.5 / TURN), 15)

    def rate(time, state, omega):
        x, v = state
        return v, 0.18 * np.cos(omega * time) - 0.05 * v - x - 0.1 * x**3

    def after(state, omega):
        return solve_ivp(rate, (0, TURN / omega), state, "DOP853", args=(omega,), rtol=1e-10, atol=1e-12).y[:, -1]

    for i in three_points(branch):
        known = leading(by_differences(branch, i, after), 2)
        np.testing.assert_allclose(np.sort_complex(branch.multipliers[i]), np.sort_complex(known), rtol=1e-3)


@pytest.mark.parametrize("damping", [0.0, 0.5])
def test_a_one_sided_spring_by_an_ode_solver(damping):
    """A soft one, which touches for long. With damping its force begins with a jump."""
    law = ConstantLaw(3.0, damping)
    branch = periodic.follow_response(Model(UNILATERAL, law), 0.1, (0.9 / TURN, 0.5 / TURN), 41, 2048)

    def rate(time, state, omega, touching):
        x, v = state[:2], state[2:]
        stop = max(3.0 * (x[0] - 1.0) + damping * v[0], 0.0) if touching else 0.0
        force = np.array([-stop, 0.1 * np.cos(omega * time)])
        return np.concatenate((v, force - STIFFNESS @ (x + 0.03 * v)))

    def wall(time, state, omega, touching):
        return state[0] - 1.0

    wall.terminal = True

    def after(state, omega):
        time, touching = 0.0, state[0] > 1.0
        while True:
            wall.direction = -1 if touching else 1
            options = {"events": wall, "args": (omega, touching), "rtol": 1e-9, "atol": 1e-12}
            solution = solve_ivp(rate, (time, TURN / omega), state, "DOP853", **options)
            time, state = solution.t[-1], solution.y[:, -1]
            if solution.status == 0:
                return state
            touching = not touching

    for i in three_points(branch):
        known = leading(by_differences(branch, i, after), 4)
        assert abs(branch.multipliers[i, 0]) == pytest.approx(abs(known[0]), rel=5e-3)
        assert np.prod(branch.multipliers[i]) == pytest.approx(np.prod(known), rel=5e-3)


def by_march(branch, i, steps=4096):
    """The same of the modal engine's own steps, so many in a period."""
    omega = TURN * branch.frequency[i]
    excitation = np.real(branch.level[i, 0] * np.exp(1j * TURN * np.arange(steps) / steps))

    def after(state):
        run = Modal(branch.n_modes).start(branch.model.rig, branch.model.law, branch.kind, TURN / omega / steps)
        motion = run.motion
        motion.q[:], motion.v[:] = np.split(state, 2)
        run.advance(excitation)
        return np.concatenate((motion.q, motion.v))

    q, v = modal_state(branch, i)
    state, step = np.concatenate((q, v)), np.repeat(1e-4 * np.array([np.linalg.norm(q), np.linalg.norm(v)]), q.size)
    for _ in range(3):
        monodromy = np.array([(after(state + s) - after(state - s)) / (2 * s.max()) for s in np.diag(step)]).T
        state = state + np.linalg.solve(np.eye(state.size) - monodromy, after(state) - state)
    return monodromy


def test_table1_by_differences_of_marches():
    """With Hertz's contact, whose force begins without a jump: the engine's steps would hide when that comes."""
    law = ContactLaw(HuntCrossley1975(3e5, 6.75e5))
    branch = periodic.follow_response(Model(TABLE1, law), 6.0, (40, 52))
    for i in three_points(branch):
        known, multipliers = leading(by_march(branch, i), 6), branch.multipliers[i, :6]
        np.testing.assert_allclose(np.sort(np.abs(multipliers)), np.sort(np.abs(known)), rtol=5e-3)
        assert (np.abs(multipliers) > 1).sum() == (np.abs(known) > 1).sum()
