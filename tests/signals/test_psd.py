"""Power spectral densities: areas in closed form, refused tables, and noise with exactly that spectrum."""

import numpy as np
import pytest
import scipy.integrate
import scipy.signal
import scipy.stats

import clearance_mj as cm
from clearance_mj.signals.psd import PSD

from ..refusals import assert_refused

BREAKPOINTS = PSD([10.0, 50.0, 100.0, 400.0], [2.0, 8.0, 8.0, 0.5])


def test_rms_is_that_of_the_table_of_mil_std_810():
    """MIL-STD-810G method 514.6, figure 514.6E-1 (general minimum integrity), which says 7.7 g RMS.

    0.04 g²/Hz from 20 to 1000 Hz, then -6 dB/octave to 2000 Hz: 0.04·980 + 0.04·1000² (1/1000 - 1/2000) = 59.2 g².
    """
    psd = PSD([20.0, 1000.0, 2000.0], [0.04, 0.04, 0.01])
    assert psd.rms == pytest.approx(np.sqrt(59.2), rel=1e-12) and round(psd.rms, 1) == 7.7


@pytest.mark.parametrize("value", [[2.0, 8.0, 8.0, 0.5], [4.0, 2.0, 1.0, 0.0], [10.0, 2.0, 1.0, 0.25]])
def test_rms_is_the_area_under_the_interpolation(value):
    psd = PSD([10.0, 50.0, 100.0, 400.0], value)
    area = sum(scipy.integrate.quad(psd.at, a, b)[0] for a, b in zip(psd.frequency, psd.frequency[1:]))
    assert psd.rms == pytest.approx(np.sqrt(area), rel=1e-9)
    assert psd.scaled(3.0).rms == pytest.approx(3.0, rel=1e-12)


def test_between_breakpoints_it_is_straight_over_logarithms():
    assert BREAKPOINTS.at([10.0, np.sqrt(500.0), 200.0, 9.9, 401.0]) == pytest.approx([2.0, 4.0, 2.0, 0.0, 0.0])


def test_noise_has_the_spectrum_line_by_line():
    """The power of a line over its expectation is exponential (χ² of two degrees of freedom), mean 1."""
    noise = cm.excitation.from_psd(BREAKPOINTS, 200.0, 1024.0, seed=3)
    line = np.abs(np.fft.rfft(noise.value)) ** 2 * 2 / (1024.0 * noise.value.size)
    frequency = np.fft.rfftfreq(noise.value.size, 1 / 1024.0)
    within = (frequency >= 10.0) & (frequency <= 400.0)
    assert line[~within].max() < 1e-20
    assert scipy.stats.kstest(line[within] / BREAKPOINTS.at(frequency[within]), "expon").pvalue > 0.01
    assert scipy.stats.kstest(noise.value[::41] / BREAKPOINTS.rms, "norm").pvalue > 0.01
    assert noise.kind == "base" and noise.band == (10.0, 400.0)
    assert noise == cm.excitation.from_psd(BREAKPOINTS, 200.0, 1024.0, seed=3)


def test_noise_in_pieces_has_the_spectrum_and_no_seams():
    pieces = [e.value for e in cm.excitation.from_psd_blocks(BREAKPOINTS, 400.0, 1024.0, seed=4)]
    value = np.concatenate(pieces)
    assert value.size == 409600 and len(pieces) == 50
    frequency, density = scipy.signal.welch(value, 1024.0, nperseg=4096)
    inner = (frequency > 15.0) & (frequency < 380.0)
    ratio = density[inner] / BREAKPOINTS.at(frequency[inner])
    assert np.mean(ratio) == pytest.approx(1.0, abs=0.02)  # 1460 lines of about 180 averages each: 0.2 %
    assert density[frequency > 405.0].max() < 1e-5 * density.max()
    jumps = np.abs(np.diff(value))
    assert jumps[8191::8192].max() < jumps.max()


def test_reads_a_table_with_comments_and_units(tmp_path):
    path = tmp_path / "engine.csv"
    path.write_text("# engine mount, 3000 rev/min\nPSD [N^2/Hz], Frequency [Hz]\n1e-2, 5\n\n0.5, 50\n# end\n0.1,200\n")
    psd = PSD.load(path, "force")
    assert psd.frequency.tolist() == [5.0, 50.0, 200.0] and psd.value.tolist() == [0.01, 0.5, 0.1]
    assert psd.kind == "force" and psd.description["file"] == str(path)


LINES = [f"{f:g},1" for f in np.arange(10.0, 30.0, 0.5)]


@pytest.mark.parametrize(("text", "words"), [
    ("f,psd\n1,2\n2,3\n", 'needs a header with columns "frequency" and "psd"'),
    ("", 'needs a header with columns "frequency" and "psd"'),
    ("frequency,psd\n1,2\n2\n", "line 3, column \"psd\": '' is not a number"),
    ("frequency,psd\n1,2\n2,x\n", "line 3, column \"psd\": 'x' is not a number"),
    ("frequency,psd\n1,2\n2,nan\n", "value 2 of the PSD is not finite"),
    ("frequency,psd\n1,2\n2,-3\n", "negative, -3, at 2 Hz"),
    ("frequency,psd\n0,2\n2,3\n", "begins at 0 Hz"),
    ("frequency,psd\n1,2\n", "two or more frequencies"),
    ("frequency,psd\n1,0\n2,0\n", "zero at all frequencies"),
    ("frequency,psd\n1,2\n3,2\n3,4\n", "must rise: 3 Hz follows 3 Hz"),
    ("frequency,psd\n" + "\n".join(LINES[:20] + LINES[23:]), "a hole from 19.5 to 21.5 Hz"),
])  # fmt: skip
def test_refuses_in_one_line_that_names_the_file(tmp_path, text, words):
    path = tmp_path / "road.csv"
    path.write_text(text)
    message = assert_refused(cm.ClearanceError, None, PSD.load, path)
    assert message.startswith(f"{path}: ") and words in message


def test_refuses_a_band_beyond_the_rate_and_one_between_two_lines():
    with pytest.raises(cm.ExcitationError, match="must end at or below fs / 2 = 256 Hz"):
        cm.excitation.from_psd(BREAKPOINTS, 10.0, 512.0)
    with pytest.raises(cm.ExcitationError, match="puts no line of 1 Hz into the band"):
        cm.excitation.from_psd(PSD([10.2, 10.8], [1.0, 1.0]), 1.0, 512.0)
    assert_refused(cm.ExcitationError, "rms 0: must be > 0", BREAKPOINTS.scaled, 0)
