"""Model predictive control: linear time-varying prediction, quadratic cost, limits of angle and rate.

States are those of the design model and the command, x = [e_y, e_ψ, v_y, r, δ, dδ/dt, u]; the input is the change of
the command, Δu. Over N periods

    min Σ q_e e_y² + q_c (de_y/dt)² + q_r (r - vκ)² + q_u Δu² + V(x_N),   |u| ≤ u_max, |Δu| ≤ rate · period,

with V the infinite-horizon cost of the same weights without limits (discrete-time LQR) about the steady turn of the
last known curvature. The states are eliminated, so that the program is one in the N changes of the command. Without
limits its solution is linear in state, curvature ahead and lost motion ahead: a gain, computed once for a speed. Only
where that solution would exceed a limit OSQP solves the program with limits.

Stellato et al., OSQP: an operator splitting solver for quadratic programs, Mathematical Programming Computation 12,
2020.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Any, NamedTuple

import control
import numpy as np
import osqp
import scipy.linalg
import scipy.sparse

from ...core.jit import jit
from .base import Controller, Observation, Task
from .clearance_model import PRIOR, with_clearance_model
from .design import DesignModel, ModelRun
from .registry import Registration, register

__all__ = ["LimitedPlan", "ModelPredictive", "QuadraticProgram", "Weights", "program"]

SPEED_CHANGE = 0.01  # relative change of speed after which the model is linearised again
N_STATES = 7


class Weights(NamedTuple):
    """Weights of the cost, relative to that of the lateral error."""

    course: float  # q_c, s²: of the rate of the lateral error
    yaw: float  # q_r, m² s²/rad²: of the error of the yaw rate
    effort: float  # q_u, m²/rad²: of the change of the command in a period


class QuadraticProgram(NamedTuple):
    """The quadratic program of the N changes z of the command at one speed.

    The cost is (z - z*)ᵀ H (z - z*) + const, z* = S x_0 + K κ + G d, with κ_0 … κ_N the curvature ahead and d_0 … d_N-1
    the lost motion of the wheel, rad, in each period.
    """

    hessian: np.ndarray  # H, (N, N)
    state: np.ndarray  # S, (N, 7)
    curvature: np.ndarray  # K, (N, N + 1)
    lost: np.ndarray  # G, (N, N)
    terminal: np.ndarray  # V, (7, 7)

    def free(self, state: np.ndarray, last: float, curvature: np.ndarray) -> np.ndarray:
        """Return the changes of the command, rad (N,), that are best without limits and lost motion.

        State (6,) of the design model, the last command, rad, and the curvature at N + 1 periods, 1/m.
        """
        return self.state[:, :6] @ state + self.state[:, 6] * last + self.curvature @ curvature


@functools.lru_cache(maxsize=64)
def program(model: DesignModel, weights: Weights, horizon: int) -> QuadraticProgram:
    """Return the program with the states eliminated: linear least squares in z, given x_0, κ and d."""
    A, B, E, D = augmented(model)
    outputs, N = np.zeros((3, N_STATES)), horizon
    outputs[0, 0] = 1.0
    outputs[1, 1:3] = model.speed, 1.0
    outputs[2, 3] = 1.0
    roots = np.sqrt((1.0, weights.course, weights.yaw))
    Q = outputs.T @ np.diag(roots**2) @ outputs
    _, V, _ = control.dlqr(A, B[:, None], Q, np.array([[weights.effort]]))
    root_V = np.real(scipy.linalg.sqrtm(V))
    # x = M (z, x_0, κ, d), period by period; y = √weight · output.
    at_state, at_curvature, at_lost = N, N + N_STATES, 2 * N + N_STATES + 1
    M = np.zeros((N_STATES, at_lost + N))
    M[:, at_state:at_curvature] = np.eye(N_STATES)
    rows = []
    for k in range(N):
        y = outputs @ M
        y[2, at_curvature + k] -= model.speed
        rows.append(roots[:, None] * y)
        M = A @ M
        for effect, column in ((B, k), (E, at_curvature + k), (D, at_lost + k)):
            M[:, column] += effect
    M[:, at_curvature + N] -= model.steady_turn
    M[[4, 6], -1] += 1.0  # the servo leads the wheel by the last lost motion
    y = np.vstack((*rows, root_V @ M, np.sqrt(weights.effort) * np.eye(N, M.shape[1])))
    best = -np.linalg.lstsq(y[:, :N], y[:, N:])[0]
    state, curvature, lost = np.split(best, [N_STATES, N_STATES + N + 1], axis=1)
    return QuadraticProgram(y[:, :N].T @ y[:, :N], state, curvature, lost, V)


def augmented(model: DesignModel) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return the design model with the command as a state, its change as input, and D, the effect of lost motion."""
    A6, B6, E6 = model.discrete
    A, D = np.zeros((N_STATES, N_STATES)), np.zeros(N_STATES)
    A[:6, :6], A[:6, 6], A[6, 6] = A6, B6, 1.0
    continuous, _, _ = model.continuous
    motion = np.zeros((5, 5))  # of e_y, e_ψ, v_y and r under a constant wheel angle
    motion[:4, :4], motion[2:4, 4] = continuous[:4, :4], continuous[2:4, 4]
    D[:4] = scipy.linalg.expm(model.period * motion)[:4, 4]
    return A, np.append(B6, 1.0), np.append(E6, 0.0), D


