"""Slow motion without displacement probes, against the closed form of a linear clearance and on foreign benches."""

import dataclasses
import tomllib

import numpy as np
import pytest
import scipy.fft

from clearance_mj.clearance import ContactLaw, KelvinVoigt
from clearance_mj.identify.forces.restoring import MODES, NO_PROBES_BAND, flanks, restoring_force
from clearance_mj.identify.laws.case import ClearanceWithLaw
from clearance_mj.identify.laws.measured_motion import MeasuredMotion
from clearance_mj.identify.laws.records_to_fit import informative_records
from clearance_mj.identify.laws.slow_motion import SlowMotion, next_offsets
from clearance_mj.identify.methods.bench import fit_bench
from clearance_mj.identify.records.prepared import PreparedRecord
from clearance_mj.io.dataset import Dataset
from clearance_mj.linear import linear_model
from clearance_mj.rig import Grease, Rig
from experiments.benches.bench import make_bench
from experiments.benches.records import write_bench

from ..conftest import TABLE1


def recorded(rig: Rig, n: int = 8192, fs: float = 512.0) -> PreparedRecord:
    """A record of noise from 0 Hz on: what it says is that of no rig, which a linear clearance does not mind."""
    signals = np.random.default_rng(3).standard_normal((n, len(rig.sensors) + 1))
    names = (*(f"accelerometer {label}" for label in rig.sensor_labels), "excitation")
    return PreparedRecord("noise", rig, rig, fs, "base", (0.5, 200.0), "", names, signals, False)


def test_slow_motion_of_a_linear_clearance_is_that_of_springs_and_dampers():
    """Closed form: x = (1 + C (K + i ω c))⁻¹ H u, whatever the motion above `NO_PROBES_BAND` is."""
    k, c = (4000.0, 2500.0), (3.0, 8.0)
    greases = [Grease(stiffness=stiffness, damping=damping) for stiffness, damping in zip(k, c)]
    bushings = tuple(dataclasses.replace(b, gap=1e6, offset=0.0) for b in TABLE1.bushings)
    rig = TABLE1.replace(bushings=bushings)
    record = recorded(rig)
    force = restoring_force(record, low=NO_PROBES_BAND, rig=rig)
    motions = [MeasuredMotion([force], rig, j, []) for j in range(2)]
    slow = SlowMotion(motions, [record], rig)
    slow.follow([ClearanceWithLaw(b, ContactLaw(KelvinVoigt(1.0), grease)) for b, grease in zip(bushings, greases)])
    count, n = len(slow.spectra[0]), len(record.signals)
    omega = 2 * np.pi * record.fs / n * np.arange(1, count)
    model = linear_model(rig, MODES)
    gains = model.displacement_gains(model.at_bushings, "base", omega)
    driven = scipy.fft.rfft(record.signals[:, -1] * flanks(n, record.fs))[1:count] / 2
    driven[omega < 2 * np.pi * 0.5] = 0
    impedance = np.array(k) + 1j * omega[:, None] * np.array(c)
    inverse = np.linalg.inv(np.eye(2) - gains[:, :, :2] * impedance[:, None, :])
    expected = (inverse @ (gains[:, :, 2:] * driven[:, None, None]))[:, :, 0]
    error = np.linalg.norm(slow.spectra[0][1:] - expected) / np.linalg.norm(expected)
    assert 0.1 < omega[-1] / (2 * np.pi * NO_PROBES_BAND) <= 1.0 and error < 0.02
    # The fit of one bushing alone, the other on its tangent, begins there and stays there.
    for j, motion in enumerate(motions):
        first = motion.slow[0]
        (alone,) = motion.slow_forces(
            [ClearanceWithLaw(bushings[j], ContactLaw(KelvinVoigt(1.0), greases[j]))], [first.x[:, None]]
        )
        again = first.free - first.compliance * (alone[:, 0] - first.stiffness * first.x)
        assert np.linalg.norm(again - first.x) < 0.02 * np.linalg.norm(first.x)


