"""The identification's equations, Eqs 12 to 17, and the settings of Section 3.2."""

import functools
import math
from collections.abc import Iterator

from clearance_mj.identify import sdof

from ..free_decays import CONDITIONS, free_decay, rms_error
from .judge import Claim

BAND = (50.0, 110.0)  # Hz, of the article's decays


def claims() -> Iterator[Claim]:
    """Claims of the equations of the identification."""
    part = "Identification, Eqs 12-17"
    corrected, without, doubled = _damping_errors()
    verdict = "ok" if without < 1 else "biased where ω varies; -A'/A - ω'/(2ω) is not"
    recomputed = f"{without:.1f} % RMS error of c, with ω'/(2ω) {corrected:.3f} %"
    yield Claim(part, "Eq. (12)", "damping of condition 2, SNR 100 dB", "-A'/A", recomputed, verdict)
    verdict = "ok" if doubled < 1 else "twice too large" if abs(doubled - 100) < 1 else "wrong"
    recomputed = f"{doubled:.1f} % RMS error of c, with 2mωζ {corrected:.3f} %"
    yield Claim(part, "Eq. (17)", "real part of c", "4mωζ", recomputed, verdict)
    for text, start, slope, duration in (
        ("damping of condition 2 over 4 s", 0.02, 0.02, 4.0),
        ("damping of the scale study over 4 s", 0.06, 0.0002, 4.0),
    ):
        zero = start / slope
        verdict = "ok" if zero > duration else f"negative after {zero:g} s"
        yield Claim(part, "Section 3.2", text, f"{start} - {slope}t", f"{start - slope * duration:.4f} at 4 s", verdict)
    for exponent, printed in zip((6, 6.25, 6.5, 6.75, 7), (3200, 3800, 4400, 5200, 6400)):
        count = 1 + math.floor(1 / (4 * 2.0**-exponent) / 0.005 + 1e-9)
        verdict = "ok" if round(count, -2) == printed else "wrong"
        text = f"translations at a = 2^-{exponent:g}, to hundreds, T = 1 s"
        yield Claim(part, "Section 3.2", text, str(printed), str(count), verdict)


@functools.cache
def _damping_errors() -> tuple[float, float, float]:
    """RMS error in percent of the damping of condition 2: corrected, by Eq. 12 and by Eq. 17 as printed."""
    decay = free_decay(CONDITIONS[2]).with_noise(100)
    forms = {}, {"correction": "none"}, {"damping": "as-printed"}
    results = [sdof(decay.signal, decay.fs, decay.mass, BAND, **form) for form in forms]
    return tuple(100 * rms_error(result.c, decay.c, result.valid) for result in results)
