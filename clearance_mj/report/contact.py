"""Contact as records show it, where the rig file is exact: ridges, stiffness and damping in windows."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from ..clearance.figures import QUANTITIES, AmplitudeCurve, draw_curves
from ..clearance.law import ContactLaw, TimeLaw
from ..core.errors import RecordError
from ..identify.forces.restoring import RestoringForce
from ..identify.laws.contact_over_time import ContactParameters, contact_parameters
from ..identify.laws.grease import grease_parameters
from ..identify.methods.ridge import ridge_law
from ..identify.records.lowest_mode import ridge_band
from ..identify.registry import Identified
from ..io.dataset import Dataset, Record
from ..signals.wavelet import Ridge, Scalogram, scalogram, skeleton
from .style import COLOURS, FONT, REPEAT, TEST, Drawing, canvas, colour_bar, tidy

__all__ = ["contact_drawings", "contact_over_amplitude", "contact_over_time", "scalograms"]

CURVE = 200  # amplitudes of a law's curve


def contact_drawings(
    model: Identified, records: Sequence[Record], forces: Sequence[RestoringForce]
) -> Iterator[Drawing | str]:
    """Yield figures or, in words, why the records do not allow one.

    Parameters
    ----------
    model : Identified
        With a law for the rig file's rig.
    records : sequence of Record
        Records from which it was identified.
    forces : sequence of RestoringForce
        Restoring forces of the records that allow them.
    """
    try:
        grease = grease_parameters(forces).grease if forces else ()
    except RecordError as error:
        grease = ()
        yield str(error)
    by_record, windows = {force.name: force for force in forces}, list[ContactParameters]()
    for record in records:
        try:
            caption = f"Record {record.name}: wavelet transform of the motion in every bushing about the lowest mode."
            yield Drawing(f"scalogram_{record.name}", _scalograms(record), caption, caption, sharp=False)
        except RecordError as error:
            yield f"{record.name}, scalogram: {error}"
        measured, words = None, []
        if record.name in by_record and grease:
            try:
                measured = contact_parameters(by_record[record.name], grease)
                windows.append(measured)
            except RecordError as error:
                words.append(str(error))
        try:
            ridge = _ridge_law(model, record, records)
        except RecordError as error:
            ridge = None
            words.append(str(error))
        if measured is None and ridge is None:
            yield f"{record.name}, contact over time: {'; '.join(words)}"
            continue
        caption = f"Record {record.name}: contact stiffness and damping over time."
        figure = contact_over_time(f"{record.name}: contact over time", measured, ridge)
        yield Drawing(f"contact_over_time_{record.name}", figure, caption, caption)
    if windows:
        figure = contact_over_amplitude(windows, _k_and_c(model, forces), [b.gap for b in model.rig.bushings])
        caption = "Contact stiffness and damping over the amplitude of the motion: of windows, and of the law."
        yield Drawing("contact_over_amplitude", figure, caption, caption)


def _scalograms(record: Record) -> Figure:
    if (probes := record.response().displacement) is None:
        raise RecordError("no displacement probe at every bushing")
    planes = [scalogram(signal, record.fs, ridge_band(record.rig)) for signal in probes]
    gaps = [b.gap for b in record.rig.bushings]
    return scalograms(f"{record.name}: lowest mode", planes, [skeleton(p) for p in planes], gaps)


def _ridge_law(identified: Identified, record: Record, records: Sequence[Record]) -> TimeLaw:
    if isinstance(identified.law, TimeLaw) and record.duration == max(r.duration for r in records):
        return identified.law
    return ridge_law(Dataset(identified.rig, (record,)))


def _k_and_c(identified: Identified, forces: Sequence[RestoringForce]) -> list[AmplitudeCurve]:
    """Return the law's stiffness and damping over the amplitudes that each bushing reached."""
    law, gaps = identified.law, np.array([b.gap for b in identified.rig.bushings])
    if isinstance(law, TimeLaw):
        return []
    largest = np.max([np.abs(f.displacement[:, f.valid]).max(axis=1) for f in forces], axis=0)
    amplitude = np.linspace(gaps.min(), largest.max(), CURVE + 1)[1:]
    omega = np.mean([np.std(f.velocity, axis=1) / np.std(f.displacement, axis=1) for f in forces], axis=0)
    label = f"law{', equivalent in a cycle' if isinstance(law, ContactLaw) else ''}"
    k, c = law.over_amplitude(gaps.tolist(), amplitude, omega)
    reached = amplitude[:, None] <= largest
    return [AmplitudeCurve(label, amplitude, *(np.where(reached, v, np.nan) for v in (k, c)))]


# Figures of contact: what records show of it over time and amplitude, and what the law makes of it.
#
# Black is what was measured, blue the law, orange the wavelet ridge (Okabe and Ito's palette).


RIDGE = COLOURS[1]
MM = 1e3
COLUMNS = 1500  # of a scalogram that are drawn
DECADES = 2.5  # of amplitude that its colours span
WINDOWS = "force balance, windows of 0.5 s"
LIMIT = 1.6  # axes end at so many times the 95th percentile of a curve: single windows scatter far