def test_what_walls_and_fillings_leave_open_of_the_mean_motion():
    """Of springs: a wall's mean force by 5 %, a filling's stiffness by half, on the static compliance of both.

    Where the motion falls, what it was larger before counts as the mean does: fillings may have slid.
    """
    k, wall = np.array([300.0, 500.0]), 9e3
    rig = TABLE1.replace(bushings=tuple(dataclasses.replace(b, gap=1e6, offset=0.0) for b in TABLE1.bushings))
    record = recorded(rig)
    record = dataclasses.replace(record, signals=record.signals * np.geomspace(1.0, 0.02, 8192)[:, None])
    force = restoring_force(record, low=NO_PROBES_BAND, rig=rig)
    motions = [MeasuredMotion([force], rig, j, []) for j in range(2)]
    slow = SlowMotion(motions, [record], rig)
    gaps = [2 * float(np.std(x)) for x in force.displacement]
    cases = [
        ClearanceWithLaw(
            dataclasses.replace(b, gap=gap, offset=0.4 * gap), ContactLaw(KelvinVoigt(wall), Grease(stiffness, 3.0))
        )
        for b, gap, stiffness in zip(rig.bushings, gaps, k.tolist())
    ]
    slow.follow(cases)
    means, walls, fallen = np.zeros(2), np.zeros(2), np.zeros(2)
    for j, (bushing, *_) in enumerate(cases):
        x = motions[j].paths[0].x[:: motions[j].factor, 0, 0]
        rms = [np.sqrt(np.mean(block**2)) for block in np.split(x, 8)]  # 16 s by 2 s
        fallen[j] = np.mean([max(rms[: i + 1]) - level for i, level in enumerate(rms)])
        x = x + scipy.fft.irfft(slow.spectra[0][:, j], x.size)
        lower, upper = bushing.walls
        means[j] = x.mean()
        walls[j] = wall * np.hypot(np.maximum(x - upper, 0.0).mean(), np.maximum(lower - x, 0.0).mean())
    assert np.all(walls > 0)
    model = linear_model(rig, MODES)
    free = -model.displacement_gains(model.at_bushings, "base", np.array([1e-3]))[0, :, :2].real
    compliance = np.linalg.inv(np.linalg.inv(free) + np.diag(k))
    known = np.sqrt(compliance**2 @ np.hypot(0.05 * walls, 0.5 * k * np.hypot(means, fallen)) ** 2)
    np.testing.assert_allclose(slow.mean_error(cases), known, rtol=5e-3)


def test_laws_are_fitted_to_records_that_fall_only_where_the_others_do_not_go():
    """Of bushing 0 the steady record goes 0.6 times as far as the one that falls, of bushing 1 0.3 times."""
    whole = restoring_force(recorded(TABLE1), low=NO_PROBES_BAND, rig=TABLE1)
    x = whole.displacement / np.abs(whole.displacement[:, whole.valid]).max(axis=1, keepdims=True)
    falling = dataclasses.replace(whole, displacement=x * np.where(whole.time < whole.time[-1] / 2, 1.0, 0.1))
    steady = dataclasses.replace(whole, displacement=x * np.array([[0.6], [0.3]]) * np.abs(falling.displacement).max())
    assert informative_records([steady, falling]).tolist() == [[True, False], [True, True]]
    assert informative_records([falling]).tolist() == [[True], [True]]
    used = MeasuredMotion([steady, falling], TABLE1, 0, [], (True, False))
    assert 0 < used.fitted.size == MeasuredMotion([steady], TABLE1, 0, []).fitted.size
    correlated = [MeasuredMotion([each], TABLE1, 0, []).shortest_correlation for each in (steady, falling)]
    assert correlated == pytest.approx([0.2 * 256.0, 2.0 * 256.0])


def test_acceleration_finds_where_offsets_stay():
    """Known answer: of a linear map o -> o + A (o* - o), of which o* is where they stay."""
    stay, a = np.array([-2e-5, -1.2e-4]), np.array([[0.3, -0.1], [-0.2, 0.16]])
    places, moves = [np.array([2e-5, -5e-5])], []
    for _ in range(4):
        moves.append(a @ (stay - places[-1]))
        places.append(next_offsets(places, moves, [3e-4, 3e-4]))
    assert np.abs(places[-1] - stay).max() < 1e-3 * np.abs(stay).max()


@pytest.mark.slow
def test_a_bench_without_probes(tmp_path):
    """Gaps within 5 % and offsets within 25 µm of a foreign bench's, of which accelerometers alone are recorded."""
    write_bench(make_bench(23, probes=False, bushing_length=0.0, filtered=0.4), tmp_path)
    truth = tomllib.loads((tmp_path / "truth.toml").read_text(encoding="utf-8"))["bushings"]
    for bushing, true in zip(fit_bench(Dataset.load(tmp_path)).rig.bushings, truth):
        assert bushing.gap == pytest.approx(true["gap"], rel=0.05)
        assert bushing.offset == pytest.approx(true["offset"], abs=25e-6)
