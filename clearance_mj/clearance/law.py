"""Laws: what the clearance's stiffness and damping are at each moment.

A law gives every bushing a contact stiffness k and damping c and, optionally, the grease identified with them. Each is
a small table that compiled loops interpolate before every step (`LawTable`): over time (`TimeLaw`), over the
envelope of the motion at the bushing (`AmplitudeLaw`), or one row (`ConstantLaw`). Outside the table the nearest row
holds. `ContactLaw` uses a contact model instead, whose stiffness follows the penetration itself.
"""

from __future__ import annotations

import json
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, NamedTuple, TypeAlias

import numpy as np

from ..errors import LawError
from ..files import replacing
from ..rig import Grease
from ..validation import to_plain
from .contact import ContactModel
from .contacts.kelvin_voigt import KelvinVoigt
from .grease import GreaseModel

__all__ = ["AmplitudeLaw", "ConstantLaw", "ContactLaw", "Law", "LawTable", "TimeLaw"]

AnyGrease = Grease | GreaseModel
Values: TypeAlias = np.ndarray | Any  # given as whatever numpy makes an array of, kept as a read-only array
Greases: TypeAlias = tuple[AnyGrease, ...] | Any  # given as one or several, kept as a tuple or None


class LawTable(NamedTuple):
    """A law as arrays: parameters of contact models, of which compiled loops interpolate the rows before every step."""

    by_amplitude: bool  # the abscissa is the envelope of the motion (m) instead of time (s)
    abscissa: np.ndarray  # (n_rows,) increasing
    parameters: np.ndarray  # (n_rows, n_bushings, n_numbers) of the models (Kelvin-Voigt: k, c), padded with zeros
    release: float  # s, time constant with which the envelope falls after a peak
    adhesion: np.ndarray  # (n_bushings,) whether the contact may pull
    contact_law: np.ndarray  # (n_bushings,) addresses of the models' laws
    contact_energy: np.ndarray  # (n_bushings,) addresses of the models' energies
    kinds: tuple[type[ContactModel], ...]  # (n_bushings,) of the models


class Law(ABC):
    """What all laws share; use one of the subclasses. Laws of the same content are equal."""

    kind: ClassVar[str]
    grease: Greases

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

    @abstractmethod
    def largest(self, gaps: Sequence[float]) -> tuple[np.ndarray, np.ndarray]:
        """Return the largest stiffness, N/m, and damping, N s/m, that time steps must follow: (n_bushings,) each.

        Parameters
        ----------
        gaps : sequence of float
            Of the bushings, m: contacts that harden are looked at at one gap of penetration.
        """

    def to_dict(self) -> dict[str, Any]:
        """Return the law as plain data."""
        data: dict[str, Any] = {"kind": self.kind}
        for name, value in vars(self).items():
            if name in ("contact", "grease"):
                data[name] = None if value is None else [_plain_model(model) for model in value]
            else:
                data[name] = value.tolist() if isinstance(value, np.ndarray) else value
        return data

    def save(self, path: str | Path) -> None:
        """Write the law as JSON; an existing file is replaced only once the new one is whole.

        Parameters
        ----------
        path : str or Path
            The file.
        """
        with replacing(path) as temporary:
            temporary.write_text(json.dumps(self.to_dict(), indent=1) + "\n", encoding="utf-8")

    def _content(self) -> tuple[Any, ...]:
        values = (v.tolist() if isinstance(v, np.ndarray) else v for v in vars(self).values())
        return type(self), *(repr(v) if isinstance(v, list) else v for v in values)

    def __eq__(self, other: object) -> bool:
        return self._content() == other._content() if isinstance(other, Law) else NotImplemented

    def __hash__(self) -> int:
        return hash(self._content())

    def _set(self, **values: Any) -> None:
        for name, value in values.items():
            object.__setattr__(self, name, value)


