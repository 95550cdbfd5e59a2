"""The clearance from orbits alone."""
from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence

import numpy as np

from ...estimate import Parameter, solve, Stop
from ...rig import Rig
from ..laws.round_comparison import _rests
from ..records.prepared import PreparedRecord, prepared
from ..structure.priors import priors
from .problem import LawProblem, law_parameters, places_of
from .windows import bands_of, cut, motions_of, uncertain, LENGTH

