"""Laws: what the clearance's stiffness and damping are at each moment.

A law gives every bushing a contact stiffness k and damping c and, optionally, the grease identified with them. Each is
a small table that compiled engines interpolate before every step (`LawTable`): over time (`TimeLaw`), over the
envelope of the motion at the bushing (`AmplitudeLaw`), or one row (`ConstantLaw`). Outside the table the nearest row
holds. `ContactLaw` uses a contact model instead, whose stiffness follows the penetration itself.
"""

from __future__ import annotations

import json
from abc import ABC, abstractmethod
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, NamedTuple

import numba
import numpy as np

from ..errors import LawError
from ..files import replacing
from ..rig import Grease
from ..validation import from_plain, to_plain
from .contact import CONTACTS

__all__ = [
    "AmplitudeLaw",
    "ConstantLaw",
    "ContactLaw",
    "Law",
    "LawTable",
    "TimeLaw",
    "law_from_dict",
    "load_law",
    "table_values",
]


class LawTable(NamedTuple):
    """A law as arrays that compiled code reads."""

    by_amplitude: bool
    """the abscissa is the envelope of the motion (m) instead of time (s)"""
    abscissa: np.ndarray
    """(n_rows,) increasing"""
    k: np.ndarray
    """(n_rows, n_bushings) N/m"""
    c: np.ndarray
    """(n_rows, n_bushings) N s/m"""
    release: float
    """s, time constant with which the envelope falls after a peak"""
    exponent: np.ndarray
    """(n_bushings,) n of the contact force k δⁿ"""
    kappa: np.ndarray
    """(n_bushings,) κ of Hertz-damped contacts, 0 for others"""
    adhesion: np.ndarray
    """(n_bushings,) whether the contact may pull"""


@numba.njit(cache=True, nogil=True, inline="always")
def table_values(law, j, at):
    """Return stiffness and damping (k, c) of a bushing: linear between the rows, the ends hold beyond.

    Parameters
    ----------
    law : LawTable
        The law.
    j : int
        The bushing.
    at : float
        Abscissa: s, or m of an amplitude.
    """
    abscissa, last = law.abscissa, law.abscissa.size - 1
    if last == 0 or at <= abscissa[0]:
        return law.k[0, j], law.c[0, j]
    if at >= abscissa[last]:
        return law.k[last, j], law.c[last, j]
    row = np.searchsorted(abscissa, at, side="right") - 1
    share = (at - abscissa[row]) / (abscissa[row + 1] - abscissa[row])
    k = law.k[row, j] + share * (law.k[row + 1, j] - law.k[row, j])
    return k, law.c[row, j] + share * (law.c[row + 1, j] - law.c[row, j])


@dataclass(frozen=True)
class Law(ABC):
    """What all laws share; use one of the subclasses."""

    kind: ClassVar[str]

    @abstractmethod
    def table(self, n_bushings: int) -> LawTable:
        """Return the law for ``n_bushings`` bushings.

        Parameters
        ----------
        n_bushings : int
            Number of bushings of the rig. One value in the law serves all of them.

        Raises
        ------
        LawError
            If the law holds values for another number of bushings.
        """

    def to_dict(self) -> dict:
        """Return the law as plain data."""
        data = {"kind": self.kind}
        for name, value in vars(self).items():
            if name == "grease":
                data["grease"] = None if value is None else [to_plain(g) for g in value]
            elif name == "contact":
                data["contact"] = [{"model": m.name, **to_plain(m)} for m in value]
            else:
                data[name] = value.tolist() if isinstance(value, np.ndarray) else value
        return data

    def save(self, path):
        """Write the law as JSON; an existing file is replaced only once the new one is whole.

        Parameters
        ----------
        path : str or Path
            The file.
        """
        with replacing(path) as temporary:
            temporary.write_text(json.dumps(self.to_dict(), indent=1) + "\n", encoding="utf-8")

    def _linear(self, by_amplitude, abscissa, n_bushings, release=0.0):
        """Table of a Kelvin-Voigt contact whose k and c follow the abscissa."""
        k, c = self._spread(self.k, n_bushings), self._spread(self.c, n_bushings)
        one, zero, no = np.ones(n_bushings), np.zeros(n_bushings), np.zeros(n_bushings, dtype=bool)
        # Copies: compiled loops would be compiled again for arrays that cannot be written.
        return LawTable(
            by_amplitude, abscissa.copy(), np.atleast_2d(k), np.atleast_2d(c), float(release), one, zero, no
        )

    def _spread(self, values, n_bushings):
        if values.shape[-1] not in (1, n_bushings):
            raise LawError(
                f"the law holds k and c for {values.shape[-1]} bushings, the rig has {n_bushings}; "
                "give one value for all of them or one each"
            )
        return np.array(np.broadcast_to(values, (*values.shape[:-1], n_bushings)))

    def _set(self, **values):
        for name, value in values.items():
            object.__setattr__(self, name, value)


