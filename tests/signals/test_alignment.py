"""FRFs from different places: closed forms converted, turned and interpolated."""

import dataclasses

import numpy as np
import pytest

from clearance_mj.core.errors import RecordError
from clearance_mj.signals import FRF, accelerance, align, convert_quantity

from ..refusals import assert_refused

LINES = np.arange(5.0, 100.0, 0.5)
DOFS = ("1:+Z", "2:+Z", "3:+Z")


def oscillator(quantity="displacement/force", frequency=LINES, responses=DOFS, **fields):
    """Receptance 1 / (k - m ω² + j c ω), mobility and accelerance by jω; each response a multiple of it."""
    omega = 2 * np.pi * frequency
    receptance = 1 / (4e4 - 1.0 * omega**2 + 20j * omega)
    power = {"displacement": 0, "velocity": 1, "acceleration": 2}[quantity.split("/")[0]]
    value = (1j * omega) ** power * receptance * np.arange(1, len(responses) + 1)[:, None]
    return FRF(frequency, value, None, responses, ("200:+Z",), quantity, **fields)


QUANTITIES = [f"{q}/force" for q in ("displacement", "velocity", "acceleration")]


@pytest.mark.parametrize("given", QUANTITIES)
@pytest.mark.parametrize("wanted", QUANTITIES)
def test_receptance_mobility_accelerance(given, wanted):
    got = convert_quantity(oscillator(given), wanted)
    np.testing.assert_allclose(got.value, oscillator(wanted).value, rtol=1e-13)
    assert got.quantity == wanted


def test_transmissibility_of_displacements_is_that_of_accelerations():
    frf = dataclasses.replace(oscillator(), quantity="displacement/displacement")
    np.testing.assert_array_equal(accelerance(frf).value, frf.value)
    relative = dataclasses.replace(oscillator(), quantity="displacement/acceleration")
    np.testing.assert_allclose(accelerance(relative).value, -((2 * np.pi * LINES) ** 2) * frf.value, rtol=1e-13)


def test_no_division_by_zero_hertz():
    frf = oscillator("acceleration/force", np.arange(0.0, 10.0))
    assert convert_quantity(frf, "displacement/force").frequency[0] == 1.0
    assert align(frf, frf).test.frequency[0] == 1.0


@pytest.mark.parametrize("wanted", ["acceleration/acceleration", "force/force", "acceleration"])
def test_quantities_that_no_power_of_jw_connects(wanted):
    assert_refused(RecordError, r"cannot be (made|converted)", convert_quantity, oscillator(), wanted)


def test_the_same_functions_measured_differently_are_the_same():
    """Receptances, other order, one sensor and the reference the other way round, lines of half the distance."""
    test = oscillator("acceleration/force")
    model = oscillator(frequency=np.arange(4.0, 120.0, 0.25), responses=("1:+Z", "2:+Z", "3:-Z"))
    turned, order = model.value * [[[-1]], [[-1]], [[1]]], [2, 0, 1]
    responses = tuple(model.responses[i] for i in order)
    model = dataclasses.replace(model, value=turned[order], responses=responses, references=("200:-Z",))
    got = align(test, model)
    assert (got.model.responses, got.model.reference, got.model.quantity) == (DOFS, "200:+Z", "acceleration/force")
    np.testing.assert_array_equal(got.test.value, test.value)
    np.testing.assert_array_equal(got.model.frequency, LINES)
    np.testing.assert_allclose(got.model.value, test.value, rtol=1e-9)  # its lines are among the model's
    said = "\n".join(got.notes)
    for part in ("converted to the test's", "200:-Z to 200:+Z", "3:-Z to 3:+Z", "5 to 99.5 Hz", "interpolated onto"):
        assert part in said


def test_interpolation_between_lines_is_of_fourth_order():
    test = oscillator(frequency=np.arange(10.123, 90.0, 0.7317))

    def error(spacing):
        model = oscillator(frequency=np.arange(5.0, 100.0, spacing))
        return np.abs(align(test, model).model.value / test.value - 1).max()

    assert error(0.1) < 1e-4 and error(0.1) / error(0.05) > 12


def test_the_coarser_grid_wins_whoever_has_it_and_coherence_comes_along():
    fine = oscillator(frequency=np.arange(5.0, 100.0, 0.25))
    fine = dataclasses.replace(fine, coherence=np.full(fine.value.shape, 0.75))
    got = align(fine, oscillator())
    np.testing.assert_array_equal(got.test.frequency, LINES[LINES <= 99.75])
    np.testing.assert_allclose(got.test.coherence, 0.75)
    assert "the test's lines (379, 0.25 Hz apart) are interpolated" in got.notes[-1]


def test_nothing_is_extrapolated():
    got = align(oscillator(), oscillator(frequency=np.arange(20.0, 50.0, 0.1)))
    assert (got.test.frequency[0], got.test.frequency[-1]) == (20.0, 49.5)
    with pytest.raises(RecordError, match=r"bands do not overlap: .* 5 to 99\.5 Hz, the model 200 to 299 Hz"):
        align(oscillator(), oscillator(frequency=np.arange(200.0, 300.0)))


