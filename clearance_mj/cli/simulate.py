"""clearance-mj simulate: simulate a rig."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .command import command, inputs, out_file, provenance, say, warn_of_depths
from .options import add_plugin, add_simulation, excitation, level, load_model

if TYPE_CHECKING:  # a command imports what it needs when it runs
    from ..rig import Rig

GOOD_BALANCE = 0.01
MAX_STIFFNESS_ERROR = 0.03  # of a contact's stiffness, from modes that are left out: a larger one is warned of


def _options(parser: argparse.ArgumentParser) -> None:
    option = parser.add_argument
    add_simulation(parser, duration=24.0, fs=2048.0)
    words = "m/s², or N of a force shaker, or such as 0.1g (default: %(default)s)"
    option("--rms", type=level, default="1", help=words)
    words = "balance energy and log impacts: energy.csv, impacts.csv and energy_balance.png in this folder"
    option("--energy", type=Path, metavar="FOLDER", help=words)
    add_plugin(parser, "an engine, a contact or a grease")


@command(
    "simulate", "simulate a rig under random or sinusoidal base or shaker excitation", _options,
    out=Path("response.nc"), out_help="response file, NetCDF (default: %(default)s)",
)  # fmt: skip
def _run(options: argparse.Namespace) -> dict[str, Any]:
    from ..core.provenance import is_marked
    from ..engines import simulate
    from ..io.results import save
    from ..rig.depths import wall_depths

    out_file(options.out, (".nc", ".h5", ".hdf5"), inputs(options), is_marked)
    model = load_model(options)
    kind, folder = model.rig.shaker.kind, options.energy
    case = model, excitation(options, kind, options.rms(kind)), None, options.engine
    response, more = (
        _with_energy(options, folder, case) if folder else (simulate(*case, progress=not options.quiet), {})
    )
    _warn_of_truncation(model.rig)
    assert response.displacement is not None  # of a whole simulation
    depth = wall_depths(model.rig, response.displacement)
    warn_of_depths(model, depth)
    save(options.out, replace(response, provenance=response.provenance | {"made_from": provenance(options)}))
    print(f"response: {options.out}")
    share = None if response.contact_share is None else response.contact_share.tolist()
    for bushing, value in zip(model.rig.bushings, share or ()):
        print(f"clearance at {bushing.where}: beyond its gap, in contact, for {100 * value:.3g} % of the time")
    accelerations = [label for label, of in zip(response.responses, response.quantities) if of == "acceleration"]
    rms = dict(zip(accelerations, response.acceleration.std(axis=1).tolist()))
    used = {name: response.provenance[name] for name in ("bending_theory", "truncation") if name in response.provenance}
    found = {"out": str(options.out), "acceleration_rms": rms, "contact_share": share, "depth": depth.tolist()}
    return found | used | more


def _warn_of_truncation(rig: Rig) -> None:
    """Say where modes that a structure lacks make a contact too stiff."""
    from ..structure import find_truncation

    for found in find_truncation(rig):
        if not found.stiffness_error < MAX_STIFFNESS_ERROR:
            share = f"about {100 * found.stiffness_error:.0f} %" if found.missing >= 0 else "an unknown share"
            lacking = f"clearance at {found.where}: the modes lack flexibility there, so its contact is too stiff by"
            say(f"{lacking} {share}; give residual_flexibility, or more modes", "warning")


def _with_energy(options: argparse.Namespace, out: Path, case: tuple[Any, Any, Any, Any]) -> tuple[Any, dict[str, Any]]:
    from ..core.output_folder import output_folder
    from ..engines.energy import energy_balance
    from ..report.energy import write

    with output_folder(out, "simulate --energy", inputs(options)) as folder:
        folder.refuse_others("energy.csv", "impacts.csv", "energy_balance.png")
        balance = energy_balance(*case, progress=not options.quiet)
        response = balance.response
        write(folder.new, balance)
    _print(balance)
    print(f"energy balance: {out}")
    return response, {"energy": balance.summary() | {"out": str(out)}}


def _print(balance: Any) -> None:
    found = balance.summary()
    for name, value in found["energy"].items():
        print(f"{name:16s}{value: .4e} J")
    print(f"impacts at each bushing: {', '.join(map(str, found['impacts']))}; up to {found['peak_force']:.3g} N")
    print(f"the energies balance within {100 * balance.imbalance:.2g} % of what was put in")
    if balance.imbalance > GOOD_BALANCE:
        print("that is more than 1 %: the engine's step is too long for contacts this stiff")
