"""A rigid stop: where contact begins, and the motion with one impact in every period. Truth: closed forms.

S. W. Shaw and P. J. Holmes, "A periodically forced piecewise linear oscillator", Journal of Sound and Vibration 90
(1983); A. B. Nordmark, "Non-periodic motion caused by grazing incidence in an impact oscillator", ibid. 145 (1991).
"""

import numpy as np
import pytest

from clearance_mj import ConstantLaw, Model, periodic

from .one_mass import one_mass

DAMPING, GAP, TURN = 0.04, 1.0, 2 * np.pi
FORCE, OMEGA = 12.0, 2.6
RESTITUTION = {0.1: 0.744079, 0.3: 0.450975}
"""of a free mass on a spring and damper of so much critical damping, released where the force is zero"""
OSCILLATOR = one_mass(damping=DAMPING, gap=GAP, stops="upper")


@pytest.mark.parametrize("omega", [0.7, 1.3, 2.6])
def test_contact_begins_where_the_linear_motion_grazes_the_stop(omega):
    """Amplitude F/|1 - Ω² + iδΩ| = gap; to 1e-4 of the level."""
    grazing, ends = GAP * abs(1 - omega**2 + 1j * DAMPING * omega), (omega / TURN, 1.001 * omega / TURN)
    model = Model(OSCILLATOR, ConstantLaw(100.0, 2.0))
    for ratio, touches in ((1 - 1e-4, False), (1 + 1e-4, True)):
        branch = periodic.follow_response(model, ratio * grazing, ends, 21, 2048, stability=False)
        assert bool(branch.contact_force[0].any()) == touches


def impacting(force, omega, restitution):
    """Histories of the motions with one impact in a period, (N,) from the stop to the stop, and the speed after it.

    Between impacts x = A cos(Ωt + ψ) + exp(-δt/2) (a cos wt + b sin wt); x = gap at both ends of the period, and the
    speed after the impact is -e times that before, which makes b and the speed of the steady part multiples of a, and
    of A² a quadratic equation.
    """
    decay, period = DAMPING / 2, TURN / omega
    w, amplitude = np.sqrt(1 - decay**2), force / abs(1 - omega**2 + 1j * DAMPING * omega)
    left, c, s = np.exp(-decay * period), np.cos(w * period), np.sin(w * period)
    b = (1 - left * c) / (left * s)  # over a, as all that follows
    begins = w * b - decay
    ends = left * (begins * c - (w + decay * b) * s)
    steady = -(ends + begins / restitution) / (1 + 1 / restitution)
    time = np.linspace(0, period, 4001)
    for a in np.roots([1 + (steady / omega) ** 2, -2 * GAP, GAP**2 - amplitude**2]):
        if abs(a.imag) > 1e-12:
            continue
        a = a.real
        free = np.exp(-decay * time) * a * (np.cos(w * time) + b * np.sin(w * time))
        x = (GAP - a) * np.cos(omega * time) + steady * a / omega * np.sin(omega * time) + free
        speed = (begins + steady) * a
        if speed < 0 and x.max() < GAP * (1 + 1e-9):
            yield x, speed


def with_stiff_stop(stiffness, ratio, force, omega, harmonics):
    """Deepest displacement away from a stop of that stiffness and damping ratio."""
    model = Model(OSCILLATOR, ConstantLaw(stiffness, 2 * ratio * np.sqrt(stiffness)))
    ends = 1.002 * omega / TURN, omega / TURN
    branch = periodic.follow_response(model, force, ends, harmonics, stability=False)
    return np.fft.irfft(branch.displacement[-1, 0] * np.append(1.0, np.full(harmonics, 0.5)), 8192).min() * 8192


@pytest.mark.parametrize("ratio", sorted(RESTITUTION))
@pytest.mark.parametrize(
    ("softest", "bound"), [(25, 2e-3), pytest.param(100, 5e-4, marks=pytest.mark.slow)], ids=["soft", "stiff"]
)
def test_one_impact_in_every_period(ratio, softest, bound, measured):
    """Contacts four times as stiff last half as long: of three the limit is extrapolated, in 1/√k and 1/k.

    Stiffness over mass and Ω². The two restitutions' limits are 2 % apart.
    """
    ((known, _),) = impacting(FORCE, OMEGA, RESTITUTION[ratio])
    stiffnesses = (softest, 4 * softest, 16 * softest)
    impacts = [with_stiff_stop(k * OMEGA**2, ratio, FORCE, OMEGA, int(4.2 * np.sqrt(k))) for k in stiffnesses]
    assert np.all(np.diff(np.abs(impacts - known.min())) < 0)
    limits = 2 * np.array(impacts[1:]) - impacts[:-1]
    limit = (4 * limits[1] - limits[0]) / 3
    what = f"harmonic balance, one impact on a rigid stop in a period, ζ = {ratio}: depth"
    measured.below(what, abs(limit / known.min() - 1), bound, "closed form, Shaw & Holmes 1983")
