"""SMC with the switching gain that holds against the whole lost motion, k₂ + b h (Slotine and Li, section 7.1)."""

from dataclasses import replace

from clearance_mj.vehicle.controllers.base import Controller, Task
from clearance_mj.vehicle.controllers.design import DesignModel
from clearance_mj.vehicle.controllers.registry import ClearancePrior, Registration, register
from clearance_mj.vehicle.controllers.smc import SlidingMode, input_gain


def _with_larger_gain(controller: Controller, task: Task, prior: ClearancePrior) -> Controller:
    assert isinstance(controller, SlidingMode)
    model = DesignModel(task.vehicle, task.servo, task.speed, task.period)
    larger = controller.switching + input_gain(model, controller.look_ahead) * prior.half_gap
    return replace(controller, switching=larger)


register(
    Registration(
        "smc-high-gain", "SMC, larger gain", SlidingMode, tuned_as="smc", adapt=_with_larger_gain,
        prior="half-gap, as a bound", colour="#56b4e9", line=(0, (1, 1.2)),
    )
)  # fmt: skip
