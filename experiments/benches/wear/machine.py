"""A virtual machine that wears, and what is known of it: synthetic, and not the model's own physics.

Its contact is Hunt & Crossley's where the model has a spring and a damper; its rig and gaps are off the model's; its
wear is not Archard's: the coefficient goes with a power of the rubbing and walks on as the gap grows. It is integrated
here by the midpoint rule over steps of the gap. Its gaps are known as a twin knows them: with a random error, one that
is always the same, and standard deviations that are off the true ones.
"""

import dataclasses
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from clearance_mj import ConstantLaw, ContactLaw, Law, Model, Rig
from clearance_mj.clearance.contacts.hertz import HuntCrossley
from clearance_mj.signals.excitation import random
from clearance_mj.wear import GapHistory, Marched, Operation, Sine
from clearance_mj.wear.growth import HOUR, clearances_of, growth_per_volume, with_clearances

RIG = "models/table1_rig.toml"
COEFFICIENT = 1e-12  # m²/N, what the model begins with: 1e-3 mm³/(N m)
STEP = 0.04  # of the gap that grows quickest, in a step of the machine
LEAST = 0.15  # growth of a bushing, relative, from which on its life is judged
DEPTH, SPEED = 1e-4, 0.05  # m and m/s, of impacts at which the model's spring and damper are the true contact's
SINES = ((9.25, 1.5, 3.0), (39.0, 4.0, 7.0), (92.0, 15.0, 25.0))  # Hz, and the range of the amplitude, m/s²


@dataclasses.dataclass(frozen=True, eq=False)
class Machine:
    """One virtual machine."""

    seed: int
    model: Model  #: what is known of it
    truth: Model  #: what stands there, but for its coefficients of wear
    operation: Operation
    hours: np.ndarray  #: (n,) h
    gap: np.ndarray  #: (n, n_bushings) m, the true ones
    limit: np.ndarray  #: (n_bushings,) m; nan of a bushing that hardly wears
    life: np.ndarray  #: (n_bushings,) h, at which each limit is reached

    def history(self, fraction: float = 1 / 3) -> GapHistory:
        """Return the gaps as known in the first part of the first life that ends."""
        rng = np.random.default_rng((self.seed, 7))
        hours = np.linspace(0.0, fraction * float(np.nanmin(self.life)), int(rng.integers(10, 17)))
        gap = np.array([np.interp(hours, self.hours, g) for g in self.gap.T]).T
        true = 0.007 * gap
        seen = gap * np.exp(0.003 * rng.standard_normal(gap.shape[1])) + true * rng.standard_normal(gap.shape)
        reported = true * np.exp(0.2 * rng.standard_normal(gap.shape[1]))
        seen[:, np.isnan(self.limit)] = np.nan
        return GapHistory(hours, seen, reported)


def make_machine(seed: int) -> Machine | None:
    """Make the machine of a seed; None if nothing of it wears."""
    rng = np.random.default_rng(seed)
    nominal = Rig.load(RIG)
    gaps = 3e-4 * (1 + 0.15 * rng.uniform(-1, 1, 2))
    operation, long = _operations(rng, seed)
    true = _true_model(nominal, gaps, rng)
    bushings = tuple(replace(b, gap=float(g), wear=COEFFICIENT) for b, g in zip(nominal.bushings, gaps))
    law = _told_law(true.law, rng)
    model = Model(nominal.replace(bushings=bushings), law, partial(_drawn, nominal.replace(bushings=bushings), law))
    course = _course(true, long, rng)
    if course is None:
        return None
    hours, gap = course
    grown = gap[-1] / gap[0] - 1
    fraction = rng.uniform(0.7, 1.0, 2)
    limit = np.where(grown > LEAST, gap[0] + fraction * (gap[-1] - gap[0]), np.nan)
    life = np.array([np.interp(l, g, hours) if np.isfinite(l) else np.nan for l, g in zip(limit, gap.T)])
    truth = Model(true.rig.replace(bushings=tuple(replace(b, wear=COEFFICIENT) for b in true.rig.bushings)), true.law)
    return Machine(seed, model, truth, operation, hours, gap, limit, life)


