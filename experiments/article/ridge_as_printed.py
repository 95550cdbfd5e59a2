"""Method "ridge-as-printed": the wavelet ridge with the article's Equations 12 and 17 as they are printed.

Importing the file registers it; `clearance-mj identify --plugin` takes it, too.
"""

from clearance_mj.identify import Identified, register
from clearance_mj.identify.methods.ridge import find, shortest_for_ridge
from clearance_mj.io.dataset import Dataset


@register("ridge-as-printed", "as ridge, with the article's Equations 12 and 17 as printed", shortest_for_ridge)
def find_as_printed(dataset: Dataset, progress: bool = False) -> Identified:
    """Identify as method "ridge" does, without the adiabatic correction and with the decay of Equation 17."""
    return find(dataset, progress, "none", "as-printed")
