"""Make the dataset of the virtual rig, the same bytes each time."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from tqdm import tqdm

from ..io.dataset import Record, write_dataset
from ..rig import Rig
from .acquisition import BITS, acquire
from .bench import simulate_rig
from .table1 import Plan, Truth, plans

__all__ = ["RIG_FILE", "generate", "take"]

RIG_FILE = Path(__file__).parents[2] / "models" / "table1_rig.toml"
"""The datasheet rig, in the source tree: all that the dataset tells of the rig"""
THREADS = 2


def take(plan: Plan, rig: Rig, truth: Truth) -> Record:
    """Shake the virtual rig as planned and measure it."""
    response = simulate_rig(rig, truth, plan.excitation, plan.seed)
    return Record(
        name=plan.name,
        role=plan.role,
        rig=rig,
        fs=plan.excitation.fs,
        channels=acquire(rig, response, truth.noise, plan.seed),
        description=plan.description,
        level=plan.level,
        seed=plan.seed,
        band=plan.excitation.band,
        provenance={
            "source": "synthetic: virtual test rig, not measured",
            "command": "python -m clearance_mj.testrig",
            "noise": f"white, {truth.noise:.0%} RMS of each channel",
            "converter": f"{BITS} bit, range of each channel in its name",
        },
    )


def generate(path):
    """Write the virtual rig's records as a dataset.

    Parameters
    ----------
    path : str or Path
        The folder.

    Raises
    ------
    RigError
        If the rig file is not there: it is part of the source tree, not of an installed package.
    """
    rig, truth, todo = Rig.load(RIG_FILE), Truth(), plans()
    # The compiled integrator releases the interpreter's lock. Each record has its own seed, so order does not matter.
    with ThreadPoolExecutor(THREADS) as pool:
        running = pool.map(lambda plan: take(plan, rig, truth), todo)
        records = list(tqdm(running, total=len(todo), desc="virtual rig", unit="record"))
    write_dataset(path, rig, records)
