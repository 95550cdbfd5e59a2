"""Structures made of FRFs, against the closed-form modes of the cantilever that the FRFs are made of."""

import dataclasses

import numpy as np
import pytest

from clearance_mj import FRF, RecordError, rmse_db
from clearance_mj.structure import modes_from_frf
from clearance_mj.structure.beam import cantilever_mode, cantilever_roots, static_deflection

from ..conftest import TABLE1
from ..refusals import assert_refused

BEAM = TABLE1.beam
X = np.array([0.25, 0.5, 0.75, 1.0])
LABELS = ("1:+Z", "2:-Z", "3:+Z", "4:+Z")
SIGNS = np.array([1.0, -1.0, 1.0, 1.0])
ZETA = 0.01
FREQUENCY = np.arange(2.0, 250.0, 0.25)
OMEGA = cantilever_roots(30) ** 2 * np.sqrt(BEAM.bending_stiffness / BEAM.mass_per_length) / BEAM.length**2
SHAPES = cantilever_mode(X, 30, BEAM.length) / np.sqrt(BEAM.mass_per_length * BEAM.length)


def frf(references=(3,), noise=0.0, quantity="acceleration/force"):
    """Thirty closed-form modes of the cantilever at four positions, one of them measured upside down."""
    w = 2 * np.pi * FREQUENCY
    receptance = 1 / (OMEGA[:, None] ** 2 - w**2 + 2j * ZETA * OMEGA[:, None] * w)
    value = np.einsum("om,rm,mf->orf", SHAPES, SHAPES[list(references)], receptance)
    value *= (SIGNS[:, None] * SIGNS[list(references)])[..., None]
    value *= (1j * w) ** {"displacement": 0, "velocity": 1, "acceleration": 2}[quantity.split("/")[0]]
    rng = np.random.default_rng(0)
    scale = noise * np.abs(value).mean() / np.sqrt(2)
    value = value + scale * (rng.standard_normal(value.shape) + 1j * rng.standard_normal(value.shape))
    return FRF(FREQUENCY, value, None, LABELS, tuple(LABELS[r] for r in references), quantity)


def aligned(structure):
    """Shapes (n_dofs, n) along +Z, each with the sign that the closed form has."""
    shapes = structure.unit_shapes
    return shapes * np.sign(np.sum(shapes * SHAPES[:, : shapes.shape[1]], axis=0))


@pytest.mark.parametrize(
    ("references", "noise", "close"),
    [((3,), 0.0, 5e-3), ((1, 3), 0.0, 5e-3), ((1, 3), 0.01, 1e-2)],
    ids=["one reference", "two references", "two references and noise"],
)
def test_shapes_of_unit_modal_mass(references, noise, close):
    """Frequencies, damping and shapes of the four modes in the band, and what is synthesised without the noise.

    The reference 2:-Z pushes downwards.
    """
    modal = modes_from_frf(frf(references, noise))
    structure = modal.structure
    assert structure.dofs == ("1:+Z", "2:+Z", "3:+Z", "4:+Z") and not modal.left_out
    assert len(structure.frequencies) == 4
    np.testing.assert_allclose(structure.frequencies, OMEGA[:4] / (2 * np.pi), rtol=1e-3)
    np.testing.assert_allclose(structure.ratios, ZETA, rtol=0.05)
    assert np.abs(aligned(structure) - SHAPES[:, :4]).max() < close * np.abs(SHAPES).max()
    assert modal.collinearity.min() > 0.99 and modal.frac.min() > 0.99
    assert rmse_db(frf(references).functions, modal.synthesised.functions).max() < 0.7


def test_residual_flexibility_of_the_modes_above_the_band():
    """What four modes leave of Roark's static deflection at the driving point at mid-span, within a tenth."""
    structure = modes_from_frf(frf((1,))).structure
    kept, rest = structure.flexibility(["2:+Z"])
    exact = static_deflection(BEAM, X[1:2], X[1:2])[0, 0]
    assert structure.residual_dofs == ("2:+Z",)
    assert rest[0, 0] == pytest.approx(exact - np.sum(SHAPES[1, :4] ** 2 / OMEGA[:4] ** 2), rel=0.1)
    assert kept[0, 0] + rest[0, 0] == pytest.approx(exact, rel=1e-3)


def test_modes_below_the_band():
    """From 20 Hz on, the first mode is a mass to the FRFs; the structure has a mode below the band for it."""
    modal = modes_from_frf(frf((3,)), band=(20.0, 250.0))
    assert modal.below == 1 and modal.structure.frequencies[0] < 20.0
    np.testing.assert_allclose(modal.structure.frequencies[1:], OMEGA[1:4] / (2 * np.pi), rtol=1e-3)
    assert modal.frac.min() > 0.99


def test_receptance_and_poles_of_another_program():
    """sdypy-EMA's nat_freq and nat_xi, say; receptance is turned into accelerance."""
    poles = OMEGA[:4] / (2 * np.pi), np.full(4, ZETA)
    modal = modes_from_frf(frf((3,), quantity="displacement/force"), poles=poles)
    assert np.abs(aligned(modal.structure) - SHAPES[:, :4]).max() < 5e-3 * np.abs(SHAPES).max()


def test_driving_point_with_another_name():
    renamed = dataclasses.replace(frf((3,)), references=("200:+Z",))
    words = r"no response is where a force acts \(200:\+Z\).*measure a driving point"
    assert_refused(RecordError, words, modes_from_frf, renamed)
    modal = modes_from_frf(renamed, driving_points={"200:+Z": "4:+Z"})
    np.testing.assert_array_equal(modal.structure.unit_shapes, modes_from_frf(frf((3,))).structure.unit_shapes)


def test_what_cannot_be_a_structure():
    of_base = dataclasses.replace(frf(), quantity="acceleration/acceleration")
    words = '"acceleration/acceleration"; modes of unit mass need "acceleration/force"'
    assert_refused(RecordError, words, modes_from_frf, of_base)
    value = frf().value.copy()
    value[1, 0, 8] = np.nan
    holed, poles = dataclasses.replace(frf(), value=value), ([6.0], [0.01])
    assert_refused(RecordError, "the FRF is not finite at 4 Hz", modes_from_frf, holed, poles=poles)
    upside_down = dataclasses.replace(frf(), value=-frf().value)
    assert_refused(RecordError, "negative mass; check the directions", modes_from_frf, upside_down)


def test_figure_shows_every_function():
    figure = modes_from_frf(frf((1, 3))).figure()
    titles = [ax.get_title() for ax in figure.axes]
    assert len(titles) == 9 and titles[0].startswith("1:+Z/2:-Z: FRAC 1.0")
    assert figure.axes[6].get_xlabel() == "frequency (Hz)" and figure.axes[0].get_ylabel() == "accelerance (m/s²/N)"
