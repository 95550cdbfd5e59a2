"""Stiffness and bearable load of a shaft's contact with a bushing, from material and geometry.

A layer on a rigid housing; lengths and moduli in SI units. Narrow contacts are Hertz's line contact, whose depth is
that of a layer of finite thickness and of a round shaft (Johnson, Contact Mechanics, 1985, equations 4.45, 5.56 and
5.57); wide ones a thin layer as an elastic foundation (section 5.8), with a curved contact arc. Compared with the exact
solution for a layer bonded to its housing, on a much harder shaft, either is within a fourth up to Poisson's ratios of
0.4, a third up to 0.45.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from ..core.errors import ClearanceError
from ..core.messages import either

__all__ = ["LAYER_MATERIALS", "LayerContact", "LayerMaterial", "layer_contact", "pressed_layer"]

NARROW = 0.5  # half width over the layer's thickness, below which a contact is Hertz's
LARGEST_RATIO = 0.45  # Poisson's; beyond it a thin layer deforms by lateral flow (Johnson, section 5.8)
YIELDS_AT = 1.67  # of the yield strength: elastic limit of a line contact's pressure (Johnson, 6.1, Tresca)
LIGHT = 0.1  # of that pressure, lightest load within the spread: a hundredth of Hertz's force
TILT = 0.3  # standard deviation of a logarithm: a tilted shaft touches over a part of the length
STEEL = 2.1e11, 0.3  # Young's modulus, Pa, and Poisson's ratio


class LayerMaterial(NamedTuple):
    """Material of a bushing's lining."""

    young_modulus: float  #: Pa
    poisson_ratio: float  #: up to 0.45
    yield_strength: float  #: Pa, in compression
    spread: float = 0.1  #: standard deviation of the logarithm of Young's modulus: of grades, moisture, temperature


class LayerContact(NamedTuple):
    """Proposed contact of a bushing."""

    stiffness: float  #: N/m, force over depth at a third of the bearable pressure
    spread: float  #: standard deviation of its logarithm: of the load, the material and the shaft's tilt
    bearable_depth: float  #: m, at the onset of yield
    bearable_force: float  #: N, there


LAYER_MATERIALS = {
    "bronze": LayerMaterial(111e9, 0.349, 150e6, 0.1), "babbitt": LayerMaterial(53e9, 0.35, 42e6, 0.1),
    "pom": LayerMaterial(3.0e9, 0.38, 60e6, 0.2), "pa66": LayerMaterial(2.5e9, 0.4, 60e6, 0.35),
    "peek": LayerMaterial(3.8e9, 0.4, 90e6, 0.1),
}  # fmt: skip
"""Usual values at 20 °C. Bronze: phosphor bronze, Budynas & Nisbett, Shigley's Mechanical Engineering Design, table
A-5, with the proof strength of cast CuSn12, EN 1982; babbitt: grade 2 of ASTM B23; polymers: Ashby, Materials Selection
in Mechanical Design, appendix A, polyamide from dry to moist."""


def layer_contact(
    material: str | LayerMaterial, thickness: float, length: float, radius: float, gap: float
) -> LayerContact:
    """Return the contact stiffness of a steel shaft in a bushing, from material and geometry.

    The stiffness hardly depends on the load as long as the contact is narrow, and the spread covers pressures from a
    tenth of the bearable one to all of it. Asperities and an elastic housing make a contact softer.

    Parameters
    ----------
    material : str or LayerMaterial
        One of `LAYER_MATERIALS` or another.
    thickness : float
        m, of the layer, on a rigid housing.
    length : float
        m, of the bushing.
    radius : float
        m, of the shaft.
    gap : float
        m, radial clearance.

    Returns
    -------
    LayerContact

    Raises
    ------
    ClearanceError
        For an unknown or incompressible material, or a size that is not positive.
    """
    properties = LAYER_MATERIALS.get(material) if isinstance(material, str) else material
    if properties is None:
        raise ClearanceError(f'bushing material "{material}" is unknown; use {either(LAYER_MATERIALS)}')
    if properties.poisson_ratio > LARGEST_RATIO:
        words = f"Poisson's ratio {properties.poisson_ratio:g} of a bushing's layer is more than {LARGEST_RATIO:g}"
        raise ClearanceError(f"{words}: it gives sideways, as its ends let it; measure its stiffness")
    for name, size in {"thickness": thickness, "length": length, "radius": radius, "gap": gap}.items():
        if not size > 0:
            raise ClearanceError(f"{name} of a bushing's contact must be > 0 m, got {size:g}")
    peak = YIELDS_AT * properties.yield_strength
    light, middle, full = (pressed_layer(p, properties, thickness, radius, gap) for p in (LIGHT * peak, peak / 3, peak))
    load_spread = math.log((full[0] / full[1]) / (light[0] / light[1])) / 2
    spread = math.hypot(load_spread, properties.spread, TILT)
    return LayerContact(length * middle[0] / middle[1], spread, full[1], length * full[0])


def pressed_layer(
    pressure: float, material: LayerMaterial, thickness: float, radius: float, gap: float,
    shaft: tuple[float, float] = STEEL,
) -> tuple[float, float]:  # fmt: skip
    """Return force per length, N/m, and depth, m, of a contact with a given largest pressure.

    Parameters
    ----------
    pressure : float
        Pa.
    material : LayerMaterial
        Of the layer.
    thickness : float
        m, of the layer.
    radius : float
        m, of the shaft.
    gap : float
        m, radial clearance.
    shaft : tuple of float
        Young's modulus, Pa, and Poisson's ratio of the shaft.
    """
    nu = material.poisson_ratio
    layer, steel = (1 - nu**2) / material.young_modulus, (1 - shaft[1] ** 2) / shaft[0]
    half_width = 2 * pressure * radius * (radius + gap) / gap * (layer + steel)
    if half_width < NARROW * thickness:
        force = math.pi / 2 * half_width * pressure
        depth = force * layer / math.pi * (2 * math.log(2 * thickness / half_width) - nu / (1 - nu))
    else:
        foundation = (1 - nu) ** 2 / (1 - 2 * nu) / layer / thickness  # Pa/m, Johnson's equation 5.69
        depth = pressure / foundation
        arc = math.acos(gap / (gap + depth))
        half_width = radius * math.sin(arc)
        force = foundation * radius * ((gap + depth) * arc - gap * math.sin(arc))
    return force, depth + force * steel / math.pi * (2 * math.log(4 * radius / half_width) - 1)
