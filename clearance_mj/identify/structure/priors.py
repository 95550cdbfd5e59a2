"""Open parameters of a rig file: its uncertain numbers as parameters with priors, and the rig with other values.

A tolerance of the rig file (`Tolerance`) goes before these standard deviations: Young's modulus 3 %, density 1 %,
masses 5 %, places of bushings and sensors 2 mm, gains 1 %, modal damping a factor of 2, gap 20 %, offset 0.3 of the
gap, a bushing's length by half; grease is free within decades. So are the springs of a shaft's supports; rigid ones
begin as stiff springs, unless a tolerance says that they are exact ("0 %" of "structure.supports.translation"). A clamp
of a beam varies by its compliance, so that rigid is a value like others: it gives as 0 to 2 diameters more shaft would,
unless the rig file says how much.
"""

from __future__ import annotations

import dataclasses
import functools
import math
import operator
from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Any, cast

import numpy as np

from ...calibrate.free import with_values
from ...core.kinds import checks_kinds
from ...core.overview import few
from ...core.plain_numbers import Key, find_numbers, get_number, path_of
from ...estimate.parameter import Parameter
from ...rig import Rig
from ...rig.dimensions import directed_points
from ...rig.tolerance import CLAMP_COMPLIANCES, Tolerance, unit_of
from ...structure import Beam, Shaft
from ...structure.attached import LARGEST_DIFFERENCE, MAX_DAMPING
from ...structure.base import is_rotation, parse_direction, parse_place
from ...structure.beam import Clamp
from ...structure.section import HELD

__all__ = ["CRITICAL", "parameter_words", "priors", "rig_with", "unsaid_words", "with_exact_supports"]

CRITICAL = 1.0  # damping ratio that no mode of a rig may exceed
LONGEST_DELAY = 0.05  # s, of a channel
OF_SUPPORT = ("translation", "rotation", "translation_damping", "rotation_damping")
DEFAULTS = {
    "young_modulus": 0.03, "density": 0.01, "mass": 0.05, "position": 2e-3, "gain": 0.01, "gap": 0.2, "offset": 0.3,
    "length": 0.5, "lever": 2e-3, "frequency": 0.1, "participation": 0.1, "rocking": 0.02, "about": 0.02, "angle": 0.2,
    "delay": 2e-5, "probe_delay": 2e-5, "inertia": 0.05, "polar_inertia": 0.05, "direction": 0.02, "probe_angle": 0.035,
    "offset_y": 0.3, **dict.fromkeys(("stiffness", "damping", *OF_SUPPORT), math.log(10.0)),
    **dict.fromkeys(("damping_ratios", "damping_ratio", "difference"), math.log(2.0)),
    **dict.fromkeys(("coefficient", "viscosity"), math.log(1.5)),
}  # fmt: skip
"""1 σ: of positions in m, of offsets over the gap, of the rest relative or a logarithm; of linear ones in SI units"""
_SPATIAL = (("friction", "coefficient"), ("film", "viscosity"))
RANGES = {
    "damping_ratios": (0.0, CRITICAL), "damping_ratio": (0.0, MAX_DAMPING), "difference": (0.0, LARGEST_DIFFERENCE),
    "angle": (0.01, math.pi / 2 - 0.01), **dict.fromkeys(("delay", "probe_delay"), (-LONGEST_DELAY, LONGEST_DELAY)),
}  # fmt: skip
"""Fields that end where no rig can be, SI units"""
SHORTEST = 0.01  # of a shaft's length: 1 σ of a bushing's length at least
LONGEST = 3.0  # standard deviations by which a bushing may be longer
LINEAR = ("participation", "rocking", "about", "angle", "delay", "probe_delay", "lever", "direction", "probe_angle")
"""Fields that may be 0 or negative, and vary as they are"""
BOUNDS_AT = 6.0  # standard deviations, from the start to a parameter's bounds
CLAMP_LENGTH = 2.0  # diameters of shaft as which a clamp may give
OF_ATTACHED = {
    "springs": ("stiffness", "damping", "position"),
    "oscillators": ("mass", "frequency", "damping_ratio", "position", "lever"),
    "fixture": ("frequency", "damping_ratio", "participation", "rocking"),
}
"""Uncertain fields of attached parts; those that may be 0 are uncertain where they are not"""
SUPPORT_LOSS = 0.01  # of its force, that of its damper at the shaft's lowest frequency
STIFF_SUPPORT, STIFF_TURN = 3e3, 3e2  # of EI/L³ and EI/L, the support of a shaft that the rig file takes for rigid
STEEL = 2.1e11  # N/m², of a shaft whose rig file does not say
RATIOS = 8  # largest number of modes with a damping ratio each
DAMPED_BAND = 1.3  # of the highest frequency: up to here modes have one, and the next one above
PROBE_GAIN = 0.01  # 1 σ of a probe's gain
LISTED = 6  # parameters at most that are named of those that records say nothing about
LOWEST_DAMPING = 1e-3  # lowest damping ratio to start from
MAX_OFFSET = 0.9  # of the gap: the largest offset
LEFT_OUT = {"gain": 1.0, "offset": 0.0, "offset_y": 0.0, "delay": 0.0, "probe_delay": 0.0, "probe_angle": 0.0}
"""Values of fields that plain data leave out"""
MOVING_CLAMP = 1.0  # 1 σ of the logarithm of the stiffness below a clamp whose block has a mass
CLAMP_UNITS = {"1/beam.clamp.rotation": "rad/(N m)", "1/beam.clamp.translation": "m/N"}


