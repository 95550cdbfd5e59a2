"""Controls of the page by name: the excitation, weight and spin, every number of the clearances and the law."""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from ..clearance import ConstantLaw, ContactLaw, Law
from ..core.errors import ClearanceError
from ..core.quantities import GRAVITY
from ..core.validation import json_schema
from ..io.dataset import Dataset
from ..model import Model
from ..rig import Bushing, Friction, Grease, Rig, Spin
from ..structure.base import is_rotation, parse_place
from .control import Control, Value

__all__ = ["NONE", "RECORD", "Control", "Value", "build_model", "checked_values", "controls"]

RECORD = "record: "  # before the name of a record whose measured excitation drives the rig
MAX_SAMPLES = 250_000  # of one simulation; the page stays a page
LARGEST_NUMBER = 1e300  # of any number
BAND = (5.0, 220.0)  # Hz, of noise without records that say theirs
LENGTHS = ("gap", "offset", "film_height")  # fields in m, shown in µm
RPM = 30 / math.pi
FASTEST = 1000.0  # rad/s, to which the slider of a rig without a spin reaches
DOWN = (0.0, 0.0, -1.0)
MOST_FRICTION = 0.5
NONE = "none"
EXCITATIONS = ("random", "multisine", "burst random", "level ramp", "sweep up", "sweep down", "impacts", "sine")
_UNIT = re.compile(r"^[^,:]*, ([^,:;]+)")


def controls(model: Model, dataset: Dataset | None = None) -> tuple[Control, ...]:
    """Return everything that can be moved, in the order of the page."""
    sliders = [*_of_excitation(model.rig, dataset), *_of_motion(model.rig)]
    for i, bushing in enumerate(model.rig.bushings):
        sliders += _of_bushing(model.rig, model.law, i, bushing)
    return tuple(sliders)


def _of_excitation(rig: Rig, dataset: Dataset | None) -> Iterator[Control]:
    group = "Excitation"
    kinds = tuple(k for k in ("base", "force") if not rig.linear.refusal(k) and (k == "base" or rig.shaker.forces))
    records = tuple(RECORD + r.name for r in dataset.records) if dataset else ()
    fs = dataset.records[0].fs if dataset else 2048.0
    low, high = next((r.band for r in dataset.records if r.band), BAND) if dataset else BAND
    # In space weight and unbalance move the shaft as well.
    also, first = (NONE,) if rig.moves_across else (), NONE if rig.spin else "random"
    yield Control("excitation", group, "Kind", first, choices=also + EXCITATIONS + records)
    if len(kinds) > 1:
        yield Control("kind", group, "Drives the", rig.shaker.kind, choices=kinds)
    unit = "m/s² or N" if len(kinds) > 1 else "N" if "force" in kinds else "m/s²"
    yield Control("level", group, "Level, RMS", 2.0, unit, 1.0, 0.1, 40.0, log=True)
    yield Control("frequency", group, "Frequency of the sine", 20.0, "Hz", 1.0, 1.0, 250.0, log=True)
    yield Control("peak", group, "Peak of an impact", 50.0, unit, 1.0, 1.0, 1000.0, log=True)
    yield Control("width", group, "Width of an impact", 5e-3, "ms", 1e3, 1e-3, 5e-2, log=True)
    yield Control("band_low", group, "Band from", max(low, 0.1), "Hz", 1.0, min(1.0, max(low, 0.1)), 100.0, log=True)
    yield Control("band_high", group, "Band to", high, "Hz", 1.0, min(50.0, high), max(900.0, high), log=True)
    yield Control("seed", group, "Seed", 0.0, "", 1.0, 0.0, 99.0, whole=True)
    yield Control("duration", group, "Duration", 10.0, "s", 1.0, 4.0, 60.0)
    yield Control("fs", group, "Samples per second", fs, "Hz", 1.0, 512.0, 8192.0, log=True, whole=True)
    yield Control("resolution", group, "Lines every", 0.5, "Hz", 1.0, 0.2, 5.0, log=True)
    yield Control("engine", group, "Engine", "modal", choices=("modal", "links") if rig.linear.shafts else ("modal",))


def _of_motion(rig: Rig) -> Iterator[Control]:
    """Return the controls of the whole rig: weight, where it has some or moves across z, spin, unbalance."""
    group, pull = "Weight and spin", float(np.linalg.norm(rig.gravity or 0.0))
    if pull or rig.moves_across:
        yield Control("gravity", group, "Gravity", pull, "m/s²", 1.0, 0.0, max(2 * GRAVITY, 2 * pull))
    if spin := rig.spin:
        most = 2 * (spin.fastest or FASTEST)
        label = "Spin" if spin.until is None else "Spin at the start"
        yield Control("spin.speed", group, label, spin.speed, "rev/min", RPM, 0.0, most)
        if spin.until is not None:
            yield Control("spin.until", group, "Spin at the end", spin.until, "rev/min", RPM, 0.0, most)
        if spin.rate:
            yield Control.about("spin.rate", group, "Rate of the spin", abs(spin.rate), "rad/s²")
    for i, each in enumerate(rig.unbalances):
        label = f"Unbalance{f' {i + 1}' if len(rig.unbalances) > 1 else ''}"
        yield Control.about(f"unbalances[{i}].moment", group, label, each.moment, "g mm", 1e6)