def _operations(rng: np.random.Generator, seed: int) -> tuple[Operation, Operation]:
    """Operation as it is stated and, for longer and with another seed, as it is."""
    if seed % 2:
        rms = float(rng.uniform(9.0, 14.0))
        return Marched(random(8.0, 2048.0, rms=rms, seed=seed)), Marched(
            random(16.0, 2048.0, rms=rms, seed=seed + 10**6)
        )
    frequency, low, high = SINES[seed // 2 % len(SINES)]
    sine = Sine(frequency, float(rng.uniform(low, high)))
    return sine, sine


def _true_model(nominal: Rig, gaps: np.ndarray, rng: np.random.Generator) -> Model:
    """Draw the true machine: numbers off by the errors of an identification, and another contact."""
    assert nominal.beam
    beam = replace(nominal.beam, young_modulus=nominal.beam.young_modulus * (1 + 0.01 * rng.normal()))
    masses = tuple(replace(m, mass=m.mass * (1 + 0.02 * rng.normal())) for m in nominal.masses)
    bushings = tuple(
        replace(
            b, gap=float(gap), wear=float(COEFFICIENT * np.exp(0.5 * rng.normal())),
            grease=replace(b.grease, stiffness=b.grease.stiffness * float(np.exp(0.1 * rng.normal()))),
        )
        for b, gap in zip(nominal.bushings, gaps)
    )  # fmt: skip
    stiffness = 4.5e5 * float(np.exp(0.3 * rng.normal()))  # as the datasheet at one gap of penetration
    contact = HuntCrossley(stiffness=stiffness, restitution=float(rng.uniform(0.5, 0.8)), first_order=True)
    return Model(nominal.replace(beam=beam, masses=masses, bushings=bushings), ContactLaw(contact))


def _told_law(true: Law, rng: np.random.Generator) -> ConstantLaw:
    """A spring and a damper as the contact is at one depth and speed of impact, but for their errors."""
    assert isinstance(true, ContactLaw) and isinstance(true.contact[0], HuntCrossley)
    contact = true.contact[0]
    k = contact.stiffness * np.sqrt(DEPTH)
    c = contact.kappa * k * DEPTH / SPEED
    return ConstantLaw(float(k * np.exp(0.15 * rng.normal())), float(c * np.exp(0.3 * rng.normal())))


def _drawn(rig: Rig, law: ConstantLaw, n: int, seed: int) -> list[Model]:
    """Draws of a posterior that is as wide as what the model is off by, but knows nothing of the other contact."""
    rng = np.random.default_rng((seed, 11))
    return [Model(_off(rig, rng), ConstantLaw(law.k * np.exp(0.15 * rng.normal()), law.c * np.exp(0.3 * rng.normal())))
            for _ in range(n)]  # fmt: skip


def _off(rig: Rig, rng: np.random.Generator) -> Rig:
    """A rig whose numbers are off by what an identification leaves."""
    assert rig.beam
    beam = replace(rig.beam, young_modulus=rig.beam.young_modulus * (1 + 0.01 * rng.normal()))
    masses = tuple(replace(m, mass=m.mass * (1 + 0.02 * rng.normal())) for m in rig.masses)
    bushings = tuple(
        replace(b, grease=replace(b.grease, stiffness=b.grease.stiffness * float(factor)))
        for b, factor in zip(rig.bushings, np.exp(0.1 * rng.normal(size=len(rig.bushings))))
    )
    return rig.replace(beam=beam, masses=masses, bushings=bushings)


def _course(model: Model, operation: Operation, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray] | None:
    """Hours and gaps until the quickest has grown by 60 to 120 %."""
    source, target = operation.source(model), float(rng.uniform(0.6, 1.2))
    law = _law(model, target, rng)
    vibration, clearances, hours = source.first(model), clearances_of(model.rig), 0.0
    start = clearances.copy()
    if not vibration.power.any():
        return None
    first = np.maximum(vibration.power, 0.05 * vibration.power.max())
    states = [(0.0, clearances[:, 0].copy())]
    at = model
    while np.max(clearances[:, 0] / start[:, 0]) < 1 + target and len(states) < 200:
        rate = law(vibration, first, clearances, start)
        fastest = float(np.max(rate[:, 0] / clearances[:, 0]))
        if not fastest > 0:
            break
        step = STEP / fastest
        middle = with_clearances(model, clearances + step / 2 * rate)
        at_middle = source.follow(vibration, at, middle) or source.leap(vibration, middle)
        clearances = clearances + step * law(at_middle, first, clearances_of(middle.rig), start)
        after = with_clearances(model, clearances)
        vibration = source.follow(at_middle, middle, after) or source.leap(at_middle, after)
        at, hours = after, hours + step
        states.append((hours, clearances[:, 0].copy()))
    times, gaps = zip(*states)
    return np.array(times), np.array(gaps)


def _law(model: Model, target: float, rng: np.random.Generator) -> Callable[..., np.ndarray]:
    """Rates of wear, m/h, with coefficients that go with rubbing to a power and walk with the gap."""
    coefficients = np.array([b.wear for b in model.rig.bushings], dtype=float)
    power = float(rng.uniform(-0.3, 0.5))
    size = rng.uniform(0.05, 0.3)
    grid = np.linspace(0.0, 1.0, 101)
    walk = np.cumsum(size * rng.standard_normal((101, len(coefficients))) / 10.0, axis=0)

    def rate(vibration, first, clearances, start) -> np.ndarray:  # type: ignore[no-untyped-def]
        gone = np.max(clearances[:, 0] / start[:, 0] - 1) / target
        drifted = np.array([np.exp(np.interp(gone, grid, w - w[0])) for w in walk.T])
        loaded = (np.maximum(vibration.power, 1e-3 * first) / first) ** power
        return HOUR * (coefficients * drifted * loaded)[:, None] * growth_per_volume(model.rig, vibration.rubbing)

    return rate
