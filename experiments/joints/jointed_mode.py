"""A mode with a joint that slips gradually: its fit to decays and a forced curve, and its response by harmonics.

The joint is Iwan's (J. Appl. Mech. 33, 1966): springs with Coulomb sliders in parallel, whose stiffness is spread over
the displacements at which they slip. Over the logarithm of that displacement the density is a polynomial of second
degree: by its three terms the energy of a cycle grows as the amplitude to the power of 2, 3 and 4. Measured joints lie
between 2 and 3 where little slips (D. J. Segalman, J. Appl. Mech. 72, 2005, 752), above where more begins to.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from clearance_mj.clearance.greases.maxwell_slip import MaxwellSlip
from clearance_mj.clearance.harmonic import periodic_amplitudes, slip_stiffness
from clearance_mj.core.errors import RecordError
from clearance_mj.estimate import Estimates, Parameter, Problem, StoppingCriteria, correlation_time, one_by_one, solve
from clearance_mj.signals.free_decay import Decay

ELEMENTS = 80
FIRST_SLIP, LAST_SLIP = 1e-3, 5.0  # displacements at which the first and the last element slips, over the reach
GRID = 1000  # amplitudes from the first to the last of these displacements among which a response is searched
SHIFT_STD, PHASE_STD = 2.5e-3, 0.02  # before the fit: of a frequency from test to test, relative, and of a phase, rad
FREQUENCY_MISS = 1.25e-4  # relative error of a frequency by a law of so few numbers
DAMPING_MISS = 5e-5  # error of a damping ratio by such a law
CURVE_MISS = 0.04  # error of a forced response by such a law, relative and rad
STEP = 1e-8  # of a logarithm, or of the range between bounds, for differences


@dataclass(frozen=True)
class JointedMode:
    """One mode of a structure with a joint, of unit mass."""

    frequency: float  #: Hz, of motions so small that nothing slips
    damping: float  #: ratio to critical of the viscous part, at that frequency
    even: float  #: fraction of the stiffness that slips for each e-fold of the displacement, the same everywhere
    linear: float  #: the same at the reach, of the part that grows as the displacement
    quadratic: float  #: the same at the reach, of the part that grows as its square
    reach: float  #: m; elements slip from 0.001 to 5 times this displacement, beyond nothing more does

    def elements(self) -> tuple[np.ndarray, np.ndarray]:
        """(n,) fraction of the stiffness of each element, and its slip displacement, m; none if nothing slips."""
        slip = self.reach * np.geomspace(FIRST_SLIP, LAST_SLIP, ELEMENTS)
        density = np.polynomial.polynomial.polyval(slip / self.reach, (self.even, self.linear, self.quadratic))
        slips = density > 0
        return density[slips] * np.log(slip[1] / slip[0]), slip[slips]

    def stiffness(self, amplitude: np.ndarray, omega: np.ndarray | float) -> np.ndarray:
        """Return (n,) complex stiffness over mass, rad²/s², of harmonic motions of (n,) m at frequencies, rad/s."""
        fractions, slip = self.elements()
        small = 2 * np.pi * self.frequency
        sliding = slip_stiffness(amplitude, fractions, fractions * slip)
        return small**2 * (1 - fractions.sum() + sliding) + 2j * self.damping * small * omega

    def backbone(self, amplitude: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the frequency, Hz, and damping ratio (n,) of free vibration with amplitudes (n,), m."""
        still = self.stiffness(amplitude, 0.0)
        omega, small = np.sqrt(still.real), 2 * np.pi * self.frequency
        return omega / (2 * np.pi), still.imag / (2 * omega**2) + self.damping * small / omega

    def element(self, mass: float) -> MaxwellSlip:
        """Return all of the stiffness and damping as one law, which runs on every engine."""
        fractions, slip = self.elements()
        small = 2 * np.pi * self.frequency
        springs = mass * small**2 * fractions
        return MaxwellSlip(
            springs=tuple(springs.tolist()), forces=tuple((springs * slip).tolist()),
            elastic=mass * small**2 * (1 - fractions.sum()), damping=2 * mass * self.damping * small,
        )  # fmt: skip


