"""Model predictive control: linear time-varying prediction, quadratic cost, limits of angle and rate, OSQP.

States are those of the design model and the command, x = [e_y, e_ψ, v_y, r, δ, dδ/dt, u]; the input is the change of
the command, Δu. Over N periods

    min Σ q_e e_y² + q_c (de_y/dt)² + q_r (r - vκ)² + q_u Δu² + V(x_N),   |u| ≤ u_max, |Δu| ≤ rate · period,

with V the infinite-horizon cost of the same weights without limits (discrete-time LQR) about the steady turn of the
last known curvature. The matrices are renewed when the speed has changed, on one sparsity pattern.

Stellato et al., OSQP: an operator splitting solver for quadratic programs, Mathematical Programming Computation 12,
2020.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import control
import numpy as np
import osqp
import scipy.sparse

from .base import Controller, Observation, Task
from .clearance_model import PRIOR, with_clearance_model
from .design import DesignModel, ModelRun
from .registry import Registration, register

__all__ = ["ModelPredictive"]

RENEW = 0.01
"""Relative change of speed after which the model is linearised anew"""
N_STATES = 7


class Program(NamedTuple):
    """The quadratic program min ½ zᵀ P z + qᵀ z, l ≤ A z ≤ u of z = [x_0 … x_N, Δu_0 … Δu_N-1] at one speed.

    q = W κ, and the first (N+1) 7 rows of l and u are [-x_0, -E κ_0, … -E κ_N-1].
    """

    P: scipy.sparse.csc_matrix  # upper triangle
    A: scipy.sparse.csc_matrix
    E: np.ndarray  # (7,) effect of the curvature over a period
    yaw: float  # coefficient of q at r_k, over κ_k
    terminal: np.ndarray  # (7,) coefficients of q at x_N, over κ_N


@dataclass(frozen=True)
class ModelPredictive(Controller):
    """LTV-MPC; weights are relative to that of the lateral error."""

    course: float = 0.02  # q_c, s²: of the rate of the lateral error
    yaw: float = 0.5  # q_r, m² s²/rad²: of the error of the yaw rate
    effort: float = 500.0  # q_u, m²/rad²: of the change of the command in a period
    horizon: int = 20  # N, periods

    def start(self, task: Task) -> ModelRun:
        """Begin a run."""
        return _Predictive(task, self)


def program(settings: ModelPredictive, model: DesignModel) -> Program:
    """Matrices of the program at the model's speed; their sparsity pattern does not depend on it."""
    A, B, E = _augmented(model)
    outputs = np.zeros((3, N_STATES))
    outputs[0, 0] = 1.0
    outputs[1, 1:3] = model.speed, 1.0
    outputs[2, 3] = 1.0
    weights = np.diag((1.0, settings.course, settings.yaw))
    Q, R = outputs.T @ weights @ outputs, np.array([[settings.effort]])
    _, V, _ = control.dlqr(A, B[:, None], Q, R)
    terminal = -V @ _steady_turn(model)
    N = settings.horizon
    P = scipy.sparse.block_diag([*[_stored(Q)] * N, _stored(V), settings.effort * scipy.sparse.eye_array(N)])
    return Program(
        _plain(scipy.sparse.triu(P)), _plain(_constraints(A, B, N)), E, -settings.yaw * model.speed, terminal
    )


