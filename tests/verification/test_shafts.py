"""Shafts of any sections and supports against closed forms and exact dynamic stiffness."""

import numpy as np
import pytest
import scipy.optimize
import scipy.special

from clearance_mj import PointMass, Rig, Sensor, Shaker, beam, linear_model
from clearance_mj.structure import Disc, Material, Section, Shaft, Shafts, Spring, Support

from ..structure.dynamic_stiffness import frequencies, round_piece

STEEL = Material(210e9, 7850.0)
LENGTH, DIAMETER = 0.8, 0.012
BENDING, MASS = 210e9 * np.pi * DIAMETER**4 / 64, 7850.0 * np.pi * DIAMETER**2 / 4
SCALE = np.sqrt(BENDING / MASS) / LENGTH**2
EXACT = "exact dynamic stiffness"
MODES = 6


UNIFORM_SECTION = (Section(LENGTH, DIAMETER),)


def shaft(*supports, sections=UNIFORM_SECTION, discs=(), theory="euler", **more):
    """Supports are (kind, position) or whole."""
    supports = tuple(s if isinstance(s, Support) else Support(s[1], s[0]) for s in supports)
    return Shaft(sections, supports, discs, STEEL, theory=theory, **more)


def frequencies_of(structure, n=MODES, masses=()):
    """Circular frequencies of the structure, 1/s."""
    first = structure.shafts[0]
    at = f"{first.name}@{first.end}" if first.name else first.end
    rig = Rig("shaft", None, (), (Sensor(1, at),), masses, structure=structure)
    return 2 * np.pi * beam.natural_frequencies(rig, n)


def roots_near(equation, centres):
    """Roots of an equation in λ, each within 0.5 of a centre."""
    return np.array([scipy.optimize.brentq(equation, c - 0.5, c + 0.5, xtol=1e-14) for c in centres])


def first_roots(equation, grid, n, xtol=1e-14):
    """Roots of an equation between the points of a grid where its sign changes."""
    value = np.array([equation(x) for x in grid])
    signs = np.nonzero(value[:-1] * value[1:] < 0)[0][:n]
    return np.array([scipy.optimize.brentq(equation, grid[i], grid[i + 1], xtol=xtol) for i in signs])


def largest_error(computed, expected):
    return np.max(np.abs(computed / expected - 1))


N = np.arange(1, MODES + 1)


def tan_tanh(sign):
    """Roots of tan λ = ± tanh λ, free of poles."""
    return roots_near(lambda x: np.sin(x) - sign * np.cos(x) * np.tanh(x), (N + sign / 4) * np.pi)


def cos_cosh(sign):
    """Roots of cos λ cosh λ = ± 1; of the clamped and of the clamped-free shaft."""
    return roots_near(lambda x: np.cos(x) - sign / np.cosh(x), (N + sign / 2) * np.pi)


UNIFORM = {
    "pinned-pinned": ([("pinned", 0.0), ("pinned", LENGTH)], 0, N * np.pi, "nπ"),
    "clamped-free": ([("clamped", 0.0)], 0, cos_cosh(-1), "cos λ cosh λ = -1"),
    "free-free": ([], 2, cos_cosh(1), "cos λ cosh λ = 1"),
    "clamped-clamped": ([("clamped", 0.0), ("clamped", LENGTH)], 0, cos_cosh(1), "cos λ cosh λ = 1"),
    "clamped-pinned": ([("clamped", 0.0), ("pinned", LENGTH)], 0, tan_tanh(1), "tan λ = tanh λ"),
    "pinned-free": ([("pinned", 0.0)], 1, tan_tanh(1), "tan λ = tanh λ"),
    "clamped-guided": ([("clamped", 0.0), ("guided", LENGTH)], 0, tan_tanh(-1), "tan λ = -tanh λ"),
    "guided-free": ([("guided", 0.0)], 1, tan_tanh(-1), "tan λ = -tanh λ"),
    "guided-pinned": ([("guided", 0.0), ("pinned", LENGTH)], 0, (N - 0.5) * np.pi, "(n - 1/2)π"),
    "guided-guided": ([("guided", 0.0), ("guided", LENGTH)], 1, N * np.pi, "nπ"),
}


