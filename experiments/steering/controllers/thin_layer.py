"""SMC whose switching term acts: a gain from the disturbances that it is there for, and a thin boundary layer.

The wheel stands off by the half-gap h = 0.2°, which is b h = 0.95 m/s² at L_s = 1.9 m, and tyres that differ by 15 %
are worth 0.75 m/s² at 5 m/s²: k₂ is at least the sum of both. Where a relay acts through a delay τ, s does not stay at
zero but within the quasi-sliding band 2 k₂ τ, 0.17 m/s with the loop's 50 ms; a boundary layer as wide is crossed by
nothing, and its control is linear. Here Φ is at most half of that band, so that the sign of s decides for a share of
the time (`Run.metrics()["outside_layer"]`), and chatter is its price.

Utkin, Guldner and Shi, Sliding Mode Control in Electro-Mechanical Systems, 2009, chapter 8; the band of sampled sliding
modes: Gao, Wang and Homaifa, Discrete-time variable structure control systems, IEEE Trans. Ind. Electron. 42, 1995.
"""

from pathlib import Path

from clearance_mj.vehicle.controllers import smc
from clearance_mj.vehicle.controllers.registry import Registration, register
from clearance_mj.vehicle.controllers.smc import SlidingMode

BOUNDS = smc.BOUNDS | {"switching": (1.7, 5.0), "layer": (0.02, 0.08)}
register(
    Registration(
        "smc-sliding", "SMC, thin layer", SlidingMode, bounds=BOUNDS, tuned_as="smc", colour="#a6761d",
        line=(0, (5, 1, 1, 1)), settings_file=Path(__file__).with_name("tuned.toml"),
    )
)  # fmt: skip
