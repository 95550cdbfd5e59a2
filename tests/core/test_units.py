"""Units in files, options and rigs: labels are put together from one table, by NIST SP 811, 2008, B.8."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from clearance_mj.cli.options import si_number_parser
from clearance_mj.core.errors import RecordError
from clearance_mj.core.units import quantity_of, ratio_factor, si_value, unit_factor

POUND_FORCE, INCH, FOOT = 4.4482216152605, 0.0254, 0.3048  # N, m and m
CUSTOMARY = {
    "force": {
        POUND_FORCE: "lbf lb lbs Lbf LBF lbs. Pounds pound pound-force",
        1e3 * POUND_FORCE: "kip kips KIP klbf",
        POUND_FORCE / 16: "oz ozf ounces",
        9.80665: "kgf",
    },
    "displacement": {INCH: "in inch inches Inches IN in.", 1e-3 * INCH: "mil mils MILS thou", FOOT: "ft feet foot"},
    "velocity": {INCH: "in/s in/sec inch/s ips IPS in·s^-1", FOOT: "ft/s ft/sec"},
    "acceleration": {
        INCH: "in/s² in/s^2 in/s2 in/sec^2 in/sec² inch/s2 in/s/s (in/s^2) in/s**2 in.s-2",
        FOOT: "ft/s² ft/s^2 ft/sec2 feet/s^2",
        9.80665: "g g's G's gs gn",
        9.80665e-3: "mg",
    },
}


LABELS = [(quantity, *each) for quantity, units in CUSTOMARY.items() for each in units.items()]


@pytest.mark.parametrize(
    "quantity, factor, label", [(*each, label) for *each, text in LABELS for label in text.split()]
)
def test_us_customary_units_of_channels(quantity, factor, label):
    assert quantity_of(label) == (quantity, pytest.approx(factor, rel=1e-12))
    assert unit_factor(label, quantity) == pytest.approx(factor, rel=1e-12)


OF_NO_CHANNEL = ["", "-", "1", "%", "V", "mV", "G", "M", "T", "nm", "Hz", "kg", "t", "psi", "lbf in", "((", ")"]


@pytest.mark.parametrize("label", OF_NO_CHANNEL)
def test_labels_that_are_of_no_channel(label):
    """Nothing that is measured in motion or force; capitals count: G is gauss, M a million."""
    assert quantity_of(label) is None


@pytest.mark.parametrize("label, quantity, factor", [
    *((label, "torque", POUND_FORCE * INCH) for label in ("lbf in", "lbf-in", "in-lb", "in·lbf", "lb in", "inlb")),
    *((label, "torque", POUND_FORCE * FOOT) for label in ("ft-lb", "lbf ft", "ft lbf", "foot-pounds", "lb·ft")),
    ("ozf in", "torque", POUND_FORCE * INCH / 16),
    ("oz-in", "torque", POUND_FORCE * INCH / 16),
    ("Nm", "torque", 1.0),
    ("lbf in/rad", "N m/rad", POUND_FORCE * INCH),
    ("in-lb/rad", "N m/rad", POUND_FORCE * INCH),
    ("lbf in s/rad", "N m s/rad", POUND_FORCE * INCH),
    ("lbf/in", "N/m", POUND_FORCE / INCH),
    ("lb/in", "N/m", POUND_FORCE / INCH),
    ("lbf s/in", "N s/m", POUND_FORCE / INCH),
    ("psi", "pressure", 6894.757293168),
    ("lbf/in²", "pressure", 6894.757293168),
    ("lb", "mass", 0.45359237),
    ("lbm", "mass", 0.45359237),
    ("oz", "mass", 0.45359237 / 16),
    ("slug", "mass", 14.59390293720636),
    ("lbf s²/in", "mass", POUND_FORCE / INCH),
    ("lb/in³", "kg/m3", 27679.9047102031),
    ("slug ft²", "kg m²", 1.35581794833140),
    ("oz in", "kg m", 7.20077887375e-4),
    ("g mm", "kg m", 1e-6),
    ("mm3/(N m)", "m²/N", 1e-9),
    ("rev/min", "spin", math.pi / 30),
    ("deg/s", "spin", math.pi / 180),
    ("Hz", "spin", 2 * math.pi),
    ("Hz", "frequency", 1.0),
    ("1/s", "frequency", 1.0),
    ("mPa s", "Pa s", 1e-3),
    ("MN", "force", 1e6),
    ("mN", "force", 1e-3),
    ("MM/S^2", "acceleration", 1e-3),
])  # fmt: skip
def test_units_that_are_put_together(label, quantity, factor):
    assert unit_factor(label, quantity) == pytest.approx(factor, rel=1e-12)


@pytest.mark.parametrize("label, above, below, factor", [
    ("g/lbf", "acceleration", "force", 9.80665 / POUND_FORCE),
    ("(in/s^2)/lbf", "acceleration", "force", INCH / POUND_FORCE),
    ("in/s²/Pounds", "acceleration", "force", INCH / POUND_FORCE),
    ("G/LBF", "acceleration", "force", 9.80665 / POUND_FORCE),
    ("mils/lb", "displacement", "force", 1e-3 * INCH / POUND_FORCE),
    ("g/g", "acceleration", "acceleration", 1.0),
    ("1", "acceleration", "acceleration", 1.0),
])  # fmt: skip
def test_ratios(label, above, below, factor):
    assert ratio_factor(label, above, below) == pytest.approx(factor, rel=1e-12)


@pytest.mark.parametrize("label, quantity", [
    ("1/min", "spin"), ("lb", "acceleration"), ("lbf in", "N m/rad"), ("mm", "force"), ("", "force"), ("g", "force"),
])  # fmt: skip
def test_a_unit_of_another_quantity_is_none(label, quantity):
    with pytest.raises(RecordError, match=f'unit "{label}" of {quantity} is unknown; use '):
        unit_factor(label, quantity)


@pytest.mark.parametrize("text, quantity, value", [
    ("5mil", "displacement", 1.27e-4), ("24in", "displacement", 0.6096), ("2 ft", "displacement", 0.6096),
    ("30000ksi", "pressure", 206.842718795e9), ("0.284lb/in3", "kg/m3", 7861.09), ("1lb", "mass", 0.45359237),
    ("3", "displacement", 3.0), ("-1g", "acceleration", -9.80665), ("20g-mm", "kg m", 2e-5),
])  # fmt: skip
def test_options_with_units(text, quantity, value):
    assert si_value(text, quantity) == pytest.approx(value, rel=1e-5)
    assert si_number_parser(quantity)(text) == si_value(text, quantity)


@given(st.text(max_size=60))
def test_any_label_is_a_unit_or_none(label):
    quantity = quantity_of(label)
    assert quantity is None or math.isfinite(quantity[1])