def parameter_words(name: str) -> str:
    """Return a parameter's name for readers: its path in the rig file, or the compliance of a clamp.

    Parameters
    ----------
    name : str
        Such as "1/beam.clamp.rotation".
    """
    return f"compliance of the clamp's {name.rpartition('.')[2]}" if name in CLAMP_UNITS else name


def unsaid_words(names: Sequence[str], before: str = "of the rig file, within its tolerance") -> str:
    """Return in words that records say nothing about parameters, and the values that these keep.

    Parameters
    ----------
    names : sequence of str
        Names of the parameters.
    before : str
        Whose values they keep.
    """
    words = "its value is that" if len(names) == 1 else "values are those"
    return f"the records say nothing about {few([*map(parameter_words, names)], LISTED)}: {words} {before}"


@checks_kinds
def priors(rig: Rig, highest: float = math.inf, probes: bool = False) -> tuple[Parameter, ...]:
    """Return the open parameters of a rig file with their priors.

    Parameters
    ----------
    rig : Rig
        The rig; numbers that a tolerance says to be exact ("0 %") are left out.
    highest : float
        Hz, upper end of the records' band: the damping ratios of modes far above it are left out.
    probes : bool
        Gains and places of the displacement probes too, "probes[0].gain" and "probes[0].position": they are no part of
        a rig.

    Returns
    -------
    tuple of Parameter
        Named by their paths in ``prepared_rig(rig)``; "1/beam.clamp.rotation" is the compliance of the clamp.
    """
    base = prepared_rig(rig)
    damped = int(np.sum(rig.reduction(2 * RATIOS).omega < 2 * np.pi * DAMPED_BAND * highest)) + 1
    data = base.to_dict()
    unsaid = list(_open_keys(data, damped))
    tolerances = [tolerance for tolerance in rig.tolerances if not tolerance.of.endswith(".wear")]  # by no vibration
    tolerance_of = {key: t for t in tolerances if t.of not in CLAMP_COMPLIANCES for key in find_numbers(data, t.of)}
    keys = [*(key for key in unsaid if key not in tolerance_of), *tolerance_of]
    places = [get_number(data, ("bushings", j, "position")) for j in range(len(rig.bushings) if probes else 0)]
    parameters = list(_clamp_parameters(rig))
    parameters += filter(None, [_parameter(base, data, key, tolerance_of.get(key)) for key in keys])
    for j, (bushing, rows, place) in enumerate(zip(rig.bushings, rig.clearance_rows, places)):
        parameters += [_logarithm(f"probes[{i}].gain", "", 1.0, PROBE_GAIN) for i in range(rows.start, rows.stop)]
        if place is not None and bushing.to is None:
            ends = _shaft_ends(rig, bushing.position)
            parameters.append(_linear(f"probes[{j}].position", "m", place, DEFAULTS["position"], *ends))
    return tuple(parameters)