class _KelvinVoigtLaw(Law):
    """A Kelvin-Voigt contact whose k and c follow an abscissa."""

    k: Values
    c: Values
    _abscissa: ClassVar[str] = ""  # name of the field

    def table(self, n_bushings: int) -> LawTable:
        abscissa = getattr(self, self._abscissa) if self._abscissa else np.zeros(1)
        rows = np.stack((np.atleast_2d(self.k), np.atleast_2d(self.c)), axis=-1)
        by_amplitude, release = self._abscissa == "amplitude", getattr(self, "release", 0.0)
        return _table(by_amplitude, abscissa, rows, release, [KelvinVoigt(1.0)], n_bushings)

    def largest(self, gaps: Sequence[float]) -> tuple[np.ndarray, np.ndarray]:
        most = self.table(len(gaps)).parameters.max(axis=0)
        return most[:, 0], most[:, 1]


@dataclass(frozen=True, eq=False)
class ConstantLaw(_KelvinVoigtLaw):
    """Constant contact stiffness and damping.

    Parameters
    ----------
    k : float or array_like, shape (n_bushings,)
        Contact stiffness, N/m; zero switches the contact off.
    c : float or array_like, shape (n_bushings,)
        Contact damping, N s/m.
    grease : Grease, GreaseModel or sequence of them, optional
        Grease identified with it, one for all or one for each bushing; None: the rig's own.

    Raises
    ------
    LawError
        For negative or non-finite values.
    """

    kind: ClassVar[str] = "constant"
    k: Values
    c: Values
    grease: Greases = None

    def __post_init__(self) -> None:
        k, c = _together(_values(self.k, "k"), _values(self.c, "c"))
        if k.ndim != 1:
            raise LawError(f"k and c of a constant law are one value per bushing, got shape {k.shape}")
        self._set(k=k, c=c, grease=_greases(self.grease))


@dataclass(frozen=True, eq=False)
class TimeLaw(_KelvinVoigtLaw):
    """Contact stiffness and damping scheduled over time, linear between the given instants.

    Parameters
    ----------
    t : array_like, shape (n,)
        Increasing times, s.
    k, c : array_like, shape (n,) or (n, n_bushings)
        Stiffness, N/m, and damping, N s/m.
    grease : Grease, GreaseModel or sequence of them, optional
        As in `ConstantLaw`.

    Raises
    ------
    LawError
        For a disordered time axis, wrong shapes, negative or non-finite values.
    """

    kind: ClassVar[str] = "time"
    _abscissa: ClassVar[str] = "t"
    t: Values
    k: Values
    c: Values
    grease: Greases = None

    def __post_init__(self) -> None:
        t, k, c = _schedule(self.t, self.k, self.c, "t")
        self._set(t=t, k=k, c=c, grease=_greases(self.grease))


@dataclass(frozen=True, eq=False)
class AmplitudeLaw(_KelvinVoigtLaw):
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
    grease : Grease, GreaseModel or sequence of them, optional
        As in `ConstantLaw`.

    Raises
    ------
    LawError
        For a disordered axis, wrong shapes, negative or non-finite values.
    """

    kind: ClassVar[str] = "amplitude"
    _abscissa: ClassVar[str] = "amplitude"
    amplitude: Values
    k: Values
    c: Values
    release: float = 0.03
    grease: Greases = None

    def __post_init__(self) -> None:
        amplitude, k, c = _schedule(self.amplitude, self.k, self.c, "amplitude")
        if not isinstance(self.release, int | float) or not 0 < self.release < np.inf:
            raise LawError(f"release must be a time > 0 s, got {self.release!r}")
        self._set(amplitude=amplitude, k=k, c=c, release=float(self.release), grease=_greases(self.grease))


@dataclass(frozen=True, eq=False)
class ContactLaw(Law):
    """A contact model in place of scheduled parameters.

    Parameters
    ----------
    contact : ContactModel or sequence of ContactModel
        One for all bushings or one for each.
    grease : Grease, GreaseModel or sequence of them, optional
        As in `ConstantLaw`.
    """

    kind: ClassVar[str] = "contact"
    contact: tuple[ContactModel, ...] | Any
    grease: Greases = None

    def __post_init__(self) -> None:
        self._set(contact=_several(self.contact, (ContactModel,), "contact"), grease=_greases(self.grease))

    def table(self, n_bushings: int) -> LawTable:
        """Return the models' parameters in one row."""
        numbers = [model.parameters() for model in self.contact]
        rows = np.zeros((1, len(numbers), max(map(len, numbers))))
        for j, own in enumerate(numbers):
            rows[0, j, : len(own)] = own
        return _table(False, np.zeros(1), rows, 0.0, self.contact, n_bushings)

    def largest(self, gaps: Sequence[float]) -> tuple[np.ndarray, np.ndarray]:
        """Return stiffness and damping of each contact; see `Law.largest`."""
        models = self.contact * (len(gaps) if len(self.contact) == 1 else 1)
        k, c = np.array([model.largest(gap) for model, gap in zip(models, gaps)]).reshape(-1, 2).T
        return k, c


