"""A small dataset in a folder, and changes of its list."""

import tomllib
from pathlib import Path

import numpy as np
import tomli_w

from clearance_mj import Channel, Record, Rig

RIG = Rig.load(Path(__file__).parents[2] / "models" / "table1_rig.toml")
RNG = np.random.default_rng(3)
N, FS = 256, 512.0


def channel(node, quantity="acceleration", direction="+Z", n=N, fs=FS, **more):
    value = RNG.standard_normal(n).astype(np.float32)
    return Channel(f"{quantity} {node}", node, direction, quantity, value, fs, **more)


def channels():
    """In an order that is not the rig's."""
    accelerometers = [channel(node) for node in (8, 7, 6, 5, 4, 3, 2, 1)]
    return [*accelerometers, channel(100), channel(7, "displacement"), channel(6, "displacement")]


def record(name="level-0.5", role="identify", **changes):
    values = {
        "rig": RIG, "fs": FS, "channels": channels(), "description": "band-limited random", "level": 0.5, "seed": 7,
        "band": (5.0, 220.0), "provenance": {"synthetic": True, "generator": "test", "noise": {"share": 0.01}},
    }  # fmt: skip
    return Record(name, role, **(values | changes))


def edit(path, change):
    """Change the parsed dataset.toml in place."""
    data = tomllib.loads((path / "dataset.toml").read_text())
    change(data)
    (path / "dataset.toml").write_text(tomli_w.dumps(data))