@dataclass(frozen=True, eq=False)
class ForcedCurve:
    """A stepped sine: force and response at each frequency, in the order in which they were measured."""

    frequency: np.ndarray
    """(n,) Hz"""
    force: np.ndarray
    """(n,) amplitude, N"""
    acceleration: np.ndarray
    """(n,) complex, m/s², over the force's phase and reversed: in phase with a displacement"""

    def __post_init__(self) -> None:
        arrays = self.frequency, self.force, self.acceleration
        if len({np.shape(a) for a in arrays}) > 1 or np.ndim(self.frequency) != 1 or len(self.frequency) < 3:
            raise RecordError(f"a forced curve is three rows of equal length, got {[np.shape(a) for a in arrays]}")
        if not (np.isfinite(self.acceleration).all() and (self.frequency > 0).all() and (self.force > 0).all()):
            raise RecordError("a forced curve needs frequencies and forces > 0 and finite accelerations")


@dataclass(frozen=True)
class ForcedTest:
    """A forced test of the mode: acceleration over force is that of the mode, and a mass line of other modes."""

    mass: float  #: kg, of the mode, normalised to where force and sensor are
    residual: float = 0.0  #: 1/kg, acceleration (reversed) over force of the modes whose frequencies are far
    shift: float = 0.0
    """Hz, that the small-motion frequency lies above the mode's: temperature, assembly, effect of the shaker"""
    phase: float = 0.0  #: rad, of the acceleration, by which the measurement leads

    def mode(self, mode: JointedMode) -> JointedMode:
        """Return the mode as it was on the day of this test."""
        return replace(mode, frequency=mode.frequency + self.shift)

    def accelerance(self, mode: JointedMode, frequency: np.ndarray, amplitude: np.ndarray) -> np.ndarray:
        """(n,) complex acceleration over force, 1/kg, at (n,) Hz where the mode vibrates with amplitudes (n,), m."""
        w = 2 * np.pi * frequency
        return (self._modal(self.mode(mode).stiffness(amplitude, w), w) + self.residual) * np.exp(1j * self.phase)

    def response(self, mode: JointedMode, frequency: np.ndarray, force: np.ndarray) -> np.ndarray:
        """(n,) complex acceleration, m/s², under forces (n,), N, by harmonic balance from one frequency to the next.

        Where the resonance bends so far that there are several, the one nearest the last; nan where the motion is
        below 0.001 or above 5 times the reach.
        """
        grid, stiffness, last = *self._on_grid(mode), 0.0
        amplitudes = np.full(len(frequency), np.nan)
        for i, (omega, drive) in enumerate(zip(2 * np.pi * frequency, force)):
            solutions = periodic_amplitudes(grid, stiffness(omega), 1.0, omega, drive / self.mass)
            if solutions.size:
                amplitudes[i] = last = solutions[np.argmin(np.abs(solutions - last))]
        inside = np.isfinite(amplitudes)
        accelerance = self.accelerance(mode, frequency, np.where(inside, amplitudes, mode.reach))
        return np.where(inside, accelerance * force, np.nan)

    def force(self, mode: JointedMode, frequency: np.ndarray, amplitude: np.ndarray) -> np.ndarray:
        """Return (n,) force, N, that holds the acceleration's amplitude at (n,) m/s²; nan beyond what elements span."""
        (grid, stiffness), forces = self._on_grid(mode), []
        for omega, wanted in zip(2 * np.pi * frequency, amplitude):
            modal = self._modal(stiffness(omega), omega)
            need = grid * omega**2 / np.abs(modal)
            forces.append(np.interp(wanted, need * np.abs(modal + self.residual), need, left=np.nan, right=np.nan))
        return np.array(forces)

    def _modal(self, stiffness: np.ndarray, omega: ArrayLike) -> np.ndarray:
        """(n,) complex acceleration of the mode alone over force, 1/kg, where its stiffness over mass is (n,)."""
        square = np.square(omega)
        return square / (self.mass * (stiffness - square))

    def _on_grid(self, mode: JointedMode) -> tuple[np.ndarray, Callable[[float], np.ndarray]]:
        """Return (1000,) amplitudes, m, among which solutions lie, and their stiffness over mass at any frequency."""
        grid = mode.reach * np.geomspace(FIRST_SLIP, LAST_SLIP, GRID)
        tested = self.mode(mode)
        small = tested.stiffness(grid, 0.0)
        return grid, lambda omega: small + 2j * tested.damping * 2 * np.pi * tested.frequency * omega

    def seen(self, curve: ForcedCurve) -> Decay:
        """Return amplitude, m, frequency, Hz, and damping of the free mode at each measured point (no time).

        Inverse harmonic balance: no law of the joint is assumed. The damping is taken not to depend on frequency.
        """
        accelerance = curve.acceleration / curve.force * np.exp(-1j * self.phase) - self.residual
        relative = 1 / (self.mass * accelerance)
        frequency = curve.frequency * np.sqrt(np.maximum(1 + relative.real, 0))
        amplitude = np.abs(accelerance) * curve.force / (2 * np.pi * curve.frequency) ** 2
        damping = relative.imag / 2 * (curve.frequency / frequency) ** 2
        return Decay(np.full(frequency.size, np.nan), amplitude, frequency - self.shift, damping)


