"""Parts that a bench may have and its rig file lacks: one file a hypothesis, each registered by its name."""

# isort: off
from . import support, housing, fixture, rocking, mass, spring, clamp, delay, planes, oscillator  # noqa: F401