@pytest.mark.parametrize("name", UNIFORM)
def test_uniform(name, measured):
    """λ² √(EI/ρA)/l² (Blevins, Formulas for Natural Frequency and Mode Shape, 1979, table 8-1); rigid bodies at 0."""
    supports, rigid, root, equation = UNIFORM[name]
    omega = frequencies_of(shaft(*supports), rigid + MODES)
    assert np.array_equal(omega[:rigid], np.zeros(rigid))
    error = largest_error(omega[rigid:], root**2 * SCALE)
    measured.below(f"{name}, f1 to f6: error", error, 1e-9, f"{equation} (Blevins, table 8-1)")


def test_tube_and_rectangle(measured):
    """Pinned: n²π² √(EI/ρA)/l² with I = π(D⁴ - d⁴)/64, A = π(D² - d²)/4; and b h³/12, b h."""
    for name, section, radius2 in (
        ("tube", Section(LENGTH, 0.03, 0.024), (0.03**2 + 0.024**2) / 16),
        ("rectangle", Section(LENGTH, width=0.03, height=0.008), 0.008**2 / 12),
    ):
        expected = (N * np.pi / LENGTH) ** 2 * np.sqrt(210e9 * radius2 / 7850.0)
        error = largest_error(frequencies_of(shaft(("pinned", 0.0), ("pinned", LENGTH), sections=(section,))), expected)
        measured.below(f"{name}, pinned-pinned, f1 to f6: error", error, 1e-9, "(nπ)² √(EI/ρA)/l²")


def test_two_equal_spans(measured):
    """Antisymmetric modes are those of one span pinned at both ends, symmetric ones of one clamped in the middle."""
    omega = frequencies_of(shaft(("pinned", 0.0), ("pinned", LENGTH / 2), ("pinned", LENGTH)))
    expected = np.sort(np.concatenate((N[:3] * np.pi, tan_tanh(1)[:3]))) ** 2 * SCALE * 4
    what, source = "two equal spans, f1 to f6: error", "nπ and tan λ = tanh λ (Blevins, table 8-7)"
    measured.below(what, largest_error(omega, expected), 1e-9, source)


def test_springs_and_end_mass(measured):
    """Closed forms (Blevins, 1979, tables 8-9 and 8-8): springs at the ends, and a mass on the tip."""
    stiff, mass, inertia = 3.0, 0.7, 0.02
    spring, rotation = stiff * BENDING / LENGTH**3, stiff * BENDING / LENGTH
    tip_mass = Disc(LENGTH, mass * MASS * LENGTH, inertia * MASS * LENGTH**3)

    def hinge(x):
        return (np.sin(x) * np.cosh(x) - np.cos(x) * np.sinh(x)) * stiff + 2 * x * np.sin(x) * np.sinh(x)

    def tip_spring(x):
        return x**3 * (1 + np.cos(x) * np.cosh(x)) + stiff * (np.sin(x) * np.cosh(x) - np.cos(x) * np.sinh(x))

    def disc(x):  # with mass μ and rotary inertia j of the disc: Blevins, table 8-8; Laura, Pombo & Susemihl, 1974
        c, s, ch, sh = np.cos(x), np.sin(x), np.cosh(x), np.sinh(x)
        free = 1 + c * ch - mass * x * (s * ch - c * sh)
        return free - inertia * x**3 * (s * ch + c * sh) + mass * inertia * x**4 * (1 - c * ch)

    sprung = shaft(Support(0.0, "pinned", rotation=rotation), ("pinned", LENGTH))
    cases = {
        "pinned with a rotation spring, pinned": (sprung, hinge),
        "clamped, spring at the tip": (shaft(("clamped", 0.0), Support(LENGTH, translation=spring)), tip_spring),
        "clamped, disc at the tip": (shaft(("clamped", 0.0), discs=(tip_mass,)), disc),
    }
    for name, (structure, equation) in cases.items():
        root = first_roots(equation, np.linspace(0.3, 20, 4000), MODES)
        error = largest_error(frequencies_of(structure, len(root)), root**2 * SCALE)
        measured.below(f"{name}, f1 to f6: error", error, 1e-9, "frequency equation (Blevins, tables 8-8, 8-9)")


