"""Measured records: DROPBEAR. Frequencies under a moving support, fitted on one record and predicted on two others."""

import numpy as np
import pytest

from clearance_mj.signals.wavelet import ridge
from experiments.real import dropbear


@pytest.fixture(scope="module")
def result(real_data):
    return dropbear.analyse(real_data)


def test_seen_frequencies(result, measured):
    """README of the records: first 26.4, 33.9, 42.0 Hz at 1.227, 2.50, 3.37 V; second 160.5, 214, 269 Hz."""
    rows = [r for r in result["rows"] if r["record"] == "steps10_test0"]
    for position, known in ((1.227, (26.4, 160.5)), (2.50, (33.9, 214.0)), (3.37, (42.0, 269.0))):
        for mode in (1, 2):
            at = [r["spectrum_Hz"] for r in rows if r["mode"] == mode and abs(r["position_V"] - position) < 0.02]
            what = f"steps10_test0, roller at {position} V: f{mode} in the spectrum (Hz)"
            measured.equal(what, np.mean(at), known[mode - 1], "README of the records", rel=0.01)


@pytest.mark.parametrize(("record", "count"), [("steps10_test1", 10), ("random_dwell_set0_test0", 7)])
def test_predicted_from_the_position_alone(result, record, count, measured):
    assert sum(r["record"] == record and r["mode"] == 1 for r in result["rows"]) >= count
    for mode in (1, 2):
        error = dropbear.median_error(result["rows"], record, mode, "predicted_Hz")
        what = f"{record}: f{mode} from the roller's position, median error"
        measured.below(what, error, 0.007, "spectrum; fitted on steps10_test0")


@pytest.mark.parametrize("record", ["steps10_test0", "steps10_test1", "random_dwell_set0_test0"])
def test_ridge_against_plateau_spectrum(result, record, measured):
    for mode in (1, 2):
        error = dropbear.median_error(result["rows"], record, mode, "ridge_Hz")
        measured.below(f"{record}: f{mode} by the ridge, median error", error, 0.005, "spectrum of the plateaus")


@pytest.mark.parametrize("mode", [0, 1])
def test_tracked_while_the_roller_moves(result, mode, measured):
    moving = dropbear.moving(result, "random_dwell_set0_test0", mode)
    what, source = f"random_dwell, roller moving: f{mode} by the ridge", "model at the roller's position"
    measured.below(f"{what}, error", moving["error"], 0.05, source)
    measured.below(f"{what}, error where valid", moving["valid_error"], 0.02, source)


@pytest.mark.parametrize(("omega0", "centre"), [(5.0, 30.0), (12.0, 200.0)])
def test_delay_and_bandwidth_of_the_tracking(omega0, centre):
    """A tone modulated at the stated bandwidth keeps 71 % of its modulation, without delay."""
    fs, modulation, depth = 5000.0, dropbear.bandwidth(omega0, centre), 0.01 * centre
    t = np.arange(round(4 * fs)) / fs
    frequency = centre + depth * np.sin(2 * np.pi * modulation * t)
    line = ridge(np.cos(2 * np.pi * np.cumsum(frequency) / fs), fs, (0.7 * centre, 1.4 * centre), omega0)
    inside = slice(round(fs), round(3 * fs))
    waves = np.exp(-2j * np.pi * modulation * t[inside])
    gain = 2 * np.mean((line.omega[inside] / (2 * np.pi) - centre) * waves) / depth
    gain /= 2 * np.mean(np.sin(2 * np.pi * modulation * t[inside]) * waves)
    assert abs(gain) == pytest.approx(0.707, abs=0.03) and abs(np.angle(gain)) / (2 * np.pi * modulation) < 1e-3


def test_cantilever_limits():
    """No support: λ² of the bare cantilever. A rigid prop at the tip: 3.9266², 7.0686² (Blevins 1979, table 8-1)."""
    free = dropbear.Cantilever(1.0, 0.0, 0.5, 0.0).frequencies([1.0])[0]
    np.testing.assert_allclose(free, [1.8751041**2, 4.6940911**2], rtol=1e-6)
    propped = dropbear.Cantilever(1.0, 1e7, 1.0, 0.0).frequencies([1.0])[0]
    np.testing.assert_allclose(propped, [3.926602**2, 7.068583**2], rtol=2e-3)


def test_table_and_figure(result, tmp_path, capsys):
    dropbear.write(result, tmp_path)
    assert (tmp_path / "dropbear.png").read_bytes()[:4] == b"\x89PNG"
    assert len((tmp_path / "dropbear.csv").read_text().splitlines()) == len(result["rows"]) + 1
    assert capsys.readouterr().out.count("bandwidth") == 6
