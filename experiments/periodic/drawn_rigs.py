"""Rigs of every kind of clearance, drawn with a seed: chains of masses and shafts, laws, levels at which they touch."""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

import clearance_mj as cm
from clearance_mj.clearance import ConstantLaw, ContactLaw, HuntCrossley1975, KelvinVoigt, MaxwellSlip
from clearance_mj.clearance.record import fillings_of
from clearance_mj.linear import linear_model
from clearance_mj.rig import Bushing, Contact, Friction, Grease, Load, OilFilm, Rig, Sensor, Shaker, Spin
from clearance_mj.structure import Disc, Material, Matrices, Section, Shaft, Support

MODES = 3
STEEL = Material(2.1e11, 7850.0)


class Drawn(NamedTuple):
    """A rig with its law, and what excites it."""

    kind: str
    model: cm.Model
    level: float  #: N, or N m of teeth
    frequency: float  #: Hz, the first of the branch


def law_of(rng: np.random.Generator, stiffness: float, n: int) -> tuple[cm.Law, Grease]:
    """Law of all clearances, by a stiffness of the structure, N/m, and the grease that the rig's file has."""
    contact, rate = stiffness * rng.uniform(5, 25), stiffness / (2 * np.pi * 40)
    spring, damper = stiffness * rng.uniform(0.05, 0.3), rate * rng.uniform(0.01, 0.04)
    grease = Grease(0.0)
    kind = rng.integers(5)
    if kind == 1:
        grease = Grease(spring, damper)
    if kind == 2:
        grease = Grease(spring, damper, film_height=float(rng.uniform(3e-4, 6e-4)))
    if kind == 4:
        return ContactLaw(HuntCrossley1975(contact * 100.0, contact * rng.uniform(20, 60), 1.5)), grease
    if kind == 3:
        sliders = MaxwellSlip(
            springs=(spring, spring / 2), forces=(spring * 1e-5, spring * 1e-5), elastic=spring, damping=damper
        )
        return ContactLaw(KelvinVoigt(contact, 0.05 * rate * rng.uniform(1, 4)), sliders), Grease(0.0)
    return ConstantLaw([contact] * n, [rate * rng.uniform(0.05, 0.2)] * n), grease


def chain(rng: np.random.Generator, held: bool = True) -> tuple[Matrices, list[str], float]:
    """Masses on springs, one to three of them, their degrees of freedom, and the lowest natural frequency, Hz."""
    n = int(rng.integers(1, 4))
    mass, spring = np.diag(rng.uniform(0.5, 1.5, n)), rng.uniform(2e4, 5e4, n + 1)
    spring[0], spring[-1] = (spring[0], 0.3 * spring[-1]) if held else (0.0, 0.0)
    k = np.diag(spring[:-1] + spring[1:]) - np.diag(spring[1:-1], 1) - np.diag(spring[1:-1], -1)
    dofs = [f"{i + 1}:X" for i in range(n)]
    values = np.linalg.eigvals(np.linalg.solve(mass, k))
    lowest = float(np.sqrt(np.min(values[values > 1e-3], initial=3e4))) / (2 * np.pi)
    damping = rng.uniform(0.02, 0.05) / (np.pi * lowest) * k + (0.0 if held else rng.uniform(5, 15)) * mass
    return Matrices("m-kg-s", mass=mass, stiffness=k, damping=damping, dofs=dofs), dofs, lowest


def shaft(rng: np.random.Generator, **settings: object) -> tuple[Shaft, float, float, float]:
    """A pinned shaft with a disc, its length, m, lowest natural frequency, Hz, and stiffness in its middle, N/m."""
    length, diameter, mass = rng.uniform(0.4, 0.7), rng.uniform(0.007, 0.011), rng.uniform(0.3, 0.8)
    stiffness = 48 * STEEL.young_modulus * np.pi * diameter**4 / 64 / length**3
    lowest = np.sqrt(stiffness / (mass + (0.5 * STEEL.density * np.pi * diameter**2 / 4 * length))) / (2 * np.pi)
    ratio = rng.uniform(0.02, 0.05)
    structure = Shaft(
        (Section(length, diameter),), (Support(0.0, "pinned"), Support(length, "pinned")),
        (Disc(0.5 * length, mass, 1e-4, polar_inertia=1.5e-4),), STEEL,
        (2 * ratio * np.pi * lowest, ratio / (2 * np.pi * lowest)), theory="euler", **settings,
    )  # fmt: skip
    return structure, float(length), float(lowest), float(stiffness)