def stepped(theory="euler"):
    """A pump shaft of five steps on a spring and an elastic hinge, a disc between them and one outside."""
    nu = None if theory == "euler" else STEEL.poisson_ratio
    steps = [(0.12, 0.03), (0.2, 0.045), (0.15, 0.06), (0.18, 0.045), (0.15, 0.03)]
    supports = (Support(0.12, "elastic", 4e7, 2e4), Support(0.65, "pinned", rotation=5e3))
    discs = (Disc(0.395, 6.0, 0.03), Disc(0.8, 2.5, 0.008))
    structure = shaft(*supports, sections=tuple(Section(*s) for s in steps), discs=discs, theory=theory)
    pieces = [round_piece(*s, nu=nu) for s in (*steps[:2], (0.075, 0.06), (0.075, 0.06), *steps[3:])]
    springs = [(2 * 1, 4e7), (2 * 1 + 1, 2e4), (2 * 5 + 1, 5e3)]
    masses = [(2 * 3, 6.0), (2 * 3 + 1, 0.03), (2 * 6, 2.5), (2 * 6 + 1, 0.008)]
    return structure, frequencies([pieces], MODES, [2 * 5], springs, masses)


def two_materials():
    """Free; steel, then an aluminium tube that starts at x = 0.1 m."""
    sections = (Section(0.3, 0.02), Section(0.5, 0.05, 0.04, material=Material(70e9, 2700.0)))
    pieces = [round_piece(0.3, 0.02), round_piece(0.5, 0.05, 0.04, 70e9, 2700.0)]
    return shaft(sections=sections, start=0.1), frequencies([pieces], 2 + MODES)


def three_spans():
    """Clamped, pinned twice at unequal distances, with a point mass on the overhang."""
    at = (0.0, 0.25, 0.61, 0.8)
    structure = shaft(("clamped", at[0]), ("pinned", at[1]), ("pinned", at[2]))
    pieces = [round_piece(length, DIAMETER) for length in np.diff(at)]
    return structure, frequencies([pieces], MODES, [0, 1, 2, 4], (), [(6, 0.3)])


def two_shafts():
    """A shaft in a tube, both pinned, joined by a spring; and a spring from the tube to the base."""
    inner = shaft(("pinned", 0.0), ("pinned", 0.8), sections=(Section(0.8, 0.02),), name="inner")
    outer = shaft(("pinned", 0.1), ("guided", 0.7), sections=(Section(0.6, 0.05, 0.044),), start=0.1, name="outer")
    springs = (Spring("inner@0.3", 2e6, "outer@0.3"), Spring("outer@0.5", 5e5))
    chains = [round_piece(0.3, 0.02), round_piece(0.5, 0.02)], [round_piece(0.2, 0.05, 0.044)] * 3
    return Shafts((inner, outer), springs), frequencies(chains, MODES, [0, 4, 6, 13], [(10, 5e5)], (), [(2, 8, 2e6)])


def softly_held():
    """On springs so soft that its frequencies as a rigid body are 1e-4 of the bending's."""
    springs = [Support(x, translation=2e-3) for x in (0.0, LENGTH)]
    exact = frequencies([[round_piece(LENGTH, DIAMETER)]], MODES, springs=[(0, 2e-3), (2, 2e-3)])
    # Rigid, as its bending is 1e-8 of the motion: the determinant has no digits left for them.
    exact[:2] = np.sqrt(np.array([2.0, 6.0]) * 2e-3 / (MASS * LENGTH))
    return shaft(*springs), exact


NOT_UNIFORM = {
    "stepped, discs, elastic supports": (lambda: stepped(), ()),
    "two materials, free": (two_materials, ()),
    "three spans and a mass": (three_spans, (PointMass(0.8, 0.3),)),
    "two shafts and springs": (two_shafts, ()),
    "free on soft springs": (softly_held, ()),
    "stepped, discs, elastic supports, Timoshenko": (lambda: stepped("timoshenko"), ()),
}


