"""What modal model, links and rig are compared under: bushing, orders, levels, and how long."""

from collections.abc import Mapping
from dataclasses import dataclass

NAME = "modal_links_rig"
PERIOD = 2.0  # s, of the multisines
N_MODES = 4
ORDERS = 5
BUSHING = 1  # index of the one that closes first under mode 1
REDUCED = {"stiffness": 1300.0, "damping": 1.2}  # N/m, N s/m
GREASE_ONLY = "modal, no contact"


@dataclass(frozen=True)
class Setup:
    """How much is measured."""

    engines: tuple[str, ...]  #: names
    levels: tuple[float, ...]  #: m/s² RMS of the multisines, rising
    shown: tuple[float, ...]  #: levels whose best linear approximation is drawn
    realisations: int  #: multisines of each level
    periods: int  #: kept of each realisation
    drop: int  #: periods before them
    amplitudes: tuple[float, ...]  #: m/s², of the sine whose harmonics are looked at
    sweeps: Mapping[str, tuple[float, ...]]  #: Hz, steps upwards by the grease: "as it is" or "reduced"
    dwell: float  #: s, of each step


FULL = Setup(
    engines=("links", "modal"),
    levels=(0.25, 0.5, 1.0, 2.0, 4.0, 8.0),
    shown=(0.25, 2.0, 8.0),
    realisations=6,
    periods=2,
    drop=2,
    amplitudes=tuple(0.05 * 2.0**i for i in range(8)),
    sweeps={
        "as it is": tuple(round(10.4 + 0.05 * i, 2) for i in range(13)),
        "reduced": tuple(8.0 + 0.25 * i for i in range(13)),
    },
    dwell=3.0,
)
QUICK = Setup(
    engines=("modal",), levels=(0.5, 4.0), shown=(0.5, 4.0), realisations=2, periods=2, drop=1, amplitudes=(0.1, 0.8),
    sweeps={"reduced": (8.0, 9.0, 9.5, 10.0, 11.0)}, dwell=1.5,
)  # fmt: skip
SINE = 9.25  # Hz, mode 1 in the gap
SWEEP_AMPLITUDE = 1.0  # m/s²
