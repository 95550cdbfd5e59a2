"""Records of a bench as a logger has them: names, order, signs and units that say little of the rig."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from clearance_mj import Beam, Bushing, Contact, Grease, PointMass, Rig, Sensor
from clearance_mj.core.units import unit_factor
from clearance_mj.io.channels import UNKNOWN, Channel
from clearance_mj.io.columns import channel_name

from . import bench as benches
from .bench import Bench, make_bench
from .records import STREAM, measure_channels, plans

UNITS = {"acceleration": ("m/s2", "g", "mm/s2"), "displacement": ("m", "mm", "um")}
WORDS = ("A", "CH", "Kanal", "Sensor", "ai", "Slot")
SAID = 0.7  # share of channels whose unit the logger writes
DRAWS = 99  # third word of the seeds of names, order, signs and units


def short_shaft(name: str) -> Rig:
    """Return the rig of a small bench: a shaft of 0.62 m, one point bushing, four accelerometers and no probe."""
    return Rig(
        name, Beam(0.62, 210e9, 7850.0, 0.0086, rayleigh=(0.5, 1e-5)),
        (Bushing(0.45, 1.8e-4, 0.0, Grease(4000.0, 3.0), Contact(1e4, 4.0)),),
        tuple(Sensor(node, x) for node, x in enumerate((0.12, 0.28, 0.45, 0.62), 1)), (PointMass(0.62, 0.2, "lever"),),
        description="Virtual bench: the rig file is what its designer knows",
    )  # fmt: skip


def drawn_bench(seed: int) -> Bench:
    """Return one of five kinds of bench by its seed; its rig file is wrong in everything, every other has probes."""
    name = f"drawn {seed}"
    rigs = (
        benches.table1_rig(name), short_shaft(name), benches.other_rig(name), benches.table1_rig(name, (0.7,)),
        benches.table1_rig(name, (0.3684, 0.5484, 0.7918)),
    )  # fmt: skip
    return make_bench(seed, rig=rigs[seed % len(rigs)], probes=seed % 2 == 0 and seed % len(rigs) != 1)


def measured(bench: Bench, names: Sequence[str] = ("ramp", "level_1_a")) -> dict[str, list[Channel]]:
    """Return the channels of some of a bench's short records, the base first, then accelerometers, then probes."""
    values = {}
    for i, (name, _, base, _, _) in enumerate(plans(bench, short=True)):
        if name in names:
            rng = np.random.default_rng((bench.seed, STREAM, i))
            labels = (bench.rig.shaker.label("base"), *bench.rig.sensor_labels, *bench.rig.probe_labels)
            values[name] = [
                replace(
                    c, name=c.name.partition(",")[0], node=int(label.partition(":")[0]),
                    direction=label.partition(":")[2],
                )
                for c, label in zip(measure_channels(bench, base.value, rng), labels)
            ]  # fmt: skip
    return values


def as_logged(
    records: Sequence[Sequence[Channel]], seed: int, said: float = SAID
) -> tuple[list[list[Channel]], dict[str, str]]:
    """Return channels as a logger has them, and what each one is, as a map says it.

    Names, order and signs are drawn, and units, of which a share is ``said``. Signs are relative to the base's, since a
    bench and its mirror image show the same.
    """
    rng = np.random.default_rng((seed, STREAM, DRAWS))
    count = len(records[0])
    logged: list[list[Channel]] = [[] for _ in records]
    truth = {}
    for number, i in enumerate(rng.permutation(count)):
        channel = records[0][i]
        sign = 1.0 if i == 0 else rng.choice([-1.0, 1.0])
        unit = str(rng.choice(UNITS[channel.quantity]))
        name = f"{rng.choice(WORDS)} {rng.integers(1, 99)}_{number}"
        is_said = rng.random() < said
        label = channel.label if sign > 0 else channel.label.replace("+", "-")
        place = channel_name(label, channel.quantity)
        truth[name] = place if is_said else f"{place} [{unit}]"
        quantity = channel.quantity if is_said else UNKNOWN
        factor = 1.0 if is_said else unit_factor(unit, channel.quantity)
        for out, channels in zip(logged, records):
            out.append(Channel(name, 0, "S", quantity, sign * channels[i].value / factor, channels[i].fs))
    return logged, truth
