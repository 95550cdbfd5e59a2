"""A support or a clamp that the rig file says to be exact, and that gives.

Tried before all others: a motion that such a support forbids looks like a mode that nothing explains, or like a mass.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

from ....core.plain_numbers import find_numbers, path_of
from ....rig import Rig, Tolerance
from ....rig.tolerance import CLAMP_COMPLIANCES
from ....structure import Shaft
from ....structure.beam import Clamp
from .candidate import Bench, Candidate, hypothesis

SUPPORTS = "structure.supports"


@hypothesis("support", "a support that gives, though it is exact in the rig file", of_rig_file=True)
def supports(bench: Bench) -> Iterator[Candidate]:
    """Yield each support that is said to be exact, or the clamp of a beam."""
    for holder in dict.fromkeys(t.of.rpartition(".")[0] for t in _exact(bench.rig)):
        yield Candidate("support", partial(_with_open_support, bench.rig, holder), partial(_words, holder))


def _exact(rig: Rig) -> list[Tolerance]:
    """Return a tolerance of 0 for every number of supports and clamp that is said to be exact."""
    exact = [t for t in rig.tolerances if t.size == 0]
    keys = [key for t in exact if t.of.startswith(SUPPORTS) for key in find_numbers(rig.to_dict(), t.of)]
    return [*(Tolerance(path_of(key), "0 %") for key in keys), *(t for t in exact if t.of in CLAMP_COMPLIANCES)]


def _with_open_support(rig: Rig, holder: str, factor: float) -> Rig:
    others = [t for t in rig.tolerances if t.size or not (t.of.startswith(SUPPORTS) or t.of in CLAMP_COMPLIANCES)]
    return rig.replace(tolerances=(*others, *(t for t in _exact(rig) if t.of.rpartition(".")[0] != holder)))


def _words(holder: str, rig: Rig) -> str:
    if isinstance(rig.linear, Shaft):
        spring = rig.linear.supports[int(holder.partition("[")[2].rstrip("]"))]
        called, sizes = f"the support at x = {spring.position:.3g} m", (spring.translation, spring.rotation)
    else:
        clamp = (rig.beam and rig.beam.clamp) or Clamp()
        called, sizes = "the clamp", (clamp.translation or 0.0, clamp.rotation or 0.0)
    size = " and ".join(f"{value:.3g} {unit}" for value, unit in zip(sizes, ("N/m", "N m/rad")) if value)
    return f"{called}, which it says to be exact, gives ({size})"