SLOW = pytest.param("three spans and a mass", marks=pytest.mark.slow)


@pytest.mark.parametrize("name", [SLOW if name == SLOW.values[0] else name for name in NOT_UNIFORM])
def test_against_dynamic_stiffness(name, measured):
    make, masses = NOT_UNIFORM[name]
    structure, expected = make()
    omega = frequencies_of(structure, len(expected), masses)
    moves = expected > 1e-3
    assert not omega[~moves].any()
    measured.below(f"{name}, f1 to f6: error", largest_error(omega[moves], expected[moves]), 1e-7, EXACT)


def bessel_frequencies(order, ratio, n=3):
    """ω l² √(ρA/EI) at the thick end of a wedge (order 1) or cone (2), clamped there, its thin end of ``ratio``.

    With x from the apex, A = x^n and I = x^(n+2) solve as x^(-n/2) of J, Y, I and K of order n of 2 √(ω x) (Kirchhoff,
    1879; Cranch & Adler, J. Appl. Mech. 23, 1956), x and ω scaled so that the thick end is at x = 1.
    """

    def conditions(omega):
        rows = []
        for x, kind in ((ratio, "free"), (1.0, "clamped")):
            z = 2 * np.sqrt(omega * x)
            # With f = x^(-n/2) B_n(z): f' = ∓ √ω x^(-(n+1)/2) B_(n+1), and so on for I f'' and its derivative.
            bessel = scipy.special.jv, scipy.special.yv, scipy.special.iv, scipy.special.kv
            signs = (-1, -1, 1, -1)
            deflection = [x ** (-order / 2) * b(order, z) for b in bessel]
            slope = [s * np.sqrt(omega) * x ** (-(order + 1) / 2) * b(order + 1, z) for b, s in zip(bessel, signs)]
            curvature = [omega * x ** (-(order + 2) / 2) * b(order + 2, z) for b in bessel]
            # d/dz (z^m B_m) = z^m B_(m-1) with sign + for J, Y, I and - for K; x^(n+2) f'' = ω x^((n+2)/2) B_(n+2).
            up = (1, 1, 1, -1)
            shear = [omega * np.sqrt(omega) * x ** ((order + 1) / 2) * u * b(order + 1, z) for b, u in zip(bessel, up)]
            rows += [deflection, slope] if kind == "clamped" else [curvature, shear]
        rows = np.array(rows)
        return np.linalg.det(rows / np.linalg.norm(rows, axis=0))

    length = 1 - ratio  # of the apex's distance from the clamp
    return first_roots(conditions, np.linspace(1.0, 60.0, 1500) / length**2, n, xtol=1e-12) * length**2


PUBLISHED_POINTS = {1: (5.315, 15.207, 30.02), 2: (8.719, 21.146, 38.453)}


@pytest.mark.parametrize("order", [1, 2], ids=["wedge", "cone"])
def test_tapered(order, measured):
    """Truncated at a quarter against Bessel functions, and almost to the point against the published figures."""
    name, dimension = {1: ("wedge", "height"), 2: ("cone", "diameter")}[order]
    thick, length = 0.02, 0.6
    scale = np.sqrt(210e9 * (thick**2 / (12 if order == 1 else 16)) / 7850.0) / length**2

    def omega(ratio):
        size = {dimension: (thick, ratio * thick)} | ({"width": 0.03} if order == 1 else {})
        return frequencies_of(shaft(("clamped", 0.0), sections=(Section(length, **size),)), 3) / scale

    error = largest_error(omega(0.25), bessel_frequencies(order, 0.25))
    measured.below(f"{name} truncated at a quarter, f1 to f3: error", error, 1e-9, "Bessel functions (Kirchhoff, 1879)")
    for i, (value, published) in enumerate(zip(omega(1e-4) / (1 - 1e-4) ** 2, PUBLISHED_POINTS[order]), 1):
        source = "Naguleswaran, J. Sound Vib. 172, 1994" if order == 2 else "Kirchhoff, 1879; Blevins, 1979"
        measured.equal(f"{name} to the point: f{i}, ω l² √(ρA/EI)", value, published, source, rel=1e-4)