def everywhere(length: float, across: bool) -> tuple[Sensor, ...]:
    """Probes that know every mode of a shaft, along z and y."""
    places = length * np.arange(1, 10) / 10
    along = [Sensor(i + 1, float(x), quantity="displacement") for i, x in enumerate(places)]
    if across:
        along += [
            Sensor(i + 11, float(x), quantity="displacement", direction=(0.0, 1.0, 0.0)) for i, x in enumerate(places)
        ]
    return tuple(along)


def gap_and_offset(rng: np.random.Generator) -> dict[str, float]:
    gap = float(rng.uniform(5e-5, 2e-4))
    return {"gap": gap, "offset": float(rng.uniform(-0.4, 0.4) * gap) if rng.random() < 0.5 else 0.0}


def on_chain(rng: np.random.Generator, kind: str) -> Drawn:
    """Slots, one-sided stops or teeth of a chain of masses."""
    teeth = kind == "teeth under a mean torque"
    structure, dofs, lowest = chain(rng, not teeth)
    places = dofs[:1] if teeth else list(rng.permutation(dofs)[: rng.integers(1, len(dofs) + 1)])
    law, grease = law_of(rng, 3e4, len(places))
    bushings = []
    for place in places:
        stops = str(rng.choice(["upper", "lower"])) if kind == "one-sided stop" else "both"
        bushing_grease = Grease(0.0) if teeth else grease
        bushings.append(Bushing(str(place), length=0.0, grease=bushing_grease, contact=Contact(1e5), stops=stops,
                                **gap_and_offset(rng)))  # fmt: skip
    if teeth:
        law = ContactLaw(KelvinVoigt(float(rng.uniform(2e4, 6e4)), float(rng.uniform(2, 10))))
    sensors = tuple(Sensor(i + 1, dof, quantity="displacement") for i, dof in enumerate(dofs))
    rig = Rig("drawn", None, tuple(bushings), sensors, structure=structure, shaker=Shaker("force", dofs[-1]))
    if teeth:
        torque = float(rng.uniform(1, 5))
        rig = rig.replace(loads=(Load(dofs[0], force=torque),))
        resonance = math.sqrt(law.contact[0].stiffness / np.trace(structure.mass)) / (2 * np.pi)
        return Drawn(kind, cm.Model(rig, law), torque * rng.uniform(0.5, 1.5), resonance * rng.uniform(0.6, 1.4))
    return excited(rng, kind, cm.Model(rig, law), lowest)


def on_shaft(rng: np.random.Generator, kind: str) -> Drawn:
    """Clearances of a shaft, with its weight, turning or not."""
    structure, length, lowest, stiffness = shaft(rng)
    across = kind.startswith("round") or kind == "both kinds in one rig"
    count = int(rng.integers(1, 3))
    law, grease = law_of(rng, stiffness, count)
    friction = Friction(float(rng.uniform(0.02, 0.12)), stiffness=3 * stiffness, damping=1.0)
    shapes = {"shape": "round"} if across else {}
    bushings = []
    for x in np.sort(rng.choice([0.35, 0.45, 0.6, 0.7], count, replace=False)) * length:
        fields = {**gap_and_offset(rng), **shapes}
        if across:
            fields["offset_y"] = 0.2 * fields["gap"]
        if kind == "round turning with friction":
            fields["friction"] = friction
        if kind == "round turning with film":
            film = OilFilm(float(rng.uniform(1e-3, 5e-3)), cavitated=False, asperities=0.2 * fields["gap"])
            fields |= {"length": 0.01, "film": film}
        bushings.append(Bushing(float(x), contact=Contact(10 * stiffness, 5.0), **{
            "length": 0.0, "grease": Grease(0.0) if "film" in fields else grease, **fields
        }))  # fmt: skip
    if kind == "round turning with film":
        law = None
    if kind == "both kinds in one rig":
        law = None
        bushings[-1:] = [
            Bushing(bushings[-1].position, length=0.0, grease=Grease(0.1 * stiffness, 1.0), stops="lower",
                    contact=Contact(10 * stiffness, 5.0), **gap_and_offset(rng)),
            Bushing(0.3 * length, 1.5e-4, 0.0, Grease(0.0), Contact(10 * stiffness, 5.0), shape="round"),
        ]  # fmt: skip
    direction = (0.0, float(rng.uniform(0.2, 0.8)), 1.0) if across else None
    rig = Rig(
        "drawn", None, tuple(bushings), everywhere(length, across), structure=structure,
        shaker=Shaker("force", 0.5 * length, direction=direction) if direction else Shaker("force", 0.5 * length),
    )  # fmt: skip
    if kind.startswith("round turning"):
        rig = rig.replace(spin=Spin(float(rng.uniform(5, 50))))
    if kind != "slot without weight":  # it sags by about a gap
        weight = rng.uniform(0.2, 1.2) * min(b.gap for b in bushings) * (2 * np.pi * lowest) ** 2
        rig = rig.replace(gravity=(0.0, 0.0, -float(weight)))
    return excited(rng, kind, cm.Model(rig, law), lowest)