def test_lines_of_six_digits_are_the_same_lines():
    lines = np.arange(5.0, 100.0, 1 / 3)
    got = align(oscillator(frequency=lines), oscillator(frequency=lines * (1 + 5e-7)))
    assert got.notes == ()
    np.testing.assert_array_equal(got.model.frequency, lines)


def test_responses_without_a_partner_are_named():
    got = align(oscillator(), oscillator(responses=("1:+Z", "3:+Y", "7:+Z")))
    assert (got.test.responses, got.only_test, got.only_model) == (("1:+Z",), DOFS[1:], ("3:+Y", "7:+Z"))


@pytest.mark.parametrize(("changes", "part"), [
    ({"references": ("5:+Z",)}, r"no reference is common; the test has 200:\+Z, the model 5:\+Z"),
    ({"references": ("200:+X",)}, "no reference is common"),
    ({"responses": ("1:+X", "2:S", "30:+Z")}, r"no response is common; the test has 1:\+Z"),
    ({"quantity": "acceleration/acceleration"}, "over a motion"),
])  # fmt: skip
def test_functions_that_cannot_be_compared(changes, part):
    assert_refused(RecordError, part, align, oscillator(), dataclasses.replace(oscillator(), **changes))


def test_a_hole_is_not_interpolated_over():
    model = oscillator(frequency=np.arange(5.0, 100.0, 0.25))
    value = model.value.copy()
    value[1, 0, 40] = np.nan
    assert_refused(RecordError, "not finite at 15 Hz", align, oscillator(), dataclasses.replace(model, value=value))


# Several references


def driven(factors, responses=DOFS, **fields):
    """Oscillators to several references, each a multiple of the first."""
    frf = oscillator("acceleration/force", responses=responses)
    value = frf.value * np.array([*factors.values()])[:, None]
    return dataclasses.replace(frf, value=value, references=tuple(factors), **fields)


BOTH = driven({"1:+Z": 1.0, "5:+Z": 2.0})


def test_responses_and_references_are_aligned_each_for_itself():
    """Order, the direction of one hammer and of one sensor differ; each side has a reference of its own."""
    test = driven({"1:+Z": 1.0, "5:+Z": 2.0, "9:+X": 4.0})
    model = driven({"5:-Z": -2.0, "8:+Z": 5.0, "1:+Z": 1.0}, ("3:+Z", "1:-Z"))
    model = dataclasses.replace(model, value=model.value * [[[3.0]], [[-0.5]]])
    got = align(test, model)
    assert got.model.responses == got.test.responses == ("1:+Z", "3:+Z")
    assert got.model.references == got.test.references == ("1:+Z", "5:+Z")
    np.testing.assert_allclose(got.model.value, got.test.value, rtol=1e-14)
    assert got.only_test == ("2:+Z/1:+Z", "2:+Z/5:+Z", "1:+Z/9:+X", "2:+Z/9:+X", "3:+Z/9:+X")
    assert got.only_model == ("3:+Z/8:+Z", "1:-Z/8:+Z")
    turned = ("references", 5), ("responses", 1)
    assert got.notes == tuple(f"the model's {what} are turned: {i}:-Z to {i}:+Z" for what, i in turned)


def test_one_reference_of_several():
    got = align(driven({"5:+Z": 2.0}), BOTH)
    assert (got.test.responses, got.model.reference) == (DOFS, "5:+Z")
    np.testing.assert_array_equal(got.test.value, got.model.value)


def test_pairs_that_one_side_has_not_measured_are_left_out_of_both():
    """Also from the interpolation: the model has twice as many lines."""
    holed = BOTH.value.copy()
    holed[0, 1] = np.nan
    fine = oscillator("acceleration/force", np.arange(5.0, 100.0, 0.25))
    model = dataclasses.replace(fine, value=fine.value * [[1.0], [2.0]], references=("1:+Z", "5:+Z"))
    got = align(dataclasses.replace(BOTH, value=holed), model)
    assert got.test.labels == got.model.labels == ("1:+Z/1:+Z", "2:+Z/1:+Z", "3:+Z/1:+Z", "2:+Z/5:+Z", "3:+Z/5:+Z")
    assert (got.only_test, got.only_model) == ((), ("1:+Z/5:+Z",))
    np.testing.assert_allclose(got.model.functions, got.test.functions, rtol=1e-9)


def test_coherence_of_one_reference_only():
    coherence = np.broadcast_to(np.array([np.nan, 0.9])[:, None], BOTH.value.shape)
    got = align(dataclasses.replace(BOTH, coherence=coherence), BOTH).test.coherence
    assert np.isnan(got[:, 0]).all() and (got[:, 1] == 0.9).all()


def test_no_common_pair():
    with pytest.raises(RecordError, match=r"no reference is common; the test has 1:\+Z, 5:\+Z, the model 2:\+Z"):
        align(BOTH, driven({"2:+Z": 1.0}))
    holes = np.where(np.array([[True, False]] * 3)[:, :, None], BOTH.value, np.nan)
    with pytest.raises(RecordError, match="no pair of response and reference is common"):
        align(dataclasses.replace(BOTH, value=holes), driven({"5:+Z": 2.0}))