def _table(
    by_amplitude: bool, abscissa: np.ndarray, rows: np.ndarray, release: float, models: Sequence[ContactModel], n: int
) -> LawTable:
    """Table of rows (n_rows, 1 or n_bushings, n_numbers) and as many models, or one; in arrays of its own."""
    if rows.shape[1] not in (1, n):
        raise LawError(
            f"the law holds k and c for {rows.shape[1]} bushings, the rig has {n}; "
            "give one value for all of them or one each"
        )
    parameters = np.array(np.broadcast_to(rows, (len(rows), n, rows.shape[2])))
    law, energy = np.array([m.addresses() for m in models], dtype=np.int64).T
    adhesion = np.array([m.adhesion for m in models])
    adhesion, law, energy = (np.array(np.broadcast_to(values, n)) for values in (adhesion, law, energy))
    kinds = tuple(type(model) for model in models) * (n if len(models) == 1 else 1)
    return LawTable(by_amplitude, abscissa.copy(), parameters, float(release), adhesion, law, energy, kinds)


def _plain_model(model: ContactModel | AnyGrease) -> dict[str, Any]:
    """A model as plain data; a rig's own kind of grease needs no name."""
    return to_plain(model) if isinstance(model, Grease) else {"model": model.name, **to_plain(model)}


def _values(values: Any, name: str) -> np.ndarray:
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


def _schedule(abscissa: Any, k: Any, c: Any, name: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    abscissa, k, c = _values(abscissa, name), _values(k, "k"), _values(c, "c")
    if abscissa.ndim != 1 or np.any(np.diff(abscissa) <= 0):
        raise LawError(f"{name} must be one increasing row of values")
    k, c = (v[:, None] if v.ndim == 1 else v for v in (k, c))
    for label, v in (("k", k), ("c", c)):
        if v.ndim != 2 or v.shape[0] != abscissa.size:
            raise LawError(f"{label} has shape {v.shape}, needs ({abscissa.size}, n_bushings) to fit {name}")
    return abscissa, *_together(k, c)


def _together(k: np.ndarray, c: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """K and c in one shape; one of them may hold a single value for all bushings."""
    try:
        k, c = np.broadcast_arrays(k, c)
    except ValueError:
        raise LawError(f"k and c are for different numbers of bushings: shapes {k.shape} and {c.shape}") from None
    return k, c


def _greases(grease: Any) -> tuple[AnyGrease, ...] | None:
    return None if grease is None else _several(grease, (Grease, GreaseModel), "grease")


def _several(values: Any, kinds: tuple[type, ...], name: str) -> tuple[Any, ...]:
    """A tuple of one or more objects of the given kinds."""
    if isinstance(values, kinds):
        return (values,)
    values = tuple(values) if isinstance(values, list | tuple) else ()
    for i, value in enumerate(values):
        if not isinstance(value, kinds):
            names = " or ".join(kind.__name__ for kind in kinds)
            raise LawError(f"{name}[{i}] must be of {names}, got {value!r}")
    if not values:
        raise LawError(f"{name} must hold one or more elements")
    return values