@pytest.mark.parametrize("slenderness", [10, 20, 80])
def test_timoshenko_pinned(slenderness, measured):
    """Both spectra: ρ²I/κG ω⁴ - (ρA + ρI k² (1 + E/κG)) ω² + EI k⁴ = 0, k = nπ/l, and pure shear at √(κGA/ρI)."""
    diameter, nu = 4 * LENGTH / slenderness, STEEL.poisson_ratio
    ends = ("pinned", 0.0), ("pinned", LENGTH)
    omega = frequencies_of(shaft(*ends, sections=(Section(LENGTH, diameter),), theory="timoshenko"), 10)
    area, second = np.pi * diameter**2 / 4, np.pi * diameter**4 / 64
    shear = 6 * (1 + nu) / (7 + 6 * nu) * 210e9 / (2 * (1 + nu))  # κG (Cowper, 1966)
    k = np.arange(1, 11) * np.pi / LENGTH
    half = (7850 * area + 7850 * second * k**2 * (1 + 210e9 / shear)) / 2
    root = half + np.array([[1], [-1]]) * np.sqrt(half**2 - 7850**2 * second / shear * 210e9 * second * k**4)
    low, high = 210e9 * second * k**4 / root
    expected = np.sqrt(np.sort(np.concatenate((low, high, [shear * area / (7850 * second)])))[:10])
    what = f"Timoshenko, pinned, l/r = {slenderness}, f1 to f10: error"
    measured.below(what, largest_error(omega, expected), 1e-9, "closed form")


LEE_SCHULTZ = {
    ("pinned", 0.1): (3.11568, 6.09066, 8.84052, 11.3431, 13.6132),
    ("pinned", 0.2): (3.04533, 5.67155, 7.83952, 9.65709, 11.2220),
    ("clamped", 0.1): (4.57955, 7.33122, 9.85611, 12.1454, 14.2324),
    ("clamped", 0.2): (4.24201, 6.41794, 8.28532, 9.90372, 11.3487),
}


@pytest.mark.parametrize(("kind", "depth"), LEE_SCHULTZ)
def test_timoshenko_published(kind, depth, measured):
    """Lee & Schultz, J. Sound Vib. 269, 2004, tables 1 and 2: √(ω l² √(ρA/EI)) of rectangles of depth h/l.

    They take κ = 5/6 with ν = 0.3, E/κG = 3.12; Cowper's coefficient has that at ν = 3.6/11.
    """
    material = Material(210e9, 7850.0, poisson_ratio=3.6 / 11)
    section = Section(LENGTH, width=0.05, height=depth * LENGTH, material=material)
    omega = frequencies_of(shaft((kind, 0.0), (kind, LENGTH), sections=(section,), theory="timoshenko"), 5)
    value = np.sqrt(omega * LENGTH**2 / np.sqrt(210e9 * (depth * LENGTH) ** 2 / 12 / 7850))
    for i, (one, published) in enumerate(zip(value, LEE_SCHULTZ[kind, depth]), 1):
        measured.equal(f"Timoshenko, {kind}, h/l = {depth}: λ{i}", one, published, "Lee & Schultz, 2004", rel=6e-6)


def deflection(structure, at):
    """Deflection under a unit force at a position, m/N."""
    model = linear_model(Rig("static", None, (), (Sensor(1, at),), shaker=Shaker("force", at), structure=structure), 8)
    return model.static_deflection([at], model.input("force")[None])[0, 0]


