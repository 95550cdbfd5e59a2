"""Preview LQR against the Riccati equation of the augmented problem, iterated."""

import numpy as np
import pytest

from clearance_mj.vehicle.controllers import Observation, Task
from clearance_mj.vehicle.controllers.preview_lqr import PreviewRegulator
from clearance_mj.vehicle.manoeuvres import clothoid_arc, double_lane_change

from .test_controller import LINEAR, MODEL, SPEED

LAW, PERIODS = PreviewRegulator(course=0.05, effort=300.0), 20


def augmented_gain():
    """Δu = -K [x, κ_0 … κ_20]: the curvature moves up by one place in a period and its last value stays."""
    A6, B6, E6 = MODEL.discrete
    n, N = 7, PERIODS + 1
    A, B = np.zeros((n + N, n + N)), np.zeros(n + N)
    A[:6, :6], A[:6, 6], A[6, 6], A[:6, n] = A6, B6, 1.0, E6
    A[n : n + N, n : n + N] = np.eye(N, k=1)
    A[-1, -1] = 1.0
    B[:6], B[6] = B6, 1.0
    C = np.zeros((2, n + N))
    C[0, 0], C[1, 1:3] = 1.0, (SPEED, 1.0)
    Q = C.T @ np.diag((1.0, LAW.course)) @ C
    P = np.zeros_like(A)
    for _ in range(3000):  # 30 s
        K = (B @ P @ A) / (LAW.effort + B @ P @ B)
        P = Q + A.T @ P @ (A - np.outer(B, K))
        P = (P + P.T) / 2
    return K


PLACES = [(clothoid_arc(), 60.0), (double_lane_change(2.5), 60.0), (double_lane_change(2.5), 100.0)]


@pytest.mark.parametrize(("path", "s"), PLACES)
def test_first_command(path, s):
    seen = Observation(s, 0.03, -0.004, 0.05, 0.02, SPEED)
    task = Task(LINEAR, path, SPEED, largest_rate=10.0)
    curvature = path.curvature(s + SPEED * 0.01 * np.arange(PERIODS + 1))
    expected = -augmented_gain() @ np.array([*seen[1:5], 0, 0, 0, *curvature])
    assert LAW.start(task).command(seen) == pytest.approx(expected, rel=1e-6)