@dataclass(frozen=True, eq=False)
class JointedModeFit:
    """A mode with its joint, its forced test, and the estimates of both."""

    mode: JointedMode  #: as it was in the decays
    test: ForcedTest  #: that the forced curve was measured in
    estimates: Estimates  #: of the fields of both, reach left out; widened by the law's misfit
    frequency_miss: float  #: Hz, RMS over decays and forced curve, each counted alike
    damping_miss: float  #: RMS of the damping ratio in the same way

    def draw(self, n: int, seed: int = 0) -> list[tuple[JointedMode, ForcedTest]]:
        """Draw n modes and tests as another forced test may have them.

        From the covariance; frequency and damping deviate by the law's misfit, and the frequency once more by as much
        as this test's did from the decays.
        """
        rng = np.random.default_rng(seed)
        deviations = rng.standard_normal((n, 3)) * (self.frequency_miss, self.damping_miss, abs(self.test.shift))
        draws = []
        for values, (frequency, damping, shift) in zip(self.estimates.draw(n, seed), deviations):
            mode, test = _mode_and_test(values, self.mode.reach)
            changed = mode.frequency + frequency, max(mode.damping + damping, 0.0)
            mode = replace(mode, frequency=changed[0], damping=changed[1])
            draws.append((mode, replace(test, shift=test.shift + shift)))
        return draws


def fit_jointed_mode(decays: Sequence[Decay], curve: ForcedCurve, reach: float) -> JointedModeFit:
    """Fit one mode with a joint to free decays and to one forced curve, taken together.

    Parameters
    ----------
    decays : sequence of Decay
        Amplitudes in m at the sensor of the forced curve, each decay of one sensor.
    curve : ForcedCurve
        Stepped sine through the resonance.
    reach : float
        m, about the largest amplitude: displacement at which the growing parts of the joint are stated.

    Returns
    -------
    JointedModeFit
        Weighted least squares. Frequency and damping of the decays count with the expected error of a law of so few
        numbers; so does the forced curve, whose measured amplitudes are put into the law and whose accelerations over
        force are compared (equation error: no branch has to be chosen). The covariance takes the misfit of each kind
        of data for its noise, with its correlation from point to point.

    Raises
    ------
    RecordError
        If there is no decay.
    """
    if not decays or not reach > 0:
        raise RecordError(f"a fit needs a decay and a reach > 0 m, got {len(decays)} decays and {reach:g} m")
    parameters = _parameters(decays, curve)

    def parts(values: np.ndarray) -> list[np.ndarray]:
        return _residuals(*_mode_and_test(values, reach), decays, curve)

    problem = Problem(
        parameters, one_by_one(lambda values: np.concatenate(parts(values))), step=STEP, lanes=False,
        units=[1.0 if p.transform == "log" else p.high - p.low for p in parameters],
    )  # fmt: skip
    solution = solve(problem, stop=StoppingCriteria(steps=1000, decrease=1e-8, move=1e-8))
    miss = np.concatenate([np.full(r.size, _effective_rms(r)) for r in parts(solution.values)])
    rows = solution.jacobian / miss[:, None]
    estimates = solution.estimates(np.linalg.inv(rows.T @ rows + solution.prior))
    mode, test = _mode_and_test(solution.values, reach)
    return JointedModeFit(mode, test, estimates, *_rms_misses(mode, [*decays, test.seen(curve)]))


