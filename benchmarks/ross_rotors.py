"""Example rotors of ROSS with their natural frequencies over spin, as JSON; run by an interpreter that has it.

Where bearings change with speed or couple the planes, they have constant, uncoupled coefficients here, those at the
first speed; seals are left out. A shaft that rubs has no damping of its own.
"""

import contextlib
import io
import json
import sys
import time
import warnings

warnings.simplefilter("ignore")
with contextlib.redirect_stdout(io.StringIO()):
    import numpy as np
    import ross

EXAMPLES = ("rotor_example", "rotor_example_with_damping", "compressor_example")
COEFFICIENTS = ("kxx", "kyy", "cxx", "cyy")
PIECES = 3  # elements for each one of the finer rotors
LATERAL = (0, 1, 3, 4)  # of a node's x, y, z and rotations about them


def main(speeds, modes, bearings, rub):
    rotors = {}
    for name in EXAMPLES:
        with contextlib.redirect_stdout(io.StringIO()):
            rotor = _example(name)
        begun = time.process_time()
        poles = [_lateral(rotor, speed, modes) for speed in speeds]
        seconds = time.process_time() - begun
        finer = [_lateral(_finer(rotor, PIECES), speed, modes) for speed in speeds]
        rotors[name] = _plain(rotor) | {"poles": poles, "finer": finer, "seconds": seconds}
    answer = {"rotors": rotors, "bearings": [_coefficients(**case) for case in bearings], "rub": _rubbing(**rub)}
    json.dump(answer, sys.stdout)


def _rubbing(name, node, gap, stiffness, moment, phase, speed, seconds, steps):
    """Motion (n, 2) of a node that rubs without friction, from rest on, for each time step, and the time it took."""
    with contextlib.redirect_stdout(io.StringIO()):
        rotor = _example(name)
        elements = [
            ross.ShaftElement(e.L, e.idl, e.odl, material=e.material, n=e.n, alpha=0, beta=0)
            for e in rotor.shaft_elements
        ]
        rotor = ross.Rotor(elements, rotor.disk_elements, rotor.bearing_elements)

        def run(step, count):
            return rotor.run_rubbing(
                n=node, distance=gap, contact_stiffness=stiffness, contact_damping=0.0, friction_coeff=0.0,
                node=[node], unbalance_magnitude=[moment], unbalance_phase=[phase], speed=speed,
                t=step * np.arange(count),
            ).yout[:, rotor.number_dof * node :][:, :2]  # fmt: skip

        run(steps[0], 5)  # compiles
        runs = []
        for step in steps:
            begun = time.process_time()
            motion = run(step, round(seconds / step)).tolist()
            runs.append({"motion": motion, "seconds": time.process_time() - begun})
    return runs


def _coefficients(spin, load, viscosity, radius, length, clearance):
    """Stiffness and damping of ROSS' short bearing."""
    bearing = ross.CylindricalBearing(
        n=0, speed=ross.Q_([spin], "rad/s"), weight=load, bearing_length=length, journal_diameter=2 * radius,
        radial_clearance=clearance, oil_viscosity=viscosity,
    )  # fmt: skip
    at = ross.Q_(spin, "rad/s")
    return [np.asarray(matrix)[:2, :2].tolist() for matrix in (bearing.K(at), bearing.C(at))]


def _example(name):
    rotor = getattr(ross.rotor_assembly, name)()
    bearings = [
        ross.BearingElement(b.n, **{c: float(getattr(b, c)[0]) for c in COEFFICIENTS})
        for b in rotor.bearing_elements
        if type(b) is ross.BearingElement
    ]
    return ross.Rotor(rotor.shaft_elements, rotor.disk_elements, bearings)


def _finer(rotor, pieces):
    """The same rotor with several elements for each of its own."""
    elements = []
    for e in rotor.shaft_elements:
        for i in range(pieces):
            ends = [
                {
                    f"{side}{end}": (1 - at) * getattr(e, f"{side}l") + at * getattr(e, f"{side}r")
                    for side in ("id", "od")
                }
                for end, at in (("l", i / pieces), ("r", (i + 1) / pieces))
            ]
            same = {n: getattr(e, n) for n in ("material", "shear_effects", "rotary_inertia", "gyroscopic")}
            elements.append(ross.ShaftElement(e.L / pieces, n=pieces * e.n + i, **ends[0], **ends[1], **same,
                                              alpha=e.alpha, beta=e.beta))  # fmt: skip
    discs = [ross.DiskElement(pieces * d.n, d.m, d.Id, d.Ip) for d in rotor.disk_elements]
    bearings = [
        ross.BearingElement(pieces * b.n, **{c: float(getattr(b, c)[0]) for c in COEFFICIENTS})
        for b in rotor.bearing_elements
    ]
    return ross.Rotor(elements, discs, bearings)


def _lateral(rotor, speed, modes):
    """[real, imaginary] of the lowest lateral poles; axial and torsional ones are left out."""
    modal = rotor.run_modal(speed, num_modes=8 * modes, synchronous=False)
    kept = []
    for value, vector in zip(modal.evalues, modal.evectors.T):
        motion = np.abs(vector[: rotor.ndof].reshape(-1, 6)) ** 2
        if value.imag > 1 and motion[:, LATERAL].sum() > 0.5 * motion.sum():
            kept.append([float(value.real), float(value.imag)])
    return sorted(kept, key=lambda pole: pole[1])[: 2 * modes]


def _plain(rotor):
    elements = [
        {
            "n": int(e.n), "length": float(e.L), "outer": [float(e.odl), float(e.odr)],
            "inner": [float(e.idl), float(e.idr)], "young_modulus": float(e.material.E),
            "density": float(e.material.rho), "poisson_ratio": float(e.material.Poisson),
        }
        for e in rotor.shaft_elements
    ]  # fmt: skip
    discs = [{"n": int(d.n), "mass": float(d.m), "inertia": float(d.Id), "polar": float(d.Ip)}
             for d in rotor.disk_elements]  # fmt: skip
    bearings = [{"n": int(b.n)} | {c: float(getattr(b, c)[0]) for c in COEFFICIENTS} for b in rotor.bearing_elements]
    return {"elements": elements, "discs": discs, "bearings": bearings}


if __name__ == "__main__":
    main(**json.loads(sys.argv[1]))
