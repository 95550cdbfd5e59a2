"""Structures with joints that slip, from records of a frame marched by other means: Bouc-Wen, Runge-Kutta."""

import dataclasses

import numpy as np
import pytest

import clearance_mj as cm
from clearance_mj import Excitation, RecordError, Response, mac
from clearance_mj.core.jit import jit
from clearance_mj.structure import ModalStructure
from experiments.joints.jointed_structure import fit_jointed_structure

from ...refusals import assert_refused

FREQUENCY, RATIOS = np.array([3.0, 4.6, 7.3]), np.array([0.012, 0.01, 0.015])
SHAPES = np.array([[0.05, 0.06, 0.04], [0.07, -0.05, 0.06], [0.06, -0.02, -0.08]])
JOINT = np.array([0.01, 0.03, -0.012])
STIFFNESS, YIELD = 5e4, 1.5e-4  # N/m and m of the Bouc-Wen joint, which slides smoothly, as no Jenkins elements do
PERIOD, FS, FINE = 20.48, 50.0, 8
LEVELS = 2.0, 6.0, 18.0
LABELS = ("1:+Z", "2:+Z", "3:+Z")


@jit
def slope(y, force, omega, ratios, shapes, joint):
    n = omega.size
    eta = joint @ y[n : 2 * n]
    z = y[2 * n] / YIELD
    out = np.empty_like(y)
    out[:n] = y[n : 2 * n]
    out[n : 2 * n] = shapes[0] * force - omega**2 * y[:n] - 2 * ratios * omega * y[n : 2 * n]
    out[n : 2 * n] -= joint * STIFFNESS * y[2 * n]
    out[2 * n] = eta - 0.5 * (abs(eta) * abs(z) * z + eta * z * z)
    return out


@jit
def march(force, step, omega, ratios, shapes, joint):
    """Accelerations by the classical Runge-Kutta method, the force linear between samples."""
    y = np.zeros(2 * omega.size + 1)
    out = np.empty((shapes.shape[0], force.size - 1))
    for i in range(force.size - 1):
        middle = 0.5 * (force[i] + force[i + 1])
        a = slope(y, force[i], omega, ratios, shapes, joint)
        out[:, i] = shapes @ a[omega.size : 2 * omega.size]
        b = slope(y + 0.5 * step * a, middle, omega, ratios, shapes, joint)
        c = slope(y + 0.5 * step * b, middle, omega, ratios, shapes, joint)
        d = slope(y + step * c, force[i + 1], omega, ratios, shapes, joint)
        y = y + step / 6 * (a + 2 * b + 2 * c + d)
    return out


def record(level: float, periods: int = 3) -> Response:
    fine = cm.excitation.multisine(PERIOD, FS * FINE, band=(2, 9), rms=level, seed=3, kind="force").value
    force = np.tile(fine, periods)
    acceleration = march(np.append(force, force[0]), 1 / (FS * FINE), 2 * np.pi * FREQUENCY, RATIOS, SHAPES, JOINT)
    return Response(FS, force[::FINE], acceleration[:, ::FINE], kind="force", band=(2, 9), responses=LABELS,
                    reference="1:+Z")  # fmt: skip


@pytest.fixture(scope="module")
def records():
    return [record(level) for level in LEVELS]


MODES = ModalStructure(tuple(1.01 * FREQUENCY), (0.015,), LABELS, tuple(map(tuple, 0.97 * SHAPES)))
"""where the search begins: as many modes as there are, none of them right"""


@pytest.fixture(scope="module")
def fit(records):
    return fit_jointed_structure(records, PERIOD, joints=[None], modes=MODES, steps=6)


def relative_error(fit, record):
    excitation = Excitation(record.excitation, FS, "force", record.band)
    missed = cm.simulate(fit.rig, excitation, fit.law, engine="modal").acceleration - record.acceleration
    last = missed.shape[1] // 2
    return np.linalg.norm(missed[:, last:], axis=1) / np.linalg.norm(record.acceleration[:, last:], axis=1)


def test_levels_that_were_fitted(fit):
    assert fit.error.max() < 0.03


def test_level_that_no_fit_saw(fit, records):
    """Between two levels over which the FRFs change by a third."""
    unseen, scaled = record(10.5), records[1].acceleration * 10.5 / LEVELS[1]
    linear = np.linalg.norm(scaled - unseen.acceleration, axis=1) / np.linalg.norm(unseen.acceleration, axis=1)
    assert relative_error(fit, unseen).max() < min(0.04, 0.2 * linear.max())


def test_deformation_of_the_joint(fit):
    """Each mode's deformation is right but for the scale of all; signs go with those of the mode."""
    *shapes, joint = np.array(fit.rig.structure.shapes)
    assert mac((joint * np.sign(shapes[0]))[:, None], JOINT[:, None]).item() > 0.98
    np.testing.assert_allclose(np.abs(shapes[0]), SHAPES[0], rtol=0.05)


def test_modes_of_the_lowest_level(records):
    """Without modes to begin with, those of the lowest level's FRFs serve, of which there are more than three."""
    fit = fit_jointed_structure(records[:2], PERIOD, joints=[None], steps=4)
    assert len(fit.linear.frequencies) > 3 and fit.error.max() < 0.05


def test_joint_between_two_responses(records):
    """A joint whose place is given is a clearance between two points; at the wrong ones it serves less well."""
    wrong = fit_jointed_structure(records[:2], PERIOD, joints=[("2:+Z", "3:+Z")], modes=MODES, steps=4)
    right = fit_jointed_structure(records[:2], PERIOD, joints=[None], modes=MODES, steps=4)
    assert wrong.rig.bushings[0].joined == ("2:+Z", "3:+Z") and wrong.cost > 4 * right.cost


@pytest.mark.parametrize(("change", "message"), [
    (lambda r: r[:1], "1 records, needs two"),
    (lambda r: [r[0], dataclasses.replace(r[1], band=(2, 8))], "of one sampling rate, band"),
    (lambda r: [dataclasses.replace(x, band=None) for x in r], "have no band"),
    (lambda r: [dataclasses.replace(x, reference="200:+Z") for x in r], "200:.Z is not among the responses 1:"),
    (lambda r: [dataclasses.replace(x, kind="base") for x in r], "and force"),
])  # fmt: skip
def test_records_that_do_not_serve(records, change, message):
    assert_refused(RecordError, message, lambda: fit_jointed_structure(change(records), PERIOD))


@pytest.mark.parametrize("options", [{"joints": []}, {"slips": 0}])
def test_joints_that_are_none(records, options):
    with pytest.raises(RecordError, match="one joint or more with one slip length or more"):
        fit_jointed_structure(records, PERIOD, **options)
