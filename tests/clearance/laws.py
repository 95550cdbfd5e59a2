"""One of each contact and filling, for a clearance of 0.3 mm."""

from clearance_mj import clearance as models
from clearance_mj.clearance.greases.long_film import LongFilm
from clearance_mj.rig import Grease

GAP, SLIPS = 3e-4, ((4000.0, 2000.0), (0.4, 0.6))
CONTACTS = [
    models.KelvinVoigt(2e4, 6.0), models.KelvinVoigt(2e4, 6.0, adhesion=True), models.HuntCrossley(1e6, 0.6),
    models.LankaraniNikravesh(1e6, 0.6), models.Flores(1e6, 0.6), models.HuntCrossley1975(3e5, 6.75e5),
    models.Cubic(2e4, 5e11, 6.0), models.AdamsImpact(4e6, 1.5, 40.0, 1e-4),
]  # fmt: skip
FILLINGS = [
    Grease(4e3, 5.0), Grease(5e3, 2.0, 0.8, 1.1, 1.5e7, 5e6, 1.9, 8e-4, 0.3),
    models.MaxwellSlip(*SLIPS, 500.0, 3.0, 8e-4), models.MaxwellSlip(*SLIPS, static_ratio=1.5, stribeck_speed=0.02),
    LongFilm(3e3, 2.0, 8e-4), models.ShortBearing(0.02, 0.01, 0.01, GAP, 1e-6, cavitated=False),
    models.FiniteBearing(0.02, 0.01, 0.01, GAP, asperities=1e-6),
]  # fmt: skip