@functools.lru_cache(maxsize=16)
def prepared_rig(rig: Rig) -> Rig:
    """Return the same rig, the Rayleigh damping of its shaft as the damping ratios of its lowest modes.

    Rigid supports that hold its shaft are stiff springs, and discs that are thin have one inertia. In space the
    directions of its sensors are vectors.
    """
    linear = rig.linear
    if not isinstance(linear, Beam | Shaft):
        return rig
    if isinstance(linear, Shaft):
        linear = _on_elastic_supports(linear, _exact_supports(rig), "RX" in directed_points(rig).values())
    rig = rig.replace(tolerances=(), structure=None if rig.beam else linear)
    if rig.moves_across:
        sensors = (
            dataclasses.replace(s, direction=tuple(s.unit_direction.tolist()))
            if parse_direction(s.position) is None else s for s in rig.sensors
        )  # fmt: skip
        rig = rig.replace(sensors=tuple(sensors))
    omega = rig.reduction(2 * RATIOS).omega[:RATIOS]
    given = linear.damping_ratios or (0.0,)
    eta1, eta2 = linear.rayleigh
    safe = np.where(omega > 0, omega, np.inf)
    ratios = eta1 / (2 * safe) + eta2 * omega / 2 + [given[min(i, len(given) - 1)] for i in range(omega.size)]
    damping_ratios = tuple(np.clip(ratios, LOWEST_DAMPING, 1.0).tolist())
    damped = dataclasses.replace(linear, rayleigh=(0.0, 0.0), damping_ratios=damping_ratios)
    return rig.replace(**{"beam" if rig.beam else "structure": damped})


def _exact_supports(rig: Rig) -> set[str | int]:
    """Return the indices of the supports that a tolerance says to be exact."""
    exact = (t.of for t in rig.tolerances if t.size == 0 and t.of.startswith("structure.supports"))
    return {key[2] for path in exact for key in find_numbers(rig.to_dict(), path)}


def with_exact_supports(rig: Rig) -> Rig:
    """Return the rig as its file has it: a shaft's supports as rigid as they are drawn."""
    exact = (Tolerance("structure.supports.translation", "0 %"),) if isinstance(rig.linear, Shaft) else ()
    return rig.replace(tolerances=rig.tolerances + exact)


def _on_elastic_supports(shaft: Shaft, exact: Collection[str | int], twists: bool) -> Shaft:
    """Return the shaft with springs for rigid supports that are not exact, and with thin discs by one inertia."""
    material = shaft.material or shaft.sections[0].material
    thickest = max(float(each.across(np.array([0.5]), 0.3).second_moment[0]) for each in shaft.sections)
    bending = (material.young_modulus if material else STEEL) * thickest
    stiff, turn = STIFF_SUPPORT * bending / shaft.length**3, STIFF_TURN * bending / shaft.length
    lowest = math.pi**2 * math.sqrt(bending / (shaft.total_mass * shaft.length**3))  # rad/s, on pins
    springs = {"translation": stiff, "translation_damping": SUPPORT_LOSS * stiff / lowest}, {"rotation": turn}
    supports = list(shaft.supports)
    for i, support in enumerate(supports):
        if twists and support.holds_twist:
            supports[i] = dataclasses.replace(support, twist="rigid")
        for direction in HELD[support.kind] if i not in exact else ():
            supports[i] = dataclasses.replace(supports[i], kind="elastic", **springs[direction])
    thin = tuple(
        dataclasses.replace(d, polar_inertia=None) if d.polar_inertia == 2 * d.inertia else d for d in shaft.discs
    )
    return dataclasses.replace(shaft, supports=tuple(supports), discs=thin)


