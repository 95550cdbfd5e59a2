"""clearance-mj simulate: simulate a rig."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

from ..core.output_folder import output_folder
from ..engines import simulate
from ..engines.energy import EnergyBalance, energy_balance
from ..io.results import save
from ..report.energy import write
from ..rig import Rig
from ..rig.depths import wall_depths
from ..structure import find_truncation
from .command import Options, Result, command, inform, inputs, option, provenance, warn_of_depths
from .options import excitation, level, load_model, plugin, simulation

GOOD_BALANCE = 0.01
MAX_STIFFNESS_ERROR = 0.03  # of a contact's stiffness, from modes that are left out: a larger one is warned of


@command(
    "simulate", *simulation(24.0, 2048.0),
    option("--rms", "m/s², or N of a force shaker, or such as 0.1g", level, "1"),
    option("--energy", "balance energy and log impacts: energy.csv, impacts.csv and energy_balance.png in this folder",
           Path, metavar="FOLDER"),
    plugin("an engine, a contact or a grease"),
    out="response.nc", out_help="response file, NetCDF", suffixes=(".nc", ".h5", ".hdf5"),
)  # fmt: skip
def run(options: Options) -> Result:
    """Simulate a rig under random or sinusoidal base or shaker excitation."""
    model = load_model(options)
    kind, words, data = model.rig.shaker.kind, list[str](), dict[str, Any]()
    case = model, excitation(options, kind, options.rms(kind)), None, options.engine
    if options.energy:
        with output_folder(options.energy, "simulate --energy", inputs(options)) as folder:
            folder.refuse_others("energy.csv", "impacts.csv", "energy_balance.png")
            balance = energy_balance(*case, progress=not options.quiet)
            write(folder.new, balance)
        response, words = balance.response, [*_report(balance), f"energy balance: {options.energy}"]
        data["energy"] = balance.summary() | {"out": str(options.energy)}
    else:
        response = simulate(*case, progress=not options.quiet)
    _warn_of_truncation(model.rig)
    assert response.displacement is not None  # of a whole simulation
    depth = wall_depths(model.rig, response.displacement)
    warn_of_depths(model, depth)
    save(options.out, replace(response, provenance=response.provenance | {"made_from": provenance(options)}))
    contact_share = None if response.contact_share is None else response.contact_share.tolist()
    words += [f"response: {options.out}"]
    for bushing, value in zip(model.rig.bushings, contact_share or ()):
        words += [f"clearance at {bushing.where}: beyond its gap, in contact, for {100 * value:.3g} % of the time"]
    accelerations = [label for label, of in zip(response.responses, response.quantities) if of == "acceleration"]
    rms = dict(zip(accelerations, response.acceleration.std(axis=1).tolist()))
    used = {name: response.provenance[name] for name in ("bending_theory", "truncation") if name in response.provenance}
    data |= {"acceleration_rms": rms, "contact_share": contact_share, "depth": depth.tolist()}
    return Result(data | used, words)


def _warn_of_truncation(rig: Rig) -> None:
    """Warn of contacts that are too stiff because the structure lacks modes."""
    for deficit in find_truncation(rig):
        if not deficit.stiffness_error < MAX_STIFFNESS_ERROR:
            error = f"about {100 * deficit.stiffness_error:.0f} %" if deficit.missing >= 0 else "an unknown share"
            lacking = f"clearance at {deficit.where}: the modes lack flexibility there, so its contact is too stiff by"
            inform(f"{lacking} {error}; give residual_flexibility, or more modes", "warning")


def _report(balance: EnergyBalance) -> Iterator[str]:
    summary = balance.summary()
    yield from (f"{name:16s}{value: .4e} J" for name, value in summary["energy"].items())
    yield f"impacts at each bushing: {', '.join(map(str, summary['impacts']))}; up to {summary['peak_force']:.3g} N"
    yield f"the energies balance within {100 * balance.imbalance:.2g} % of what was put in"
    if balance.imbalance > GOOD_BALANCE:
        yield "that is more than 1 %: the engine's step is too long for contacts this stiff"
