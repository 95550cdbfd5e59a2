"""Controllers that those of the package are only compared with; importing this folder registers them.

``clearance-mj vehicle --plugin experiments/steering/controllers/dither.py --controller smc-dither`` drives with one of
them; ``python -m experiments.steering.controllers`` tunes all that have bounds, those of the package too.
"""

from . import adaptive_inverse, dither, high_gain, thin_layer  # noqa: F401
