"""The beam's equations, Eqs 1 to 8."""

import math
from collections.abc import Iterator

import numpy as np
import scipy.optimize

from .judge import Claim

_FREE = ((1.0, 2), (1.0, 3))  # Ends of the beam as (place over length, derivative that is zero)
_PRINTED_ENDS = ((0.0, 2), (0.0, 3), *_FREE)
_CLAMPED_FREE = ((0.0, 0), (0.0, 1), *_FREE)


def claims() -> Iterator[Claim]:
    """Claims of the equations of the beam."""
    part = "Beam, Eqs 1-8"
    yield _boundary_conditions(part)
    root = _root(_CLAMPED_FREE, 1)
    product = np.cos(root) * np.cosh(root)
    verdict = "ok" if abs(product - 1) < 1e-6 else f"misprint of {product:+.0f}"
    recomputed = f"{product:+.4f} at λ = {root:.4f}, the first of a clamped and free beam"
    yield Claim(part, "Eq. (8)", "cos λ ch λ", "+1", recomputed, verdict)
    order = 6
    excess = round(2 * _root(_CLAMPED_FREE, order) / np.pi) - 2 * order
    form = f"(2i {'+' if excess > 0 else '-'} {abs(excess)})π/2"
    verdict = "ok" if excess == 1 else f"misprint of {form}"
    yield Claim(part, "Eq. (8)", "asymptote of λ", "(2i + 1)π/2", f"{form} at i = {order}", verdict)
    yield from _mode_shape(part)
    yield _second_stiffness(part)


def _boundary_conditions(part) -> Claim:
    """Rigid-body motions that the printed ends allow, and their first root."""
    motions = (
        np.array([(1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 2, 0), (0, 0, 0, 6)]),
        np.array([(1, 1, 1, 1), (0, 1, 2, 3), (0, 0, 2, 6), (0, 0, 0, 6)]),
    )  # derivatives 0 to 3 of 1, x, x², x³ at x = 0 and at x = 1
    rigid = 4 - np.linalg.matrix_rank([motions[int(x)][order] for x, order in _PRINTED_ENDS])
    recomputed = f"{rigid} rigid-body motions are left; first λ = {_root(_PRINTED_ENDS, 1):.4f}, "
    recomputed += f"of a clamped and free beam {_root(_CLAMPED_FREE, 1):.4f}"
    verdict = "ok" if rigid == 0 else "free at both ends; a clamp needs Y(0) = Y'(0) = 0"
    return Claim(
        part, "Eq. (2)", "ends of a cantilever", "Y''(0) = Y'''(0) = Y''(l) = Y'''(l) = 0", recomputed, verdict
    )


def _mode_shape(part) -> Iterator[Claim]:
    """Yield claims about the ends of the printed shape, with the printed roots and with those of a cantilever."""
    cantilever = _root(_CLAMPED_FREE, 1)
    right = max(abs(_derivative(x, n, cantilever) @ _eq7(cantilever, 1)) for x, n in _CLAMPED_FREE) < 1e-9
    for roots, root in (("Eq. (8)", _root(_PRINTED_ENDS, 1)), ("a cantilever", cantilever)):
        values = [_derivative(x, n, root) @ _eq7(root, -1) for x, n in (*_CLAMPED_FREE, (1.0, 0))]
        start, slope, bending, shear, tip = np.round(values, 6) + 0.0
        recomputed = f"Y(0) = {start:g}, Y'(0) = {slope:g}, Y(l) = {tip:.4g}, Y''(l) = {bending:.4g} β², "
        recomputed += f"Y'''(l) = {shear:.4g} β³"
        wrong = "not free at x = l" + ("; cos λ + ch λ in the denominator is, for a cantilever" if right else "")
        verdict = "ok" if np.allclose(values[:4], 0, atol=1e-9) else wrong
        yield Claim(part, "Eq. (7)", f"mode shape 1 with the roots of {roots}", "cos λ - ch λ", recomputed, verdict)


def _second_stiffness(part) -> Claim:
    """The two forms of Eq. 5 for the first mode of a cantilever of unit length, ∫Y² = 1."""
    root = _root(_CLAMPED_FREE, 1)
    shape = _eq7(root, 1)
    node, weight = np.polynomial.legendre.leggauss(40)
    y, y2, y3, y4 = (
        np.array([_derivative((1 + u) / 2, n, root) @ shape for u in node]) * root**n for n in (0, 2, 3, 4)
    )
    first, printed, right = (weight @ product / 2 for product in (y2**2, y * y3, y * y4))
    verdict = "ok" if math.isclose(first, printed, rel_tol=1e-6) else "misprint of Y (EI Y'')''"
    recomputed = f"{printed:.2f} EI/l³, the first form {first:.2f}; with (Y'')'' {right:.2f}"
    return Claim(part, "Eq. (5)", "second form of K, mode 1", "Y EI (Y')''", recomputed, verdict)


def _root(ends, order) -> float:
    """The λ of the given order, from 1, at which a beam with these ends vibrates."""
    grid = np.arange(0.5, np.pi * (order + 1), 0.1)
    sign = np.sign([_determinant(root, ends) for root in grid])
    at = np.flatnonzero(sign[1:] != sign[:-1])[order - 1]
    return scipy.optimize.brentq(_determinant, grid[at], grid[at + 1], args=(ends,), xtol=1e-13)


def _determinant(root, ends) -> float:
    return np.linalg.det([_derivative(x, n, root) for x, n in ends])


def _derivative(x, order, root) -> np.ndarray:
    """Derivatives, over root^order, of cosh, sinh, cos and sin at root x, (4,)."""
    z, turn = root * x, np.pi / 2 * order
    hyperbolic = [np.cosh(z), np.sinh(z)]
    return np.array([hyperbolic[order % 2], hyperbolic[1 - order % 2], np.cos(z + turn), np.sin(z + turn)])


def _eq7(root, sign) -> np.ndarray:
    """Coefficients of cosh, sinh, cos, sin in Eq. 7 with cos λ + sign ch λ in the denominator; -1 as printed."""
    ratio = (np.sin(root) - np.sinh(root)) / (np.cos(root) + sign * np.cosh(root))
    return np.array([-1.0, -ratio, 1.0, ratio])