def rubbing_slot(rng: np.random.Generator, kind: str) -> Drawn:
    """One mass that a slot stops along x and rubs along y."""
    k = rng.uniform(2e4, 5e4, 2)
    rub = Friction(float(rng.uniform(0.1, 0.3)), stiffness=3e4, damping=3.0, along="1:Y")
    bushing = Bushing("1:X", length=0.0, grease=Grease(2e3, 3.0), contact=Contact(2e5, 10.0), friction=rub,
                      **gap_and_offset(rng))  # fmt: skip
    structure = Matrices(
        "m-kg-s", mass=np.eye(2), stiffness=[[k[0], 0.2 * k[0]], [0.2 * k[0], k[1]]],
        damping=np.diag(k) * rng.uniform(1e-4, 3e-4), dofs=["1:X", "1:Y"],
    )  # fmt: skip
    sensors = tuple(Sensor(i + 1, dof, quantity="displacement") for i, dof in enumerate(("1:X", "1:Y")))
    rig = Rig("drawn", None, (bushing,), sensors, structure=structure, shaker=Shaker("force", "1:X"))
    return excited(rng, kind, cm.Model(rig), float(np.sqrt(k[0])) / (2 * np.pi))


def excited(rng: np.random.Generator, kind: str, model: cm.Model, lowest: float) -> Drawn:
    """The rig at a frequency and a level that would move it without walls by one to three gaps; in oil by about one."""
    rig, frequency = model.rig, lowest * rng.uniform(0.55, 1.7)
    linear = linear_model(rig, MODES).filled(*small_motions(model))
    moved = linear.at_bushings @ np.linalg.solve(
        linear.dynamic(2 * np.pi * frequency, rig.spin.speed if rig.spin else 0.0), linear.input("force")
    )
    gaps = np.array([rig.bushings[j].gap for j in rig.bushing_of_row])
    far = rng.uniform(0.8, 1.6) if any(b.film for b in rig.bushings) else rng.uniform(1.2, 3.0)
    return Drawn(kind, model, float(far / np.max(np.abs(moved) / gaps)), frequency)


def small_motions(model: cm.Model) -> tuple[np.ndarray, np.ndarray]:
    """Stiffness and damping of all fillings."""
    k, c = np.transpose([filling.small_motion() for filling in fillings_of(model.rig, model.law)])
    return k, c


KINDS: dict[str, Callable[[np.random.Generator, str], Drawn]] = {
    "slot": on_chain, "one-sided stop": on_chain, "teeth under a mean torque": on_chain,
    "slot without weight": on_shaft, "slot under weight": on_shaft, "slot with friction": rubbing_slot,
    "round": on_shaft, "round turning with friction": on_shaft, "round turning with film": on_shaft,
    "both kinds in one rig": on_shaft,
}  # fmt: skip


def draw(number: int, seed: int = 0) -> Drawn:
    """Return the rig of a number: kinds take turns."""
    kind = list(KINDS)[number % len(KINDS)]
    return KINDS[kind](np.random.default_rng((seed, number)), kind)