def rig_with(rig: Rig, values: Mapping[str, float]) -> Rig:
    """Return the prepared rig with other values of parameters that `priors` names; those of probes count for nothing.

    Parameters
    ----------
    rig : Rig
        The rig.
    values : mapping of str to float
        SI units, by name.
    """
    base = prepared_rig(rig)
    if base.beam and any(name in values for name in CLAMP_UNITS):
        clamp_of_file = base.beam.clamp or Clamp()
        compliance = {name: 1 / k for name in ("rotation", "translation") if (k := getattr(clamp_of_file, name))}
        compliance |= {name.rpartition(".")[2]: values[name] for name in CLAMP_UNITS if name in values}
        springs = {name: 1 / c for name, c in compliance.items() if c}
        dampers = {f"{name}_damping": getattr(clamp_of_file, f"{name}_damping") for name in springs}
        clamp = Clamp(**springs, **dampers, mass=clamp_of_file.mass)
        base = base.replace(beam=dataclasses.replace(base.beam, clamp=clamp if clamp != Clamp() else None))
    data = base.to_dict()
    paths = [name for name in values if name not in CLAMP_UNITS and not name.startswith("probes[")]
    numbers = {find_numbers(data, path)[0]: values[path] for path in paths}
    for key, value in numbers.items():
        if key[-1] == "polar_inertia":  # of a body, at most twice that about a diameter
            numbers[key] = min(value, 2 * numbers.get((*key[:-1], "inertia"), value))
    return with_values(base, numbers)


def _open_keys(data: dict[str, Any], damped: int) -> Iterator[Key]:
    """Yield the numbers that are uncertain where the rig file says nothing."""
    structure, name = data.get("structure", {}), "beam" if "beam" in data else "structure"
    shaft = structure if structure.get("kind") == "shaft" else {}
    sections, discs = enumerate(shaft.get("sections", ())), range(len(shaft.get("discs", ())))
    materials: list[Key] = [("beam",)] * ("beam" in data) + [("structure", "material")] * ("material" in shaft)
    materials += [("structure", "sections", i, "material") for i, section in sections if "material" in section]
    yield from ((*material, name) for material in materials for name in ("young_modulus", "density"))
    yield from (("structure", "discs", i, "mass") for i in discs)
    if data.get("spin") or any(b.get("shape") == "round" for b in data["bushings"]):
        yield from (("structure", "discs", i, name) for i in discs for name in ("inertia", "polar_inertia"))
    if "beam" in data or shaft:
        yield from ((name, "damping_ratios", i) for i in range(min(damped, len(data[name]["damping_ratios"]))))
    yield from (("masses", i, "mass") for i in range(len(data["masses"])))
    yield from _attached_keys(data)
    for j, bushing in enumerate(data["bushings"]):
        yield from (("bushings", j, "grease", name) for name in ("stiffness", "damping"))
        yield from (("bushings", j, name) for name in ("position", "gap", "offset"))
        if bushing.get("shape") == "round":
            yield from (("bushings", j, name) for name in ("offset_y", "probe_angle"))
            yield from (("bushings", j, *key) for key in _SPATIAL if key[0] in bushing)
        if parse_place(bushing["position"]) and not is_rotation(bushing["position"]):
            yield ("bushings", j, "length")
    for i, sensor in enumerate(data["sensors"]):
        yield from (("sensors", i, name) for name in ("position", "gain")[sensor.get("quantity") == "force" :])
    for i, sensor in enumerate(data["sensors"]):
        if along := sensor.get("direction"):
            # What is across its direction in the plane: a component of a vector that keeps its main one.
            yield ("sensors", i, "direction", 1 if abs(along[2]) > abs(along[1]) else 2)
    supports = range(len(shaft.get("supports", ())))
    yield from (("structure", "supports", i, name) for i in supports for name in OF_SUPPORT)


def _attached_keys(data: dict[str, Any]) -> Iterator[Key]:
    """Yield the uncertain numbers of supports and attached parts, where the rig file has them."""
    clamp = (data.get("beam") or {}).get("clamp") or {}
    yield from (("beam", "clamp", n) for n in ("mass", "translation_damping", "rotation_damping") if n in clamp)
    for part, names in OF_ATTACHED.items():
        for i, entry in enumerate(data.get(part, ())):
            yield from ((part, i, name) for name in names if name not in LINEAR or entry[name])
    if "planes" in data:
        yield from (("planes", name) for name in ("difference", "angle"))
    for j, bushing in enumerate(data["bushings"]):
        if "housing" in bushing:
            yield from (("bushings", j, "housing", name) for name in ("stiffness", "mass", "damping"))
        if "probe_delay" in bushing:
            yield ("bushings", j, "probe_delay")
    yield from (("sensors", i, "delay") for i, sensor in enumerate(data["sensors"]) if "delay" in sensor)