def _augmented(model: DesignModel) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Design model with the command as a state and its change as the input."""
    A6, B6, E6 = model.discrete
    A = np.zeros((N_STATES, N_STATES))
    A[:6, :6], A[:6, 6], A[6, 6] = A6, B6, 1.0
    return A, np.append(B6, 1.0), np.append(E6, 0.0)


def _steady_turn(model: DesignModel) -> np.ndarray:
    """State of a steady turn over its curvature, (7,)."""
    A, B, E = model.continuous
    others = np.linalg.solve(np.column_stack((A[:, 1:], B)), -E)  # with e_y = 0
    return np.concatenate(([0.0], others))


def _constraints(A: np.ndarray, B: np.ndarray, N: int) -> Any:
    """Rows: the model over N periods, the commands, their changes."""
    n, states = N_STATES, N_STATES * (N + 1)
    model = scipy.sparse.hstack(
        (
            scipy.sparse.kron(scipy.sparse.eye_array(N + 1, k=-1), _stored(A)) - scipy.sparse.eye_array(states),
            scipy.sparse.kron(scipy.sparse.eye_array(N + 1, N, k=-1), _stored(B[:, None])),
        )
    )
    rows = np.arange(N)
    commands = scipy.sparse.coo_array((np.ones(N), (rows, (rows + 1) * n + 6)), shape=(N, states + N))
    changes = scipy.sparse.coo_array((np.ones(N), (rows, states + rows)), shape=(N, states + N))
    return scipy.sparse.vstack((model, commands, changes))


def _stored(block: np.ndarray) -> Any:
    """A block as a sparse array that stores its zeros too."""
    rows, columns = np.indices(block.shape)
    return scipy.sparse.coo_array((block.ravel(), (rows.ravel(), columns.ravel())), shape=block.shape)


def _plain(array: Any) -> Any:
    """As OSQP takes it: a CSC matrix with 32-bit indices."""
    matrix = scipy.sparse.csc_matrix(array)
    matrix.indices, matrix.indptr = matrix.indices.astype(np.int32), matrix.indptr.astype(np.int32)
    return matrix


class _Predictive(ModelRun):
    def __init__(self, task: Task, settings: ModelPredictive):
        super().__init__(task)
        self._settings, N = settings, settings.horizon
        self._ahead = np.arange(N + 1) * task.period
        self._linearised = task.speed
        self._program = program(settings, self.model)
        states = N_STATES * (N + 1)
        self._yaw_at = np.arange(N) * N_STATES + 3
        self._q = np.zeros(states + N)
        steer, change = np.full(N, task.largest_angle), np.full(N, task.largest_rate * task.period)
        self._upper = np.concatenate((np.zeros(states), steer, change))
        self._lower = -self._upper
        self._n_states = states
        self._solver = osqp.OSQP()
        self._solver.setup(
            self._program.P, self._q, self._program.A, self._lower, self._upper,
            verbose=False, warm_starting=True, rho=1.0, eps_abs=1e-5, eps_rel=1e-5, check_termination=5,
        )  # fmt: skip

    def wheel_angle(self, seen: Observation) -> float:
        if abs(seen.speed / self._linearised - 1) > RENEW:
            self._linearise(seen.speed)
        curvature = self.task.curvature(seen, self._ahead)
        N, n, now = self._settings.horizon, N_STATES, self._n_states
        self._q[self._yaw_at] = self._program.yaw * curvature[:N]
        self._q[n * N : now] = self._program.terminal * curvature[N]
        self._lower[:6] = -self.predictor.state(seen)
        self._lower[6] = -self.predictor.last
        self._lower[n:now] = -np.outer(curvature[:N], self._program.E).ravel()
        self._upper[:now] = self._lower[:now]
        self._solver.update(q=self._q, l=self._lower, u=self._upper)
        found = self._solver.solve(raise_error=False)
        # Only commands are limited, so that a solution exists; the last iterate is good should it be cut short.
        return self.predictor.last + float(found.x[now])

    def _linearise(self, speed: float) -> None:
        self._linearised = speed
        task = self.task
        self._program = program(self._settings, DesignModel(task.vehicle, task.servo, speed, task.period))
        self._solver.update(Px=self._program.P.data, Ax=self._program.A.data)


DASHED = (0, (4, 1.5))
BOUNDS = {"course": (1e-3, 1.0), "yaw": (1e-2, 10.0), "effort": (10.0, 1e5)}
register(Registration("mpc", "MPC", ModelPredictive, bounds=BOUNDS, colour="#e69f00", line=DASHED))
register(
    Registration(
        "mpc-cm", "MPC-CM", ModelPredictive, tuned_as="mpc", adapt=with_clearance_model, prior=PRIOR, colour="#009e73",
        line=DASHED,
    )
)  # fmt: skip
