"""clearance-mj new --kind gears: a pair with backlash under a mean torque."""

import re
import tomllib

import numpy as np
import pytest

from clearance_mj import Bushing, Contact, Grease, Rig, Sensor, energy_balance
from clearance_mj.rig import Load, Order
from clearance_mj.signals.excitation import still
from clearance_mj.structure import Gears, Inertia

from .test_new import VALIDATOR, new


def test_gears(tmp_path):
    """The example loads, rattles, and its comments hold the defaults; what is told is in the file."""
    example = new(tmp_path, "mine", "--kind", "gears")
    text = (tmp_path / "rig.toml").read_text(encoding="utf-8")
    VALIDATOR.validate(tomllib.loads(text))
    assert Rig.from_dict(tomllib.loads(re.sub(r"(?m)^# (\w+ = [^ ])", r"\1", text))) == example
    balance = energy_balance(example, still(0.3, 8192.0, "force"))
    assert {impact.side for impact in balance.impacts} == {"upper", "lower"}
    assert {"orders.order", "spin.speed", "structure.inertias.base_radius"} <= {*example.examples}
    given = "--inertias 2e-3 8e-3 --base-radii 40mm 80mm --backlash 0.1mm --contact 1e8 500 --torque 5 --ripple 2"
    rig = new(tmp_path / "told", "mine", *given.split(), "--teeth", 28, "--spin", "1000rpm", "--sensors", "2:RX",
              "--reads", "angle")  # fmt: skip
    assert rig.structure == Gears(
        (Inertia(1, 2e-3, 0.04, name="driving gear"), Inertia(2, 8e-3, 0.08, name="loose gear"))
    )
    assert rig.bushings == (Bushing("1:X", 5e-5, 0.0, Grease(0.0), Contact(1e8, 500.0), to="2:X"),)
    assert rig.loads == (Load("1:RX", torque=5.0), Load("2:RX", torque=-10.0))
    assert rig.orders == (Order("1:RX", 28.0, torque=2.0),) and rig.spin.speed == pytest.approx(100 * np.pi / 3)
    assert rig.sensors == (Sensor(2, "2:RX", quantity="angle"),) and not rig.examples