def _parameter(rig: Rig, data: dict[str, Any], key: Key, tolerance: Tolerance | None) -> Parameter | None:
    """Return a number with its prior; None if it is exact, or no number."""
    path, value = path_of(key), get_number(data, key)
    value = LEFT_OUT.get(str(key[-1])) if value is None else value
    if value is None or (tolerance and tolerance.size == 0):
        return None
    field = str(key[-1] if isinstance(key[-1], str) else key[-2])
    unit, size = unit_of(path), tolerance.size if tolerance else DEFAULTS[field]
    if field in ("offset", "offset_y"):
        gap = data["bushings"][key[1]]["gap"]
        size *= gap if tolerance is None or tolerance.relative else 1.0
        return _linear(path, unit, value, size, -MAX_OFFSET * gap, MAX_OFFSET * gap)
    if field == "length" and key[0] == "bushings":
        place = data["bushings"][key[1]]["position"]
        low, high = _shaft_ends(rig, place)
        along = place if isinstance(place, float) else (parse_place(place) or ("", low))[1]
        if tolerance is None or tolerance.relative:
            size = max(size * value, SHORTEST * (high - low))
        return _linear(path, unit, value, size, 0.0, min(2 * min(along - low, high - along), value + LONGEST * size))
    if field in ("position", "to"):
        size *= abs(value) if tolerance and tolerance.relative else 1.0
        half = data["bushings"][key[1]]["length"] / 2 if key[0] == "bushings" else 0.0
        low, high = _shaft_ends(rig, functools.reduce(operator.getitem, key, cast(Any, data)))
        return _linear(path, unit, value, size, low + half, high - half)
    if tolerance and not tolerance.relative and field not in LINEAR:
        return _linear(path, unit, value, size, 1e-6 * value, math.inf)
    if field in LINEAR:
        size *= abs(value) if tolerance and tolerance.relative else 1.0
        return _linear(path, unit, value, size, *RANGES.get(field, (-math.inf, math.inf)))
    largest = RANGES.get(field, (0.0, math.inf))[1]
    return _logarithm(path, unit, value, size, largest) if value > 0 else None


def _shaft_ends(rig: Rig, place: float | str) -> tuple[float, float]:
    """Return the ends of the shaft of a place such as "inner@0.4"; a clamped one begins a little beyond its clamp."""
    name, _ = parse_place(place) or ("", 0.0)
    shaft = {shaft.name: shaft for shaft in rig.linear.shafts}[name]
    return shaft.start + (1e-3 * shaft.length if rig.beam else 0.0), shaft.end


def _clamp_parameters(rig: Rig) -> Iterator[Parameter]:
    """Compliances of a beam's clamp: a/(EI) and a³/(3EI) as of a more shaft, a uniform from 0 to two diameters."""
    if not rig.beam:
        return
    beam, clamp = rig.beam, rig.beam.clamp or Clamp()
    longest = CLAMP_LENGTH * (beam.diameter or beam.height or 0.0)
    tolerances = {t.of.rpartition(".")[2]: t.size for t in rig.tolerances if t.of in CLAMP_COMPLIANCES}
    for name, power in (("rotation", 1), ("translation", 3)):
        unit, path = power * beam.bending_stiffness, f"1/beam.clamp.{name}"
        mean = longest**power / (power + 1)
        spread = longest**power * math.sqrt(1 / (2 * power + 1) - 1 / (power + 1) ** 2)
        stiffness = getattr(clamp, name)
        if name == "translation" and clamp.mass:
            yield _logarithm("beam.clamp.translation", "N/m", stiffness, MOVING_CLAMP)
            continue
        if stiffness or name in tolerances:
            mean = unit / stiffness if stiffness else 0.0
        spread = tolerances[name] ** power if name in tolerances else spread
        if spread > 0:
            yield _linear(path, CLAMP_UNITS[path], mean / unit, spread / unit, 0.0, math.inf)


def _linear(name: str, unit: str, start: float, std: float, low: float, high: float) -> Parameter:
    reach = BOUNDS_AT * std
    return Parameter(name, unit, start, max(low, start - reach), min(high, start + reach), std, "linear")


def _logarithm(name: str, unit: str, start: float, std: float, largest: float = math.inf) -> Parameter:
    factor = math.exp(BOUNDS_AT * std)
    return Parameter(name, unit, start, start / factor, min(start * factor, largest), std, "log")
