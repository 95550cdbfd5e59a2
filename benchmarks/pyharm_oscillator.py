"""pyHarm on two masses and a one-sided spring, run by an interpreter that has it: prints points, times and the curve.

Residuals are solved to 1e-9 by pyHarm's own Newton-Raphson; steps double after five that were accepted.
"""

import json
import logging
import sys
import time

import numpy as np
from pyHarm.Maestro import Maestro

STIFFNESS = np.array([[1.0, -1.0], [-1.0, 2.0]])


def response(harmonics, samples, low, high, force, longest):
    """Angular frequencies and amplitudes of the second mass's fundamental, from above; and the processor's time, s."""
    case = {
        "system": {"type": "Base", "nh": harmonics, "nti": samples},
        "substructures": {
            "masses": {
                "type": "substructure",
                "ndofs": 1,
                "nnodes": 2,
                "matrix": {"M": np.eye(2), "C": 0.03 * STIFFNESS, "K": STIFFNESS, "G": np.zeros((2, 2))},
            }
        },
        "connectors": {
            "stop": {"type": "PenaltyUnilateralGap", "connect": {"masses": [0]}, "dirs": [0], "g": 1.0, "k": 100.0},
            "force": {"type": "CosinusForcing", "connect": {"masses": [1]}, "dirs": [0], "amp": force},
        },
        "analysis": {
            "frf": {
                "study": "frf",
                "solver": "NewtonRaphson",
                "solver_options": {"tol_residual": 1e-9, "tol_delta_x": 1e-9, "max_iter": 25},
                "puls_inf": low,
                "puls_sup": high,
                "sign_ds": -1,
                "ds0": 1e-2,
                "ds_min": 1e-8,
                "ds_max": longest,
                "verbose": False,
            }
        },
    }
    maestro = Maestro(case)
    begun = time.process_time()
    maestro.operate()
    seconds = time.process_time() - begun
    analysis, system = maestro.nls["frf"], maestro.system
    unknowns = np.array([system.get_full_disp(each.x) for each in analysis.SolList if each.flag_accepted])
    rows = system.expl_dofs
    first = [rows[(rows["node_num"] == 1) & (rows["harm"] == 1) & (rows["cs"] == cs)].index[0] for cs in ("c", "s")]
    return unknowns[:, -1], np.hypot(*unknowns[:, first].T), seconds


def main():
    logging.disable(logging.CRITICAL)
    given = json.loads(sys.argv[1])
    response(**given)  # compiles
    omega, amplitude, seconds = response(**given)
    print()
    print(json.dumps({"seconds": seconds, "omega": omega.tolist(), "amplitude": amplitude.tolist()}))


if __name__ == "__main__":
    main()