@dataclass(frozen=True, eq=False)
class ConstantLaw(Law):
    """Constant contact stiffness and damping.

    Parameters
    ----------
    k : float or array_like, shape (n_bushings,)
        Contact stiffness, N/m; zero switches the contact off.
    c : float or array_like, shape (n_bushings,)
        Contact damping, N s/m.
    grease : Grease or sequence of Grease, optional
        Grease identified with it, one for all or one for each bushing; None: the rig's own.

    Raises
    ------
    LawError
        For negative or non-finite values.
    """

    kind: ClassVar[str] = "constant"
    k: np.ndarray
    c: np.ndarray
    grease: tuple[Grease, ...] | None = None

    def __post_init__(self):
        k, c = _together(_values(self.k, "k"), _values(self.c, "c"))
        if k.ndim != 1:
            raise LawError(f"k and c of a constant law are one value per bushing, got shape {k.shape}")
        self._set(k=k, c=c, grease=_greases(self.grease))

    def table(self, n_bushings):
        """Return the law as a table of one row."""
        return self._linear(False, np.zeros(1), n_bushings)


@dataclass(frozen=True, eq=False)
class TimeLaw(Law):
    """Contact stiffness and damping scheduled over time, linear between the given instants.

    Parameters
    ----------
    t : array_like, shape (n,)
        Increasing times, s.
    k, c : array_like, shape (n,) or (n, n_bushings)
        Stiffness, N/m, and damping, N s/m.
    grease : Grease or sequence of Grease, optional
        As in `ConstantLaw`.

    Raises
    ------
    LawError
        For a disordered time axis, wrong shapes, negative or non-finite values.
    """

    kind: ClassVar[str] = "time"
    t: np.ndarray
    k: np.ndarray
    c: np.ndarray
    grease: tuple[Grease, ...] | None = None

    def __post_init__(self):
        t, k, c = _schedule(self.t, self.k, self.c, "t")
        self._set(t=t, k=k, c=c, grease=_greases(self.grease))

    def table(self, n_bushings):
        """Return the law as a table over time."""
        return self._linear(False, self.t, n_bushings)


@dataclass(frozen=True, eq=False)
class AmplitudeLaw(Law):
    """Contact stiffness and damping over the envelope of the motion at each bushing.

    The envelope is a peak-hold with exponential release: A ← max(|x|, A e^(-dt/release)).

    Parameters
    ----------
    amplitude : array_like, shape (n,)
        Increasing amplitudes, m.
    k, c : array_like, shape (n,) or (n, n_bushings)
        Stiffness, N/m, and damping, N s/m.
    release : float
        Time constant, s.
    grease : Grease or sequence of Grease, optional
        As in `ConstantLaw`.

    Raises
    ------
    LawError
        For a disordered axis, wrong shapes, negative or non-finite values.
    """

    kind: ClassVar[str] = "amplitude"
    amplitude: np.ndarray
    k: np.ndarray
    c: np.ndarray
    release: float = 0.03
    grease: tuple[Grease, ...] | None = None

    def __post_init__(self):
        amplitude, k, c = _schedule(self.amplitude, self.k, self.c, "amplitude")
        if not isinstance(self.release, int | float) or not 0 < self.release < np.inf:
            raise LawError(f"release must be a time > 0 s, got {self.release!r}")
        self._set(amplitude=amplitude, k=k, c=c, release=float(self.release), grease=_greases(self.grease))

    def table(self, n_bushings):
        """Return the law as a table over amplitude."""
        return self._linear(True, self.amplitude, n_bushings, self.release)


@dataclass(frozen=True, eq=False)
class ContactLaw(Law):
    """A contact model in place of scheduled parameters: Hertz-damped contacts, or Kelvin-Voigt with adhesion.

    Parameters
    ----------
    contact : KelvinVoigt, HuntCrossley, LankaraniNikravesh or Flores, or a sequence of them
        One for all bushings or one for each; or another model that `contact.register` knows.
    grease : Grease or sequence of Grease, optional
        As in `ConstantLaw`.
    """

    kind: ClassVar[str] = "contact"
    contact: tuple
    grease: tuple[Grease, ...] | None = None

    def __post_init__(self):
        self._set(contact=_several(self.contact, tuple(CONTACTS.values()), "contact"), grease=_greases(self.grease))

    def table(self, n_bushings):
        """Return the models' parameters as a table of one row."""

        def row(name):
            return self._spread(np.array([float(getattr(m, name)) for m in self.contact]), n_bushings)

        k, c = row("stiffness")[None], row("damping")[None]
        return LawTable(False, np.zeros(1), k, c, 0.0, row("exponent"), row("kappa"), row("adhesion") > 0)


