"""Study of laws: the worth of each kind of prior information about the clearance in predicting the FRFs of a rig.

Every law is simulated on every engine under the measured excitation of every validation record, and its FRFs are
compared with the record's. A law is simulated on the rig that was identified with it, or else on the rig file's. The
same record level with another seed gives the repeatability: how closely the rig repeats itself.
"""

from .case import StudyCase
from .files import study_summary, write_results
from .identified import IdentifiedModel
from .laws import METHODS
from .study import ENGINES, N_MODES, RESOLUTION, Study

__all__ = [
    "ENGINES", "METHODS", "N_MODES", "RESOLUTION", "IdentifiedModel", "Study", "StudyCase", "study_summary",
    "write_results",
]  # fmt: skip