def _of_bushing(rig: Rig, law: Law, i: int, bushing: Bushing) -> Iterator[Control]:
    group, name = f"Clearance {i + 1}, {bushing.where}", f"bushings[{i}]"
    gap, unit = bushing.gap, "µrad" if is_rotation(bushing.position) else "µm"
    yield Control.about(f"{name}.gap", group, "Gap", gap, unit, 1e6)
    yield Control(f"{name}.offset", group, "Offset at rest", bushing.offset, unit, 1e6, -gap, gap)
    if bushing.is_round:
        yield Control(f"{name}.offset_y", group, "Offset at rest along y", bushing.offset_y, "µm", 1e6, -gap, gap)
    if bushing.friction or (bushing.is_round and (bushing.radius or parse_place(bushing.position))):
        friction = bushing.friction.coefficient if bushing.friction else 0.0
        most = max(MOST_FRICTION, friction)
        yield Control(f"{name}.friction", group, "Friction coefficient", friction, "", 1.0, 0.0, most)
    if film := bushing.film:
        yield Control.about(f"{name}.viscosity", group, "Oil: viscosity", film.viscosity, "mPa s", 1e3)
    numbers, units = _contact(law, i, len(rig.bushings))
    for field, value in numbers.items():
        yield _number(f"{name}.contact.{field}", group, "Contact", field, value, units)
    if bushing.film:
        return
    grease = _grease(rig, law, i)
    for field, value in _numbers(grease).items():
        yield _number(f"{name}.grease.{field}", group, "Grease", field, value, _units(type(grease)))


def _number(name: str, group: str, of: str, field: str, value: float, units: Mapping[str, str]) -> Control:
    """Return a slider over a decade up and down, or where the value is zero or a ratio, over a sensible range."""
    unit, scale = ("µm", 1e6) if field in LENGTHS else (units.get(field, ""), 1.0)
    label = f"{of}: {field.replace('_', ' ')}"
    if field in ("elastic_ratio", "film_limit", "restitution"):
        return Control(name, group, label, value, unit, scale, 0.0 if field == "elastic_ratio" else 0.01, 1.0)
    if field in ("exponent", "static_ratio"):
        return Control(name, group, label, value, unit, scale, 1.0, max(4.0, value))
    if value > 0:
        return Control.about(name, group, label, value, unit, scale)
    reach = 100.0 if "stiffness" not in field else 1e5
    return Control(name, group, label, value, unit, scale, value - reach if value < 0 else 0.0, value + reach)


def _units(model: type) -> dict[str, str]:
    """Return the units of a model's fields, from the texts that document them."""
    fields = json_schema(model, "model")["properties"]
    units = {name: _UNIT.match(field.get("description", "")) for name, field in fields.items()}
    return {name: match[1].strip() for name, match in units.items() if match}


def _contact(law: Law, i: int, n: int) -> tuple[dict[str, float], dict[str, str]]:
    """Return numbers and units of a clearance's contact; of a schedule over time or amplitude, factors on k and c."""
    if isinstance(law, ContactLaw):
        contact = _model(law.contact, i)
        return _numbers(contact), _units(type(contact))
    if isinstance(law, ConstantLaw):
        return dict(zip("kc", law.table(n).parameters[0, i].tolist())), {"k": "N/m", "c": "N s/m"}
    return {"k": 1.0, "c": 1.0}, {"k": "×", "c": "×"}


def _numbers(model: Any) -> dict[str, float]:
    """Return the numbers of a contact or grease model; of several in one field, a factor on all."""
    linear = isinstance(model, Grease) and model.beta + model.gamma <= 0
    left_out = {"elastic_ratio", "amplitude", "beta", "gamma", "exponent"} if linear else set()
    left_out |= {"film_limit"} if getattr(model, "film_height", 1.0) is None else set()
    numbers = {}
    for field in dataclasses.fields(model):
        value = getattr(model, field.name)
        if field.name in left_out or isinstance(value, bool | str) or value is None:
            continue
        numbers[field.name] = 1.0 if isinstance(value, tuple) else float(value)
    return numbers


def _model(models: tuple[Any, ...], i: int) -> Any:
    return models[i if len(models) > 1 else 0]


def _grease(rig: Rig, law: Law, i: int) -> Any:
    return rig.bushings[i].grease if law.grease is None else _model(law.grease, i)