def _mode_and_test(values: np.ndarray, reach: float) -> tuple[JointedMode, ForcedTest]:
    fields, test = np.append(values[:5], reach), values[5:]
    return JointedMode(*fields.tolist()), ForcedTest(*test.tolist())


def _parameters(decays: Sequence[Decay], curve: ForcedCurve) -> list[Parameter]:
    """Return the parameters with starts and priors; the smallest motions hardly slip."""
    frequency = max(d.frequency.max() for d in decays)
    damping = min(d.damping.min() for d in decays)
    top = int(np.argmax(np.abs(curve.acceleration)))
    mass = curve.force[top] / (2 * max(d.damping.max() for d in decays) * abs(curve.acceleration[top]))
    shift = SHIFT_STD * frequency
    return [
        Parameter("frequency", "Hz", frequency, 0.9 * frequency, 1.1 * frequency, transform="linear"),
        Parameter("damping", "1", 0.9 * damping, 1e-3 * damping, 10 * damping),
        *(Parameter(n, "1", damping, 0.0, 0.1, transform="linear") for n in ("even", "linear", "quadratic")),
        Parameter("mass", "kg", mass, 0.1 * mass, 10 * mass),
        Parameter("residual", "1/kg", 0.0, -20 / mass, 20 / mass, 2 / mass, "linear"),
        Parameter("shift", "Hz", 0.0, -5 * shift, 5 * shift, shift, "linear"),
        Parameter("phase", "rad", 0.0, -0.5, 0.5, PHASE_STD, "linear"),
    ]


def _residuals(mode: JointedMode, test: ForcedTest, decays: Sequence[Decay], curve: ForcedCurve) -> list[np.ndarray]:
    """Return errors of frequency and damping of each decay, then of the curve, over the law's expected errors."""
    residuals = []
    for each in decays:
        frequency, damping = mode.backbone(each.amplitude)
        residuals += [(frequency / each.frequency - 1) / FREQUENCY_MISS, (damping - each.damping) / DAMPING_MISS]
    measured = curve.acceleration / curve.force
    error = np.log(test.accelerance(mode, curve.frequency, test.seen(curve).amplitude) / measured)
    return [*residuals, error.real / CURVE_MISS, error.imag / CURVE_MISS]


def _effective_rms(residual: np.ndarray) -> float:
    """Return the RMS, times the root of the number of points that count as one."""
    return float(np.sqrt(np.mean(residual**2) * correlation_time(residual)) + 1e-6)


def _rms_misses(mode: JointedMode, decays: Sequence[Decay]) -> tuple[float, float]:
    misses = []
    for each in decays:
        frequency, damping = mode.backbone(each.amplitude)
        misses.append((np.mean((frequency - each.frequency) ** 2), np.mean((damping - each.damping) ** 2)))
    frequency_miss, damping_miss = np.sqrt(np.mean(misses, axis=0))
    return float(frequency_miss), float(damping_miss)