@jit
def _is_within(changes: np.ndarray, command: float, step: float, largest: float) -> bool:
    """Return True if the changes of a command and the commands are within their limits."""
    for change in changes:
        command += change
        if abs(change) > step or abs(command) > largest:
            return False
    return True


class LimitedPlan:
    """Changes of the command within the limits; OSQP is called only where they are active."""

    def __init__(self, task: Task, hessian: np.ndarray):
        self._largest, self._step, self._hessian = task.largest_angle, task.largest_rate * task.period, hessian
        N = hessian.shape[0]
        self._bound = np.concatenate((np.full(N, self._step), np.full(N, self._largest)))
        self._at = np.concatenate((np.zeros(N), np.ones(N)))
        self._solver: osqp.OSQP | None = None

    def best(self, free: np.ndarray, last: float) -> np.ndarray:
        """Return the best changes, rad (N,), given those without limits and the last command, rad."""
        if _is_within(free, last, self._step, self._largest):
            return free
        q, low, high = -self._hessian @ free, -self._bound - self._at * last, self._bound - self._at * last
        if self._solver is None:
            self._solver = self._set_up(q, low, high)
        self._solver.update(q=q, l=low, u=high)
        # Only commands are limited, so that a solution exists; an early last iterate is acceptable.
        return np.asarray(self._solver.solve(raise_error=False).x)

    def clipped(self, plans: np.ndarray, last: float) -> np.ndarray:
        """Return plans, rad (..., N), each change and each command cut off at its limit."""
        commands = last + plans.cumsum(axis=-1)
        if np.abs(plans).max() <= self._step and np.abs(commands).max() <= self._largest:
            return plans
        commands = last + np.clip(plans, -self._step, self._step).cumsum(axis=-1)
        return np.diff(np.clip(commands, -self._largest, self._largest), axis=-1, prepend=last)

    def _set_up(self, q: np.ndarray, low: np.ndarray, high: np.ndarray) -> osqp.OSQP:
        N, solver = q.size, osqp.OSQP()
        rows = scipy.sparse.csc_matrix(np.vstack((np.eye(N), np.tri(N))))
        cost = scipy.sparse.csc_matrix(np.triu(self._hessian))
        settings = {"verbose": False, "warm_starting": True, "eps_abs": 1e-6, "eps_rel": 1e-6, "check_termination": 5}
        solver.setup(cost, q, rows, low, high, **settings)
        return solver


@dataclass(frozen=True)
class ModelPredictive(Controller):
    """LTV-MPC; weights are relative to that of the lateral error."""

    course: float = 0.02  # q_c, s²: of the rate of the lateral error
    yaw: float = 0.5  # q_r, m² s²/rad²: of the error of the yaw rate
    effort: float = 500.0  # q_u, m²/rad²: of the change of the command in a period
    horizon: int = 20  # N, periods

    @property
    def weights(self) -> Weights:
        """Weights of the cost."""
        return Weights(self.course, self.yaw, self.effort)

    def start(self, task: Task) -> ModelRun:
        """Begin a run."""
        return PredictiveRun(task, self.weights, self.horizon)


class PredictiveRun(ModelRun):
    """A run of MPC."""

    def __init__(self, task: Task, weights: Weights, horizon: int):
        super().__init__(task)
        self.weights, self.horizon = weights, horizon
        self._preview_times = np.arange(horizon + 1) * task.period
        self.linearise(task.speed)

    def wheel_angle(self, seen: Observation) -> float:
        """Return the first command of the best plan."""
        if abs(seen.speed / self._linearised - 1) > SPEED_CHANGE:
            self.linearise(seen.speed)
        return self.predictor.last + float(self.changes(seen)[0])

    def changes(self, seen: Observation) -> np.ndarray:
        """Return the changes of the command in the plan, rad (N,)."""
        return self.limited.best(self.free(seen, self.curvature(seen)), self.predictor.last)

    def curvature(self, seen: Observation) -> np.ndarray:
        """Return the curvature ahead, 1/m (N + 1,)."""
        return self.task.curvature(seen, self._preview_times)

    def free(self, seen: Observation, curvature: np.ndarray) -> np.ndarray:
        """Return the changes that are best without limits, rad (N,)."""
        return self.program.free(self.predictor.state(seen), self.predictor.last, curvature)

    def linearise(self, speed: float) -> None:
        """Make the program for a speed, m/s."""
        task, self._linearised = self.task, speed
        model = DesignModel(task.vehicle, task.servo, speed, task.period)
        self.program = program(model, self.weights, self.horizon)
        self.limited = LimitedPlan(task, self.program.hessian)


DASHED = (0, (4, 1.5))
BOUNDS = {"course": (1e-3, 1.0), "yaw": (1e-2, 10.0), "effort": (10.0, 1e5)}
register(Registration("mpc", "MPC", ModelPredictive, bounds=BOUNDS, colour="#e69f00", line=DASHED))
_CM: dict[str, Any] = {"bounds": BOUNDS, "tuned_as": "mpc", "adapt": with_clearance_model, "prior": PRIOR}
register(Registration("mpc-cm", "MPC-CM", ModelPredictive, colour="#009e73", line=DASHED, **_CM))
