"""Which items there are: a new one is a file with its function, and one line in `ITEMS`."""

from collections.abc import Sequence

from clearance_mj.core.errors import ClearanceError

from .result import Item

ITEMS: dict[str, Item] = {}
"""Items by name, in the order of the index page"""


def register(item: Item) -> None:
    """Make an item known."""
    ITEMS[item.name] = item


def select(names: Sequence[str]) -> list[Item]:
    """Return items in the order of `ITEMS`, each once; all of them for none or for "all".

    Raises ClearanceError for an unknown name; the message lists the known ones.
    """
    for name in names:
        if name not in ITEMS and name != "all":
            raise ClearanceError(f'item "{name}" is unknown; known: all, {", ".join(ITEMS)}')
    return [item for name, item in ITEMS.items() if name in names or "all" in names or not names]


_CONDITION = ".decays:working_condition"
_MOTION = ".motion:histories_of", ".motion:beside_published"
_MPC = ("mpc", "smc", "smc-cm")

for _item in (
    Item("figure_01", "Figure 1: cantilever beam with double clearance", ".figure_01:run", ("rig",)),
    Item("figure_02", "Figure 2: damping and stiffness that step at 2 s", _CONDITION, ("quick",), {"number": 1}),
    Item("figure_03", "Figure 3: damping and stiffness that fall steadily", _CONDITION, ("quick",), {"number": 2}),
    Item("figure_04", "Figure 4: damping identified at single scales", ".figure_04:run", ("quick",)),
    Item("figure_05", "Figure 5: structure model", ".rig_pictures:structure", ("rig",)),
    Item("figure_06", "Figure 6: test model", ".rig_pictures:rendering", ("rig",)),
    Item(
        "figure_07", "Figure 7: FRFs at clearances 1 and 2", ".frfs:overlay", ("study",),
        {"nodes": (6, 7), "columns": 1},
    ),
    Item(
        "figure_08", "Figure 8: FRFs at the other positions", ".frfs:overlay", ("study",),
        {"nodes": (1, 2, 3, 4, 5, 8), "columns": 2},
    ),
    Item("figure_09", "Figure 9: CSAC of each sensor", ".frfs:criterion", ("study",), {"criterion": "csac"}),
    Item("figure_10", "Figure 10: CSF of each sensor", ".frfs:criterion", ("study",), {"criterion": "csf"}),
    Item(
        "figure_11", "Figure 11: lateral and yaw rate error at 72 km/h", _MOTION[0], ("runs",),
        {"speed": 72.0, "controllers": ("smc", "smc-cm"), "quantities": ("e_y", "yaw_rate_error")},
    ),
    Item(
        "figure_12", "Figure 12: lateral and heading error at 120 km/h", _MOTION[0], ("runs",),
        {"speed": 120.0, "controllers": _MPC, "quantities": ("e_y", "e_psi")},
    ),
    Item(
        "figure_13", "Figure 13: lateral acceleration and yaw rate at 120 km/h", _MOTION[0], ("runs",),
        {"speed": 120.0, "controllers": _MPC, "quantities": ("lateral_acceleration", "yaw_rate")},
    ),
    Item("table_1", "Table 1: natural frequencies and MAC", ".table_1:run", ("study",)),
    Item("table_2", "Table 2: FRF errors at the measuring points", ".table_2:run", ("study",)),
    Item(
        "table_3", "Table 3: SMC and SMC-CM at 72 km/h", _MOTION[1], ("runs", "quick"),
        {"number": 3, "speed": 72.0, "metrics": {
            "lateral_position_error_peak": "peak_e_y", "yaw_velocity_peak": "peak_yaw_rate_error"}},
    ),
    Item(
        "table_4", "Table 4: tracking errors at 120 km/h", _MOTION[1], ("runs", "quick"),
        {"number": 4, "speed": 120.0, "metrics": {
            "lateral_position_error_peak": "peak_e_y", "yaw_velocity_error_peak": "peak_yaw_rate_error"}},
    ),
    Item(
        "table_5", "Table 5: peaks of lateral acceleration and yaw rate at 120 km/h", _MOTION[1], ("runs", "quick"),
        {"number": 5, "speed": 120.0, "metrics": {
            "lateral_acceleration_peak": "peak_lateral_acceleration", "yaw_velocity_peak": "peak_yaw_rate"}},
    ),
    Item("calibrate_table1", "Calibration of a rig to Table 1", ".calibrate_table1:run", ("rig", "quick")),
    Item("sensor_placement", "Sensor placement by Fisher information", ".sensor_placement:run", ("rig",)),
    Item(
        "modal_links_rig", "Modal engine, links engine and virtual rig compared", ".modal_links_rig:run",
        ("study", "quick"),
    ),
    Item(
        "motion_control", "Motion control: gap, misestimated gap, preview, plants, identified laws",
        ".motion_control:run", ("study", "runs", "quick"),
    ),
):  # fmt: skip
    register(_item)
