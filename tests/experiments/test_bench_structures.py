"""Structures of the virtual benches against the package's: two implementations that share no mechanics.

Both are linear here: grease as springs and dashpots, gaps so wide that nothing touches. The bench answers a pulse of
its base; its spectra at complex frequencies, where a record that ends counts as it should, are transfer functions.
"""

import dataclasses

import numpy as np
import pytest

from clearance_mj.beam import state_space
from clearance_mj.rig import Grease
from experiments.benches.bench import exact_rig, make_bench
from experiments.benches.records import later, shake
from experiments.benches.structure import CLASSES
from experiments.testrig.records import FS

SECONDS, LINES = 3.0, slice(20, 660)  # up to 220 Hz
DECAY = 4.0  # 1/s, of the window


def spectra(signals):
    time = np.arange(signals.shape[-1]) / FS
    return np.fft.rfft(signals * np.exp(-DECAY * time))[..., LINES]


def transfer_functions(rig):
    """Of accelerometers and probes, at the same complex frequencies."""
    system = state_space(rig, 24)
    s = DECAY + 2j * np.pi * np.fft.rfftfreq(int(SECONDS * FS), 1 / FS)[LINES]
    identity = np.eye(system.nstates)
    transfer = np.array([system.C @ np.linalg.solve(each * identity - system.A, system.B) + system.D for each in s])
    return transfer[:, :, 0].T * np.exp(-np.outer([*(x.delay for x in rig.sensors), *(0 for _ in rig.bushings)], s))


@pytest.mark.slow
@pytest.mark.parametrize("on_base", [False, True])
@pytest.mark.parametrize("names", [(), *((name,) for name in CLASSES), ("housing", "rocking"), ("plane", "spring")])
def test_a_bench_and_the_package_agree_about_every_structure(names, on_base):
    bench = make_bench(3, ("linear",), contact="linear", grease="linear", structure=names)
    holes = tuple(dataclasses.replace(h, gap=1.0, film=(*h.film[:2], 1e3, 1.0)) for h in bench.holes)
    structure = dataclasses.replace(bench.structure, probes_on_base=on_base)
    bench = dataclasses.replace(bench, holes=holes, structure=structure)
    if on_base and not structure.housings:
        pytest.skip("probes are on the base where there are no housings")
    time = np.arange(int(SECONDS * FS)) / FS
    base = 5.0 * np.exp(-(((time - 0.05) / 2e-3) ** 2))
    accelerations, displacements = shake(bench, base)
    if late := structure.late:
        accelerations[late[0]] = later(accelerations[late[0]], late[1])
    frf = spectra(np.vstack((accelerations, displacements))) / spectra(base)
    rig = exact_rig(bench)
    bushings = [dataclasses.replace(b, grease=Grease(h.elastic, h.film[1])) for b, h in zip(rig.bushings, bench.holes)]
    expected = transfer_functions(rig.replace(bushings=tuple(bushings)))
    error = np.linalg.norm(frf - expected, axis=1) / np.linalg.norm(expected, axis=1)
    assert error.max() < 3e-3
