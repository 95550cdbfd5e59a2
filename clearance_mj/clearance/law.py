"""Laws: the clearance's stiffness and damping at each instant.

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
from typing import TYPE_CHECKING, Any, ClassVar, TypeAlias

import numpy as np

from ..core.errors import LawError
from ..core.files import replacing
from ..core.overview import HasOverview, Overview, span
from ..core.validation import to_plain
from ..rig import Grease, Rig
from .contact import ContactModel
from .contacts.kelvin_voigt import KelvinVoigt
from .law_values import AnyGrease, model_in_words, number_row, same_shape, schedule, several, several_greases
from .table import LawTable, law_table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["AmplitudeLaw", "ConstantLaw", "ContactLaw", "Law", "LawTable", "TimeLaw"]

CYCLES = (0.9, 1.5, 2.5)  # amplitudes over the gap in plots
Values: TypeAlias = np.ndarray | Any  # anything that numpy converts to an array; stored read-only
Greases: TypeAlias = tuple[AnyGrease, ...] | Any  # one or several; stored as a tuple or None


class Law(HasOverview, ABC):
    """Base class of all laws; use one of the subclasses. Laws of the same content are equal."""

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
            Of the bushings, m: hardening contacts are evaluated at one gap of penetration.
        """

    def over_amplitude(
        self, gaps: Sequence[float], amplitude: np.ndarray, omega: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the contact's stiffness, N/m, and damping, N s/m, over amplitude: (n, n_bushings) each.

        Of a contact model they are those of the spring and damper beyond the gap that approximate it best in a
        harmonic cycle, nan where that stays in the gap; of a law over time those at its start.

        Parameters
        ----------
        gaps : sequence of float
            Of the bushings, m.
        amplitude : ndarray, shape (n,)
            m.
        omega : ndarray, shape (n_bushings,)
            rad/s, of the cycle.
        """
        table = self.table(len(gaps))
        abscissa = amplitude if table.by_amplitude else np.zeros(amplitude.size)
        rows = np.moveaxis(table.parameters[..., :2], 0, -1)  # (n_bushings, 2, n_rows)
        k, c = (np.column_stack([np.interp(abscissa, table.abscissa, row) for row in rows[:, i]]) for i in (0, 1))
        return k, c

    def to_dict(self) -> dict[str, Any]:
        """Return the law as plain data."""
        data: dict[str, Any] = {"kind": self.kind}
        for name, value in vars(self).items():
            if name in ("contact", "grease"):
                data[name] = None if value is None else [_plain_model(model) for model in value]
            elif value is not None:
                data[name] = value.tolist() if isinstance(value, np.ndarray) else value
        return data

    def save(self, path: str | Path) -> None:
        """Write the law as JSON; an existing file is replaced only when the new one is complete.

        Parameters
        ----------
        path : str or Path
            The file.
        """
        with replacing(path) as temporary:
            temporary.write_text(json.dumps(self.to_dict(), indent=1) + "\n", encoding="utf-8")

    def plot(self, rig: Rig, amplitudes: Sequence[float] | None = None, frequency: float | None = None) -> Figure:
        """Draw harmonic cycles of the force over displacement, and contact stiffness and damping over amplitude.

        Of a law over time, stiffness and damping over time. Contact models have the stiffness and damping of the
        spring and damper beyond the gap that approximate them best in a cycle.

        Parameters
        ----------
        rig : Rig
            Whose gaps, and grease where the law has none.
        amplitudes : sequence of float, optional
            Of the cycles, m; None: 0.9, 1.5 and 2.5 gaps.
        frequency : float, optional
            Of the cycles, Hz; None: the rig's lowest natural frequency in the gaps.

        Raises
        ------
        LawError
            If the rig has no bushings, the law does not fit their number, or a number is not positive.
        """
        from ..beam import natural_frequencies
        from .figures import law_figure, over_time_figure

        gaps = np.array([b.gap for b in rig.bushings])
        if not gaps.size:
            raise LawError(f"rig {rig.name!r} has no bushings, so a law has nothing to act in")
        if self.table(gaps.size).by_time:
            return over_time_figure(self.table(gaps.size))
        if frequency is None:
            hz = natural_frequencies(rig, gaps.size + 6)
            if not hz.any():
                raise LawError(
                    f"rig {rig.name!r} has no natural frequency in its gaps; give frequency, Hz, of the cycles"
                )
            frequency = float(hz[hz > 0][0])
        shown_amplitudes = CYCLES if amplitudes is None else amplitudes
        if not (len(shown_amplitudes) and all(0 < a < np.inf for a in shown_amplitudes) and 0 < frequency < np.inf):
            raise LawError(f"amplitudes and frequency must be > 0, got {amplitudes} m and {frequency} Hz")
        if amplitudes is None:
            cycles = {f"{ratio:g} gaps": ratio * gaps for ratio in CYCLES}
        else:
            cycles = {f"{1e3 * a:.4g} mm": np.full(gaps.size, float(a)) for a in amplitudes}
        return law_figure(self, rig, cycles, frequency)

    def _overview(self) -> Overview:
        columns = self._by_bushing()
        columns["grease"] = ["the rig's"] if self.grease is None else [model_in_words(model) for model in self.grease]
        n = max(map(len, columns.values()))
        numbers = [str(j + 1) for j in range(n)] if n > 1 else ["each"]
        rows = zip(numbers, *(cells if len(cells) == n else cells * n for cells in columns.values()))
        return Overview(f"Law, {self.kind}", self._over(), [("bushing", *columns), *rows])

    def _over(self) -> dict[str, str]:
        """Return the abscissa of the parameters, in words."""
        return {}

    def _by_bushing(self) -> dict[str, list[str]]:
        """Return the parameters in words, one for all bushings or one for each."""
        return {}

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
        abscissa, k, c = self._schedule()
        options = {name: float(getattr(self, name, None) or 0.0) for name in ("release", "period")}
        by_amplitude = self._abscissa == "amplitude"
        return law_table(by_amplitude, abscissa, np.stack((k, c), axis=-1), [KelvinVoigt(1.0)], n_bushings, **options)

    def _schedule(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the abscissa (n,), and k and c (n, 1 or n_bushings)."""
        abscissa = getattr(self, self._abscissa) if self._abscissa else np.zeros(1)
        return abscissa, np.atleast_2d(self.k), np.atleast_2d(self.c)

    def largest(self, gaps: Sequence[float]) -> tuple[np.ndarray, np.ndarray]:
        maxima = self.table(len(gaps)).parameters.max(axis=0)
        return maxima[:, 0], maxima[:, 1]

    def _by_bushing(self) -> dict[str, list[str]]:
        return {
            f"{name} ({unit})": [span(values) for values in np.atleast_2d(getattr(self, name)).T]
            for name, unit in (("k", "N/m"), ("c", "N s/m"))
        }


@dataclass(frozen=True, eq=False, repr=False)
class ConstantLaw(_KelvinVoigtLaw):
    """Constant contact stiffness and damping.

    Parameters
    ----------
    k : float or array_like, shape (n_bushings,)
        Contact stiffness, N/m; zero switches the contact off.
    c : float or array_like, shape (n_bushings,)
        Contact damping, N s/m.
    grease : Grease, GreaseModel or sequence of them, optional
        Grease identified with it, one for all or one for each bushing; None: the rig's.

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
        k, c = same_shape(number_row(self.k, "k"), number_row(self.c, "c"))
        if k.ndim != 1:
            raise LawError(f"k and c of a constant law are one value per bushing, got shape {k.shape}")
        self._set(k=k, c=c, grease=several_greases(self.grease))


@dataclass(frozen=True, eq=False, repr=False)
class TimeLaw(_KelvinVoigtLaw):
    """Contact stiffness and damping over time, linear between the given instants.

    Parameters
    ----------
    t : array_like, shape (n,)
        Increasing times, s.
    k, c : array_like, shape (n,) or (n, n_bushings)
        Stiffness, N/m, and damping, N s/m.
    grease : Grease, GreaseModel or sequence of them, optional
        As in `ConstantLaw`.
    period : float, optional
        s, after which the schedule repeats; linear from its last instant to its first.

    Raises
    ------
    LawError
        For a disordered time axis, wrong shapes, negative or non-finite values, or a period that ends before t does.
    """

    kind: ClassVar[str] = "time"
    _abscissa: ClassVar[str] = "t"
    t: Values
    k: Values
    c: Values
    grease: Greases = None
    period: float | None = None

    def __post_init__(self) -> None:
        t, k, c = schedule(self.t, self.k, self.c, "t")
        self._set(t=t, k=k, c=c, grease=several_greases(self.grease))
        if self.period is None:
            return
        if not isinstance(self.period, int | float) or not t[-1] < self.period < np.inf:
            raise LawError(f"period must be a time beyond the last t, {t[-1]:g} s, got {self.period!r}")
        self._set(period=float(self.period))

    def _schedule(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        if self.period is None:
            return super()._schedule()
        t = np.concatenate(([0.0], self.t[self.t > 0], [self.period]))
        k, c = (np.stack([np.interp(t, self.t, row, period=self.period) for row in v.T], axis=1)
                for v in (self.k, self.c))  # fmt: skip
        return t, k, c

    def _over(self) -> dict[str, str]:
        repetition = "" if self.period is None else f", again after {self.period:.4g} s"
        return {"over time": f"{span(self.t, 's')}, {len(self.t)} rows{repetition}"}


@dataclass(frozen=True, eq=False, repr=False)
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
        amplitude, k, c = schedule(self.amplitude, self.k, self.c, "amplitude")
        if not isinstance(self.release, int | float) or not 0 < self.release < np.inf:
            raise LawError(f"release must be a time > 0 s, got {self.release!r}")
        self._set(amplitude=amplitude, k=k, c=c, release=float(self.release), grease=several_greases(self.grease))

    def _over(self) -> dict[str, str]:
        return {
            "over amplitude": f"{span(self.amplitude, 'mm', 1e3)}, {len(self.amplitude)} rows",
            "envelope's release": f"{self.release:g} s",
        }


@dataclass(frozen=True, eq=False, repr=False)
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
        self._set(contact=several(self.contact, (ContactModel,), "contact"), grease=several_greases(self.grease))

    def table(self, n_bushings: int) -> LawTable:
        """Return the models' parameters in one row."""
        numbers = [model.parameters() for model in self.contact]
        rows = np.zeros((1, len(numbers), max(map(len, numbers))))
        for j, values in enumerate(numbers):
            rows[0, j, : len(values)] = values
        return law_table(False, np.zeros(1), rows, self.contact, n_bushings)

    def largest(self, gaps: Sequence[float]) -> tuple[np.ndarray, np.ndarray]:
        """Return stiffness and damping of each contact; see `Law.largest`."""
        models = self.contact * (len(gaps) if len(self.contact) == 1 else 1)
        k, c = np.array([model.largest(gap) for model, gap in zip(models, gaps)]).reshape(-1, 2).T
        return k, c

    def over_amplitude(
        self, gaps: Sequence[float], amplitude: np.ndarray, omega: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the equivalent stiffness and damping in a cycle; see `Law.over_amplitude`."""
        from .harmonic import equivalent_contact

        return equivalent_contact(self.contact * (len(gaps) if len(self.contact) == 1 else 1), gaps, amplitude, omega)

    def _by_bushing(self) -> dict[str, list[str]]:
        return {"contact": [model_in_words(model) for model in self.contact]}


def _plain_model(model: ContactModel | AnyGrease) -> dict[str, Any]:
    """Return a model as plain data; a rig's kind of grease needs no name."""
    return to_plain(model) if isinstance(model, Grease) else {"model": model.name, **to_plain(model)}