def scalograms(title: str, planes: Sequence[Scalogram], ridges: Sequence[Ridge], gaps: Sequence[float]) -> Figure:
    """Draw the wavelet transform of the motion (m) in every bushing with its ridge, and its amplitude and the gap."""
    figure = _sheet(title, 2.1 * len(planes))
    axes = figure.subplots(len(planes), 2, squeeze=False, sharex=True, width_ratios=(1.25, 1))
    for j, ((left, right), plane, ridge, gap) in enumerate(zip(axes, planes, ridges, gaps)):
        valid_percent = 100 * ridge.valid.mean()
        words = f"ridge valid {valid_percent:.2g} % of the time" if valid_percent else "no ridge above the noise"
        _draw_plane(figure, left, plane)
        _draw_track(left, ridge, ridge.omega / (2 * np.pi), "white")
        left.set_ylim(plane.frequency[0], plane.frequency[-1])
        time = "Time (s)" if j == len(planes) - 1 else ""
        tidy(left, f"bushing {j + 1}: {words}", "Frequency (Hz)", time)
        left.grid(False)
        _draw_track(right, ridge, MM * ridge.amplitude, RIDGE)
        right.axhline(MM * gap, color=TEST, linewidth=0.9, linestyle="--", label="gap")
        tidy(right, f"bushing {j + 1}: amplitude on the ridge", "Amplitude (mm)", time)
        right.set_ylim(bottom=0)
    axes[0, 1].legend(fontsize=FONT - 1, frameon=False, loc="best")
    return figure


def _draw_plane(figure: Figure, ax: Axes, plane: Scalogram) -> None:
    stride = max(1, plane.time.size // COLUMNS)
    edges = np.arange(0, plane.time.size, stride)
    size = MM * np.sqrt(np.add.reduceat(np.abs(plane.value) ** 2, edges, axis=1) / stride)
    top = size.max()
    bottom = top / 10**DECADES
    image = ax.pcolormesh(plane.time[edges], plane.frequency, np.maximum(size, bottom), norm=LogNorm(bottom, top),
                          cmap="cividis", shading="nearest", rasterized=True)  # fmt: skip
    colour_bar(figure, image, [ax], "Amplitude (mm)", FONT - 1, pad=0.01, aspect=25)


def _draw_track(ax: Axes, ridge: Ridge, value: np.ndarray, colour: str) -> None:
    """Draw a line over time, dotted where the ridge is not valid."""
    stride = max(1, ridge.time.size // (4 * COLUMNS))
    time, valid, value = (v[::stride] for v in (ridge.time, ridge.valid, value))
    ax.plot(time, np.where(valid, np.nan, value), color=colour, linewidth=0.8, linestyle=":", label="not valid")
    ax.plot(time, np.where(valid, value, np.nan), color=colour, linewidth=1.6, label="valid")


def contact_over_time(title: str, measured: ContactParameters | None, ridge: TimeLaw | None) -> Figure:
    """Draw contact stiffness and damping over time: in windows, with two standard deviations, and on the ridge."""
    n = next(law.k.shape[1] for law in (measured, ridge) if law)
    figure = _sheet(title, 1.9 * n)
    axes = figure.subplots(n, 2, squeeze=False, sharex=True)
    for j, line in enumerate(axes):
        for ax, name, label in zip(line, "kc", QUANTITIES):
            if measured:
                value, std = getattr(measured, name)[:, j], getattr(measured, f"{name}_std")[:, j]
                ax.fill_between(measured.time, value - 2 * std, value + 2 * std, color=REPEAT, alpha=0.4, linewidth=0)
                ax.plot(measured.time, value, ".-", color=TEST, linewidth=0.8, markersize=2.5, label=WINDOWS)
            if ridge:
                track = getattr(ridge, name)[:, j]
                ax.plot(ridge.t, track, ".", color=RIDGE, markersize=2.5, zorder=1.5, label="wavelet ridge")
            tidy(ax, f"bushing {j + 1}", label, "Time (s)" if j == n - 1 else "")
            _limit_axis(ax, value if measured else track)
    _draw_key(figure, axes)
    return figure


def contact_over_amplitude(
    measured: Sequence[ContactParameters], curves: Sequence[AmplitudeCurve], gaps: Sequence[float]
) -> Figure:
    """Return the contact stiffness and damping over the amplitude of the motion: of every window, and of laws."""
    figure = _sheet("", 1.9 * len(gaps))
    axes = figure.subplots(len(gaps), 2, squeeze=False, sharex=True)
    for j, line in enumerate(axes):
        for ax, name in zip(line, "kc"):
            columns = ("amplitude", name, f"{name}_std")
            x, y, std = (np.concatenate([getattr(p, column)[:, j] for p in measured]) for column in columns)
            look = {"fmt": ".", "color": TEST, "ecolor": REPEAT, "markersize": 3, "elinewidth": 0.5}
            ax.errorbar(MM * x, y, std, label=f"{WINDOWS} (mean amplitude)", **look)
            reached = [getattr(c, name)[c.amplitude <= np.nanmax(x), j] for c in curves if np.isfinite(x).any()]
            _limit_axis(ax, y, *reached)
        draw_curves(line, j, curves, gaps[j])
    for ax in axes[-1]:
        ax.set_xlabel("Amplitude (mm)", fontsize=FONT)
    _draw_key(figure, axes)
    return figure


def _sheet(title: str, height: float) -> Figure:
    figure = canvas(height + 0.5)
    figure.set_layout_engine("constrained", w_pad=0.06, h_pad=0.06)
    if title:
        figure.suptitle(title, fontsize=FONT + 1)
    return figure


def _limit_axis(ax: Axes, *curves: np.ndarray) -> None:
    """End the axis near the bulk of what is drawn."""
    top = max((LIMIT * np.percentile(v, 95) for v in [v[np.isfinite(v)] for v in curves] if v.size), default=0)
    ax.set_ylim(0, top if top > 0 else 1)


def _draw_key(figure: Figure, axes: np.ndarray) -> None:
    """Draw one legend below all panels."""
    entries = {label: handle for ax in axes.flat for handle, label in zip(*ax.get_legend_handles_labels())}
    figure.legend([*entries.values()], [*entries], loc="outside lower center", ncols=4, fontsize=FONT, frameon=False)
