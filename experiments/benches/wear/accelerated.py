"""Two times beside a march whose wear is so quick that the gap doubles while it is marched (docs/wear.md).

    python -m experiments.benches.wear.accelerated

Life goes with one over the coefficient, so both are compared as hours times coefficient. The march knows neither
harmonic balance nor steps that adapt: after every few periods the gap is that which they wore.
"""

from dataclasses import replace

import numpy as np

from clearance_mj import Modal, Model, Rig
from clearance_mj.engines.base import step_factor
from clearance_mj.wear import Sine, predict_life
from clearance_mj.wear.growth import HOUR, clearances_of, growth, with_clearances
from clearance_mj.wear.marched import Marching

RIG, LIMIT = "models/table1_rig.toml", 6e-4  # m, twice the gap
SETTLING = 200  # periods before the wear begins
CASES = {Sine(9.25, 2.0): (2e-6, 1e-6), Sine(39.0, 5.0): (2e-5, 1e-5)}
"""with coefficients, m²/N, of the march"""


def worn_model(rig: Rig, coefficient: float) -> Model:
    """The rig with its datasheet law, each bushing with the same coefficient of wear, m²/N."""
    return Model(rig.replace(bushings=tuple(replace(b, wear=coefficient) for b in rig.bushings)))


def whole_march(rig: Rig, sine: Sine, coefficient: float, periods: int = 4) -> float:
    """Hours times coefficient, h m²/N, until a gap is at the limit; the gap changes after so many periods."""
    model = worn_model(rig, coefficient)
    engine, samples = Modal(modes=sine.n_modes), 256
    factor = step_factor(samples * sine.frequency, engine.largest_step(model.rig, model.law))
    steps = samples * factor
    period = sine.amplitude * np.cos(2 * np.pi * np.arange(steps) / steps)
    march = Marching(model, engine, "base", 1 / (sine.frequency * steps), None)
    for _ in range(SETTLING):
        march.advance(period)
    clearances, hours = clearances_of(model.rig), 0.0
    while np.all(clearances[:, 0] < LIMIT * (1 - 1e-9)):
        march = Marching(with_clearances(model, clearances), engine, "base", march.step, march.state)
        rubbing = np.mean([march.advance(period).rubbing for _ in range(periods)], axis=0)
        step = periods / sine.frequency / HOUR
        grown = step * growth(model.rig, rubbing)
        fraction = min(1.0, float(np.min((LIMIT - clearances[:, 0]) / np.maximum(grown[:, 0], 1e-300))))
        clearances, hours = clearances + fraction * grown, hours + fraction * step
    return hours * coefficient


def main() -> int:
    """Print both, with a march whose gap changes twice as often and one that wears half as quickly."""
    rig = Rig.load(RIG)
    for sine, (quick, slow) in CASES.items():
        life = predict_life(worn_model(rig, 1e-12), sine, LIMIT)
        print(f"{sine.frequency:g} Hz, {sine.amplitude:g} m/s²: two times {1e-12 * life.life:.6g} h m²/N")
        for coefficient, periods in ((quick, 4), (slow, 4), (slow, 2)):
            marched = whole_march(rig, sine, coefficient, periods)
            off = 100 * (1e-12 * life.life / marched - 1)
            print(f"  K {coefficient:g} m²/N, gap anew after {periods} periods: {marched:.6g} ({off:+.2f} %)")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