def test_static_deflection(measured):
    """Under a unit force at its own place: Roark's Formulas for Stress and Strain, 8th edition, table 8.1."""
    flexibility, middle, a = LENGTH**3 / BENDING, LENGTH / 2, 0.3 * LENGTH
    shear = 6 * 1.3 / (7 + 6 * 0.3) * 210e9 / 2.6 * MASS / 7850  # κGA
    thick, thin, clamp, far = 0.02, 0.011, ("clamped", 0.0), LENGTH
    cone, of_cone = Section(LENGTH, (thick, thin)), 64 * LENGTH**3 / (3 * np.pi * 210e9 * thick**3 * thin)
    spring = Support(far, translation=5.0 / flexibility)
    cases = {
        "clamped-free": (shaft(clamp), far, flexibility / 3),
        "clamped-free, Timoshenko": (shaft(clamp, theory="timoshenko"), far, flexibility / 3 + LENGTH / shear),
        "clamped-clamped": (shaft(clamp, ("clamped", far)), middle, flexibility / 192),
        "clamped-pinned": (shaft(clamp, ("pinned", far)), middle, 7 * flexibility / 768),
        "clamped-guided": (shaft(clamp, ("guided", far)), far, flexibility / 12),
        "pinned-pinned": (shaft(("pinned", 0.0), ("pinned", far)), a, 0.3**2 * 0.7**2 / 3 * flexibility),
        "clamped, tip on a spring": (shaft(clamp, spring), far, flexibility / (3 + 5.0)),
        "tapered, clamped at the thick end": (shaft(clamp, sections=(cone,)), far, of_cone),
    }
    for name, (structure, at, expected) in cases.items():
        source = "Gere & Goodno, Mechanics of Materials" if "tapered" in name else "Roark, table 8.1"
        measured.below(f"static deflection, {name}: error", abs(deflection(structure, at) / expected - 1), 1e-9, source)


def random_shaft(generator):
    """A shaft of one to five steps with supports, springs and discs at their ends, and its exact frequencies."""
    n = generator.integers(1, 6)
    lengths, diameters = 10 ** generator.uniform(-1.3, 0, n), 10 ** generator.uniform(-2, -1.2, n)
    edges = np.concatenate(([0.0], np.cumsum(lengths)))
    theory = generator.choice(["euler", "timoshenko"])
    supports, discs, fixed, springs, masses = [], [], [], [], []
    for i, x in enumerate(edges):
        kind = generator.choice(["free", "pinned", "guided", "elastic"], p=[0.4, 0.2, 0.1, 0.3])
        spring, rotation = 10 ** generator.uniform(4, 8), 10 ** generator.uniform(2, 5)
        mass, inertia = 10 ** generator.uniform(-1, 1), 10 ** generator.uniform(-3, -1)
        fixed += {"pinned": [2 * i], "guided": [2 * i + 1]}.get(kind, [])
        if kind == "elastic":
            supports.append(Support(x, "elastic", spring, rotation))
            springs += [(2 * i, spring), (2 * i + 1, rotation)]
        elif kind != "free":
            supports.append(Support(x, kind))
        if generator.random() < 0.3:
            discs.append(Disc(x, mass, inertia))
            masses += [(2 * i, mass), (2 * i + 1, inertia)]
    sections = tuple(Section(length, diameter) for length, diameter in zip(lengths, diameters))
    nu = STEEL.poisson_ratio if theory == "timoshenko" else None
    pieces = [round_piece(length, diameter, nu=nu) for length, diameter in zip(lengths, diameters)]
    exact = frequencies([pieces], MODES, fixed, springs, masses)
    return shaft(*supports, sections=sections, discs=tuple(discs), theory=str(theory)), exact


@pytest.mark.slow
def test_random_shafts(measured):
    """Also that as many modes as are asked for are found to full accuracy: the engines take eight."""
    generator, errors = np.random.default_rng(13), []
    for _ in range(15):
        structure, exact = random_shaft(generator)
        rig = Rig("random", None, (), (Sensor(1, structure.end),), structure=structure)
        moves = exact > 1e-2 * exact[-1]  # below, the determinant has lost its digits
        errors.append(largest_error(linear_model(rig, MODES).omega[:MODES][moves], exact[moves]))
    measured.below("15 random shafts, six modes asked for, f1 to f6: error", np.max(errors), 1e-7, EXACT)
