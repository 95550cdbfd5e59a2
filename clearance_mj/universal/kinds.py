"""What the numbers in universal files stand for: kinds of data sets, types of functions."""

from __future__ import annotations

from collections.abc import Iterable

__all__ = ["DATA_SETS", "FUNCTION_TYPES", "named_sets"]

DATA_SETS = {
    15: "nodes", 18: "coordinate systems", 55: "data at nodes", 56: "data on elements", 57: "data at element nodes",
    58: "functions", 82: "trace lines", 151: "header", 164: "units", 250: "matrices", 780: "elements", 781: "nodes",
    1858: "qualifiers of functions", 2400: "model header", 2411: "nodes", 2412: "elements", 2414: "analysis data",
    2420: "coordinate systems", 2429: "groups", 2435: "groups", 2452: "groups", 2467: "groups", 2477: "groups",
}  # fmt: skip
"""Names of data sets by their numbers"""
FUNCTION_TYPES = (
    "general function", "time response", "auto spectrum", "cross spectrum", "frequency response function",
    "transmissibility", "coherence", "auto correlation", "cross correlation", "power spectral density",
    "energy spectral density", "probability density", "spectrum", "cumulative frequency distribution",
    "peaks and valleys", "stress over cycles", "strain over cycles", "orbit", "mode indicator function",
    "force pattern", "partial power", "partial coherence", "eigenvalue", "eigenvector", "shock response spectrum",
    "impulse response filter", "multiple coherence", "order function", "phase compensation",
)  # fmt: skip
"""Names of function types by their numbers"""


def named_sets(kinds: Iterable[int]) -> str:
    """Return numbers of data sets with their names, each once, such as "151 (header), 164 (units)"."""
    return ", ".join(f"{kind} ({DATA_SETS[kind]})" if kind in DATA_SETS else str(kind) for kind in sorted(set(kinds)))