def checked_values(known: Mapping[str, Control], changes: Mapping[str, Any]) -> dict[str, Value]:
    """Return changes whose names and values controls have; a ClearanceError says which one is none."""
    checked: dict[str, Value] = {}
    for name, value in changes.items():
        if name not in known:
            raise ClearanceError(f"{name!r} is nothing that can be moved")
        control = known[name]
        if control.choices:
            if value not in control.choices:
                raise ClearanceError(f"{control.label}: {value!r} is unknown; use {', '.join(control.choices)}")
            checked[name] = value
            continue
        if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) < LARGEST_NUMBER:
            raise ClearanceError(f"{control.label}: needs a number, got {value!r}")
        if control.whole and (value != round(value) or not 0 <= value < 2**31):
            raise ClearanceError(f"{control.label}: needs a whole number from 0 to 2147483647, got {value!r}")
        checked[name] = float(value)
    return checked


def build_model(model: Model, values: Mapping[str, Value]) -> Model:
    """Return the model with the values of controls; what is impossible is a ClearanceError."""
    rig, law, n = model.rig, model.law, len(model.rig.bushings)
    if not n:
        return Model(rig.replace(**_motion_fields(rig, values)), law)
    greases = tuple(
        b.grease if b.film else _changed(_grease(rig, law, i), values, f"bushings[{i}].grease.")
        for i, b in enumerate(rig.bushings)
    )
    constant = law.grease is None
    bushings = tuple(
        dataclasses.replace(b, grease=greases[i] if constant else b.grease, **_fields_of(b, values, f"bushings[{i}]."))
        for i, b in enumerate(rig.bushings)
    )
    changed = rig.replace(bushings=bushings, **_motion_fields(rig, values))
    return Model(changed, _changed_law(law, values, n, None if constant else greases))


def _motion_fields(rig: Rig, values: Mapping[str, Value]) -> dict[str, Any]:
    """Return the fields of a rig that controls of `_of_motion` change."""
    pull = float(values.get("gravity", 0.0))
    along = np.array(rig.gravity or DOWN) / np.linalg.norm(rig.gravity or DOWN)
    unbalances = tuple(
        dataclasses.replace(each, moment=float(values[f"unbalances[{i}].moment"]))
        for i, each in enumerate(rig.unbalances)
    )
    gravity = tuple((pull * along).tolist()) if pull else None
    return {"gravity": gravity, "spin": rig.spin and _changed_spin(rig.spin, values), "unbalances": unbalances}


def _changed_spin(spin: Spin, values: Mapping[str, Value]) -> Spin:
    speed, rate, until = float(values["spin.speed"]), spin.rate, spin.until
    if rate:
        rate = math.copysign(float(values["spin.rate"]), rate)
    if until is not None:
        until = float(values["spin.until"])
        rate = math.copysign(rate, until - speed)
    if until == speed:
        rate, until = 0.0, None
    return dataclasses.replace(spin, speed=speed, rate=rate, until=until)


def _fields_of(bushing: Bushing, values: Mapping[str, Value], name: str) -> dict[str, Any]:
    """Return the fields of a bushing that its controls change, except its filling."""
    lengths = ("gap", "offset", "offset_y")
    fields: dict[str, Any] = {field: float(values[name + field]) for field in lengths if name + field in values}
    if f"{name}friction" in values:
        coefficient = float(values[f"{name}friction"])
        known = bushing.friction or (Friction(coefficient) if coefficient else None)
        fields["friction"] = known and dataclasses.replace(known, coefficient=coefficient)
    if bushing.film and f"{name}viscosity" in values:
        fields["film"] = dataclasses.replace(bushing.film, viscosity=float(values[f"{name}viscosity"]))
    return fields


def _changed_law(law: Law, values: Mapping[str, Value], n: int, grease: tuple[Any, ...] | None) -> Law:
    if isinstance(law, ContactLaw):
        contacts = tuple(_changed(_model(law.contact, i), values, f"bushings[{i}].contact.") for i in range(n))
        return ContactLaw(contacts, grease=grease)
    k, c = ([float(values[f"bushings[{i}].contact.{field}"]) for i in range(n)] for field in "kc")
    if isinstance(law, ConstantLaw):
        return ConstantLaw(k, c, grease=grease)
    return dataclasses.replace(law, k=law.k * k, c=law.c * c, grease=grease)  # type: ignore[type-var, attr-defined]


def _changed(model: Any, values: Mapping[str, Value], prefix: str) -> Any:
    new: dict[str, Any] = {}
    for name in _numbers(model):
        value, before = float(values[prefix + name]), getattr(model, name)
        new[name] = tuple(value * x for x in before) if isinstance(before, tuple) else value
    return dataclasses.replace(model, **new)
