"""Make the dataset of a virtual rig, the same bytes each time."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

from tqdm import tqdm

from ..io.dataset import Record, write_dataset
from ..rig import Rig
from .acquisition import BITS, acquire
from .bench import simulate_rig
from .others import RIGS
from .plans import Plan, plans
from .truth import Truth

__all__ = ["generate", "take"]

COMMAND = "python -m clearance_mj.testrig"
NOISE = 0.01
"""RMS of a sensor's noise over the RMS of its signal"""
THREADS = 2


def take(plan: Plan, rig: Rig, truth: Truth | Sequence[Truth], command: str = COMMAND) -> Record:
    """Shake a virtual rig as planned and measure it.

    Parameters
    ----------
    plan : Plan
        The record to take.
    rig : Rig
        The rig, with the datasheet's values for its bushings.
    truth : Truth or sequence of Truth
        The real bushings, all or each.
    command : str
        What makes the record; goes into its provenance.
    """
    response = simulate_rig(rig, truth, plan.excitation, plan.seed)
    return Record(
        name=plan.name,
        role=plan.role,
        rig=rig,
        fs=plan.excitation.fs,
        channels=acquire(rig, response, NOISE, plan.seed),
        description=plan.description,
        level=plan.level,
        seed=plan.seed,
        band=plan.excitation.band,
        provenance={
            "source": "synthetic: virtual test rig, not measured",
            "command": command,
            "noise": f"white, {NOISE:.0%} RMS of each channel",
            "converter": f"{BITS} bit, range of each channel in its name",
        },
    )


def generate(path, name: str = "table1"):
    """Write a virtual rig's records as a dataset.

    Parameters
    ----------
    path : str or Path
        The folder.
    name : str
        Of the rig, see `others.RIGS`.

    Raises
    ------
    RigError
        If the rig file of "table1" is not there: it is part of the source tree, not of an installed package.
    """
    virtual, todo = RIGS[name](), plans()
    command = COMMAND if name == "table1" else f"{COMMAND} --rig {name}"
    # The compiled integrator releases the interpreter's lock. Each record has its own seed, so order does not matter.
    with ThreadPoolExecutor(THREADS) as pool:
        running = pool.map(lambda plan: take(plan, virtual.rig, virtual.truth, command), todo)
        records = list(tqdm(running, total=len(todo), desc=f"virtual rig {name}", unit="record"))
    write_dataset(path, virtual.rig, records)