_KINDS = {law.kind: law for law in (ConstantLaw, TimeLaw, AmplitudeLaw, ContactLaw)}


def load_law(path) -> Law:
    """Read a law that `Law.save` wrote.

    Parameters
    ----------
    path : str or Path
        JSON file.

    Raises
    ------
    LawError
        If the file is missing, not a law, or holds impossible values.
    """
    path = Path(path)
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise LawError(f"{path}: cannot be read ({error.strerror})") from None
    except (ValueError, RecursionError) as error:
        raise LawError(f"{path}: not a law file (JSON): {error}") from None
    try:
        return law_from_dict(data)
    except LawError as error:
        raise LawError(f"{path}: {error}") from None


def law_from_dict(data: dict) -> Law:
    """Build a law from the plain data that `Law.to_dict` returns.

    Parameters
    ----------
    data : dict
        Nested plain data.

    Raises
    ------
    LawError
        If it is not a law, or holds impossible values.
    """
    if not isinstance(data, dict) or str(data.get("kind")) not in _KINDS:
        raise LawError(f'not a law file; needs "kind" to be one of {", ".join(_KINDS)}')
    values = {name: value for name, value in data.items() if name != "kind"}
    kind = _KINDS[data["kind"]]
    try:
        if values.get("grease") is not None:
            values["grease"] = tuple(
                from_plain(Grease, g, f"grease[{i}]", LawError) for i, g in enumerate(values["grease"])
            )
        if "contact" in values:
            values["contact"] = tuple(_contact(model, f"contact[{i}]") for i, model in enumerate(values["contact"]))
        return kind(**values)
    except (TypeError, ValueError, KeyError, AttributeError) as error:
        raise LawError(f"not a whole law file of kind {kind.kind}: {error}") from None


def _contact(data, where):
    """A contact model out of plain data."""
    model = dict(data)
    name = model.pop("model", None)
    if not isinstance(name, str) or name not in CONTACTS:
        raise LawError(f"{where}.model {name!r} is unknown; use {', '.join(CONTACTS)}")
    return from_plain(CONTACTS[name], model, where, LawError)


def _values(values, name):
    try:
        array = np.atleast_1d(np.array(values, dtype=float))
    except (TypeError, ValueError, OverflowError):
        raise LawError(f"{name} must be numbers, got {values!r}") from None
    if not array.size:
        raise LawError(f"{name} must hold one or more values")
    if not np.all(np.isfinite(array)) or np.any(array < 0):
        bad = array[~(np.isfinite(array) & (array >= 0))][0]
        raise LawError(f"{name} must be finite and >= 0, got {bad:g}")
    array.flags.writeable = False
    return array


def _schedule(abscissa, k, c, name):
    abscissa, k, c = _values(abscissa, name), _values(k, "k"), _values(c, "c")
    if abscissa.ndim != 1 or np.any(np.diff(abscissa) <= 0):
        raise LawError(f"{name} must be one increasing row of values")
    k, c = (v[:, None] if v.ndim == 1 else v for v in (k, c))
    for label, v in (("k", k), ("c", c)):
        if v.ndim != 2 or v.shape[0] != abscissa.size:
            raise LawError(f"{label} has shape {v.shape}, needs ({abscissa.size}, n_bushings) to fit {name}")
    return abscissa, *_together(k, c)


def _together(k, c):
    """K and c in one shape; one of them may hold a single value for all bushings."""
    try:
        return np.broadcast_arrays(k, c)
    except ValueError:
        raise LawError(f"k and c are for different numbers of bushings: shapes {k.shape} and {c.shape}") from None


def _greases(grease):
    if grease is None:
        return None
    return _several(grease, Grease, "grease")


def _several(values, kinds, name):
    """A tuple of one or more objects of the given kinds."""
    if isinstance(values, kinds):
        return (values,)
    values = tuple(values) if isinstance(values, list | tuple) else ()
    for i, value in enumerate(values):
        if not isinstance(value, kinds):
            names = ", ".join(kind.__name__ for kind in np.atleast_1d(kinds))
            raise LawError(f"{name}[{i}] must be of {names}, got {value!r}")
    if not values:
        raise LawError(f"{name} must hold one or more elements")
    return values
