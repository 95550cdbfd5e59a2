"""Rigs in space: speed beside the plane, energy balance, engines beside each other, periodic points, a sweep."""

import dataclasses
import time

import numpy as np
from tqdm import tqdm

import clearance_mj as cm
from clearance_mj.engines import simulate_together
from clearance_mj.rig import Friction, Spin, Unbalance

from .case import row, timed

PLANE = cm.Rig.load("models/table1_rig.toml")
SPACE = PLANE.with_shape("round")
SECONDS, REPEATS, CASES = 4.0, 5, 1000
_RUBS = tuple(dataclasses.replace(b, friction=Friction(0.2, damping=0.5)) for b in PLANE.bushings)
TURNING = SPACE.replace(bushings=_RUBS, gravity=(0.0, 0.0, -9.81), spin=Spin(100.0), unbalances=(Unbalance(0.5, 1e-5),))


def measure():
    """Return rows as of `speed`."""
    rows = []
    noise = cm.excitation.random(SECONDS, 2048.0, band=(5, 220), rms=4.0, seed=1)
    for name, engine, target in (("modal", "modal", ">= 60"), ("links", "links", "")):
        for kind, rig in (("plane", PLANE), ("space", SPACE), ("space, weight, friction, spin", TURNING)):
            times = [timed(lambda r=rig, e=engine: cm.simulate(r, noise, engine=e), 1)[0] for _ in range(REPEATS + 1)]
            wanted = target if kind == "space" else ""
            rows.append(row(f"{name}, {kind}: times real time", [SECONDS / t for t in times[1:]], "x", wanted))
    ratios = []
    for _ in range(REPEATS):
        plane, space = (timed(lambda r=rig: cm.simulate(r, noise, engine="links"), 1)[0] for rig in (PLANE, SPACE))
        ratios.append(space / plane)
    rows.append(row("links: space / plane, side by side", ratios, "x", "<= 2.2"))
    rows.append(row("energy balance with friction and spin, largest residual",
                    [100 * cm.energy_balance(TURNING, noise, engine="modal").imbalance], "%", "<= 1"))  # fmt: skip
    rows += [_lanes(noise), *_agreement(), _periodic(), _sweep()]
    return {"rows": rows, "skipped": {}}


def _lanes(noise):
    """Gain of eight rigs side by side over one after another, on one core."""
    cases, gains = [(SPACE, cm.clearance.nominal_law(SPACE))] * 8, []
    for _ in range(REPEATS + 1):
        together = timed(lambda: simulate_together(cases, noise, workers=1), 1)[0]
        gains.append(8 * timed(lambda: cm.simulate(SPACE, noise, engine="modal"), 1)[0] / together)
    return row("modal, space: eight side by side, gain on one core", gains[1:], "x", "")


def _agreement():
    """RMSE of FRFs of links beside modal: in the gap; in contact, compared with that of another seed."""
    for name, rms, target in (("in the gap", 0.3, "<= 0.3"), ("in contact", 4.0, "<= another seed's")):
        drives = [cm.excitation.random(16.0, 2048.0, band=(5, 220), rms=rms, seed=seed) for seed in (1, 2)]
        modal, other = (_frf(cm.simulate(SPACE, drive, engine="modal")) for drive in drives)
        links = _frf(cm.simulate(SPACE, drives[0], engine="links"))
        yield row(
            f"links against modal in space, {name}: RMSE", [float(np.mean(cm.rmse_db(modal, links)))], "dB", target
        )
        yield row(f"another seed, {name}: RMSE", [float(np.mean(cm.rmse_db(modal, other)))], "dB", "")


def _frf(response):
    return cm.estimate_frf(response, resolution=1.0, band=(5, 220)).value


def _periodic():
    model, rates = cm.Model(SPACE), []
    for _ in range(REPEATS + 1):
        begun = time.perf_counter()
        branch = cm.periodic.follow_response(model, 6.0, (25.0, 60.0), stability=False)
        rates.append(branch.frequency.size / (time.perf_counter() - begun))
    return row("periodic points in a second, one core", rates[1:], "1/s", ">= 300")


def _sweep():
    """Time of many cases, each a second of noise at a level and a friction of its own, on all cores."""
    levels, frictions = np.meshgrid(np.linspace(1, 8, 40), np.linspace(0, 0.4, CASES // 40))
    rigs = [
        SPACE.replace(bushings=tuple(dataclasses.replace(b, friction=Friction(float(mu))) for b in PLANE.bushings))
        for mu in frictions.ravel()
    ]
    drives = [cm.excitation.random(1.0, 2048.0, band=(5, 220), rms=float(rms), seed=1) for rms in levels.ravel()]
    laws, begun = [cm.clearance.nominal_law(PLANE)] * CASES, time.perf_counter()
    each = cm.simulate_each(rigs, drives, laws, engine="modal")
    shares = [response.contact_share for response in tqdm(each, total=CASES, desc="sweep in space")]
    assert len(shares) == CASES
    return row(f"{CASES} cases of 1 s in space on all cores", [time.perf_counter() - begun], "s", "")
