"""The report of a study: one HTML file to read, its figures as PNG and its numbers as CSV."""

from __future__ import annotations

import math
import platform
import shlex
from collections.abc import Sequence
from html import escape
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from tqdm import tqdm

from .._version import __version__
from ..files import replacing
from ..io.dataset import Dataset
from ..output_folder import output_folder
from ..study import ENGINES, METHODS, Study, write_results
from . import figures, html, motion, tables, uncertainty

__all__ = ["report_study", "write_report"]

SVG_LIMIT = 600_000
"""bytes; the whole page is to stay below 8 MB"""


def report_study(
    path: str | Path,
    out: str | Path,
    engines: Sequence[str] = ENGINES,
    methods: Sequence[str] = METHODS,
    workers: int | None = None,
    progress: bool = True,
) -> Study:
    """Run the study of a dataset, and write its results and report into a folder.

    Parameters
    ----------
    path : str or Path
        Dataset folder.
    out : str or Path
        Folder for the results, see `output_folder`: an earlier study there is replaced once the new one is whole, other
        files stay. Laws and cases are kept for the next study, also of one that was interrupted.
    engines, methods : sequence of str
        As for `Study`.
    workers : int, optional
        Threads; default: one for each core.
    progress : bool
        Show progress bars.

    Raises
    ------
    RecordError, RigError
        If the dataset is not whole; nothing is written then.
    ClearanceError
        If a file in ``out`` is in the way, or another process is writing there.
    """
    study = Study(Dataset.load(path), methods, engines, workers=workers, progress=progress)
    with output_folder(out, "study") as folder:
        folder.refuse_others("report.html", "summary.json", "results.nc")
        study.cache = folder.cache
        write_results(study, folder.new)
        write_report(study, folder.new, progress)
        folder.cache.drop_unused()
    return study


def write_report(study: Study, folder, progress: bool = True):
    """Write ``report.html``, ``figures/*.png`` and ``tables/*.csv``.

    Parameters
    ----------
    study : Study
        What to report.
    folder : str or Path
        An existing folder.
    progress : bool
        Show a progress bar.
    """
    folder = Path(folder)
    _write_tables(study, folder / "tables")
    pictures = _write_figures(study, folder / "figures", progress)
    with replacing(folder / "report.html") as temporary:
        temporary.write_text(_page(study, pictures), encoding="utf-8")


def _write_tables(study, folder):
    folder.mkdir(parents=True, exist_ok=True)
    rows = {
        "verdict": study.rows(),
        "natural_frequencies": tables.mode_rows(study),
        "sensors": tables.sensor_rows(study),
        "sensor_means": tables.sensor_mean_rows(study),
        "seeds": tables.seed_rows(study),
        "seed_scatter": study.scatter_rows(),
        "improvements": tables.improvement_rows(study),
        "contact": tables.contact_rows(study),
        "parameters": tables.parameter_rows(study),
        "engines": tables.engine_rows(study),
        "records": tables.record_rows(study),
    }
    for name, content in rows.items():
        tables.write_csv(folder / f"{name}.csv", content)


def _levels(study) -> list[float]:
    """The main level first."""
    return [study.main_level, *(level for level in study.levels if level != study.main_level)]


def _write_figures(study, folder, progress) -> dict[str, html.Picture]:
    """Draw every figure, write it as PNG and keep it for the page, by its name; numbered in the page's order."""
    folder.mkdir(exist_ok=True)
    jobs = [lambda: [figures.rig_drawing(study.dataset.rig)], lambda: [figures.verdict(study)]]
    jobs.append(lambda: [motion.study_waterfall(study)])
    jobs += [lambda level=level: figures.frf_figures(study, level) for level in _levels(study)]
    jobs += [lambda level=level: figures.correlation_figures(study, level) for level in _levels(study)]
    jobs += [lambda: uncertainty.drawings(study), lambda: [figures.contact(study)], lambda: [figures.modes(study)]]
    pictures = {}
    for job in tqdm(jobs, desc="drawing", unit="sheet", disable=not progress):
        for drawing in job():
            png = drawing.png()
            (folder / f"{drawing.name}.png").write_bytes(png)
            pictures[drawing.name] = _picture(drawing, png, len(pictures) + 1)
    return pictures


def _picture(drawing, png, number) -> html.Picture:
    """Sharp as SVG, unless that is large or the figure is one of the many at other levels."""
    svg = drawing.svg() if drawing.sharp else b""
    data, kind = (svg, "image/svg+xml") if 0 < len(svg) <= SVG_LIMIT else (png, "image/png")
    return html.Picture(drawing.name, number, data, kind, drawing.caption, drawing.alt)


# What the page says.


def _page(study, pictures) -> str:
    sections = (
        html.Section("about", "What this is", _about(study, pictures)),
        html.Section("verdict", "Verdict", _verdict(study, pictures)),
        html.Section("frf", "Frequency response functions", _frf(study, pictures)),
        html.Section("correlation", "Agreement over frequency", _correlation(study, pictures)),
        html.Section("tables", "Modes and sensors", _modes_and_sensors(study)),
        html.Section("bushings", "Parameters, contact and modes", _bushings(study, pictures)),
        html.Section("definitions", "Definitions", _definitions(study)),
        html.Section("reproduce", "How to reproduce", _reproduce(study)),
    )
    return html.page(f"Clearance study of rig “{study.dataset.rig.name}”", sections, _source(study.dataset))


def _source(dataset) -> str:
    """Where the records come from, in plain sight."""
    sources = dict.fromkeys(str(r.provenance["source"]) for r in dataset.records if "source" in r.provenance)
    words = escape("; ".join(sources)) or "the dataset does not say"
    if tables.is_synthetic(dataset):
        text = f"<strong>SYNTHETIC.</strong> The “test” in this report was computed, not measured. Records: {words}."
        return html.paragraph(text, "banner")
    return html.paragraph(f"Source of the records: {words}.")


def _about(study, pictures) -> str:
    rig, dataset = study.dataset.rig, study.dataset
    identify, validate = (", ".join(r.name for r in records) for records in (dataset.identify, dataset.validate))
    laws = "".join(f"<dt>{escape(k.name)}</dt><dd>{escape(k.prior_information)}</dd>\n" for k in study.laws)
    where = f" (<code>{escape(str(dataset.path))}</code>)" if dataset.path else ""
    return "".join(
        (
            html.paragraph(
                f"{escape(rig.description or rig.name)}. Bushings: {len(rig.bushings)}, accelerometers: "
                f"{len(rig.sensors)}, records: {len(dataset.records)}{where}. Each law below was simulated under the "
                "excitation of every record that was kept back, and its FRFs compared with that record’s."
            ),
            html.figure(pictures["rig"]),
            html.subsection("knowledge", "What each law was allowed to know"),
            f"<dl>{laws}</dl>\n",
            html.paragraph(
                f"Used to identify: {escape(identify or 'none')}. Kept back to validate: {escape(validate)}. No law "
                "saw a record that it is judged by."
            ),
            html.details("records", "Records in detail", html.table(tables.record_table(study))),
            html.details("engines", "Engines and their time steps", html.table(tables.engine_table(study))),
            html.paragraph(escape(_versions())),
        )
    )


def _versions() -> str:
    found = [f"clearance-mj {__version__}", f"Python {platform.python_version()}"]
    for package in ("mujoco-core", "numpy", "scipy", "numba", "matplotlib"):
        try:
            found.append(f"{package} {version(package)}")
        except PackageNotFoundError:
            continue
    return f"Versions: {', '.join(found)}."


def _verdict(study, pictures) -> str:
    first, *rest = tables.verdict(study)
    parts = [html.paragraph(escape(first), "verdict"), html.paragraph(escape(" ".join(rest)))]
    main, *others = sorted(tables.engines(study), key=lambda engine: engine != tables.main_engine(study))
    parts += [html.figure(pictures["verdict"]), html.table(tables.verdict_table(study, main), breaks=True)]
    parts += [
        html.details(f"verdict-{e}", f"Engine {e}", html.table(tables.verdict_table(study, e), breaks=True))
        for e in others
    ]
    parts.append(
        html.note(
            "Law “repeat”: the rig’s second record of a level compared with its first, the repeat floor. A law that is "
            "driven by the record’s own excitation can fall below it. – : no value, because an FRF or a mode could not "
            "be had or a level has one record only. Press a heading to sort."
        )
    )
    parts.append(html.note(_interval_words(study)))
    return "".join(parts)


def _interval_words(study) -> str:
    tested = [r for r in study.scatter_rows() if math.isfinite(r["cochran_limit"])]
    if not tested:
        return "No level has a second record: the scatter over seeds is not known and there are no intervals."
    uneven = sum(r["cochran"] > r["cochran_limit"] for r in tested)
    freedom = max(r["degrees_of_freedom"] for r in tested)
    return (
        "Intervals (95 %) pool the scatter from seed to seed of the logarithm of an error (RMSE, MRE, frequency error, "
        f"1 − FRAC and so on) over the levels of a law on an engine: {freedom} degrees of freedom. They rest on the "
        f"assumption that it is the same at every level. Cochran’s test at 5 % refuses it in {uneven} of {len(tested)} "
        "cases (*; <code>tables/seed_scatter.csv</code>): there, intervals are too narrow at the level that scatters "
        "most and too wide at the others. <code>tables/seeds.csv</code> has each record. "
        "The repeat floor has one value a level: its intervals are the scatter about a power law of the level, and "
        "wide, as they take what is not a power law for scatter."
    )


def _by_level(study, pictures, kind, names) -> str:
    """Figures of every level: the main one open, the others folded away."""
    parts = []
    for level in _levels(study):
        shown = [pictures[key] for name in names if (key := f"{name}_level_{level:g}") in pictures]
        body, words = "".join(map(html.figure, shown)), f"Level {level:g} {tables.excitation_unit(study)} RMS"
        is_main = level == study.main_level
        anchor = f"{kind}-level-{level:g}"
        parts.append(html.subsection(anchor, words) + body if is_main else html.details(anchor, words, body))
    return "".join(parts)


def _frf(study, pictures) -> str:
    over_level = html.subsection("waterfall", "Over level") + html.figure(pictures["waterfall"])
    return over_level + _by_level(study, pictures, "frf", ("frf_bushings", "frf_others"))


def _correlation(study, pictures) -> str:
    return _by_level(study, pictures, "correlation", ("correlation", "csac_sensors", "csf_sensors"))


def _modes_and_sensors(study) -> str:
    parts = []
    if tables.base_law(study) != study.laws[-1].name:
        parts.append(html.subsection("improvement", "What the better laws gain"))
        parts.append(html.table(tables.improvement_table(study, study.main_level)))
        parts.append(html.note(_IMPROVEMENT_WORDS))
    parts.append(html.subsection("table-1", "Table 1: natural frequencies"))
    for label, level in zip(("Table 1a.", "Table 1b."), dict.fromkeys((study.main_level, study.levels[0]))):
        parts.append(html.table(tables.mode_table(study, level), label, breaks=True))
    parts.append(
        html.note(
            "RE: relative error of the natural frequency. Modes are numbered by frequency among those found in test or "
            "model; – : one of the two lacks it; * : doubtful, see the verdict’s note. The natural frequencies "
            'of a rig with clearance depend on level: see <a href="#figure-modes">the figure over level</a>.'
        )
    )
    parts.append(_sensor_tables(study))
    return "".join(parts)


_IMPROVEMENT_WORDS = (
    "Intervals: of the ratio of two means as if they were independent (Zou and Donner 2008); both share their seeds, "
    "so these are wide rather than narrow. A criterion that is 0.99 cannot rise by more than 1 %: compare the errors. "
    "CSAC and CSF are means of the sensors’ own, as in Table 2."
)


def _sensor_tables(study) -> str:
    level = f"{study.main_level:g} {tables.excitation_unit(study)} RMS"
    shown = tables.sensor_tables(study, study.main_level)
    cells = "".join(html.table(t, f"Table 2{letter}.") for letter, t in zip("abcde", shown))
    heading = html.subsection(
        "table-2", f"Table 2: FRF errors at each sensor, {level}, engine {tables.main_engine(study)}"
    )
    return heading + f'<div class="beside">\n{cells}</div>\n' + html.note(_SENSOR_WORDS)


_SENSOR_WORDS = (
    "CSAC and CSF as published sum over several responses, and CSAC is 1 by definition for one: those of a sensor are "
    'our variant over a window of nine lines, averaged over the lines (<a href="#definitions">definitions</a>). '
    "“repeat” is the repeat floor. Below a mean over seeds: its 95 % interval (* : doubtful). Other levels and "
    "engines: <code>tables/sensor_means.csv</code>; each record: <code>tables/sensors.csv</code>."
)


def _bushings(study, pictures) -> str:
    parts = [html.subsection("parameters", "Fitted parameters")]
    if tables.parameter_rows(study):
        parts.append(html.table(tables.parameter_table(study)))
        parts.append(
            html.note(
                "Standard deviations are a jackknife’s over bands of lines, about the linearised fit: they tell how "
                "well the records fix a parameter within the law, not whether the law is right. Rig file: the value at "
                "the first bushing."
            )
        )
    else:
        parts.append(html.paragraph("No law has fitted parameters."))
    if "uncertainty" in pictures:
        parts += [html.subsection("uncertainty", "What their uncertainty does"), html.figure(pictures["uncertainty"])]
    parts += [html.subsection("contact", "Motion and contact"), html.figure(pictures["contact"])]
    parts += [html.table(tables.contact_table(study), breaks=True)]
    parts += [html.subsection("modes", "Natural frequencies and damping over level"), html.figure(pictures["modes"])]
    return "".join(parts)


def _reproduce(study) -> str:
    path = shlex.quote(str(study.dataset.path or "DATASET"))
    commands = [f"clearance-mj study {path} --engines {','.join(tables.engines(study))} --out results/study"]
    makers = dict.fromkeys(str(r.provenance["command"]) for r in study.dataset.records if "command" in r.provenance)
    commands = [*(f"{command} {path}" for command in makers), *commands]
    lines = escape("\n".join(commands))
    return (
        html.paragraph(
            "These commands make the records and this report again:" if makers else "This makes the report again:"
        )
        + f"<pre><code>{lines}</code></pre>\n"
        + html.paragraph(
            "Beside this file: <code>figures/</code> (the figures, PNG), <code>tables/</code> (all numbers, CSV), "
            "<code>laws/</code> (the laws, JSON), <code>results.nc</code> (every FRF, NetCDF), "
            "<code>summary.json</code>."
        )
    )


def _definitions(study) -> str:
    frequency = next(iter(study.tests.values())).frequency
    intro = (
        "H_t is an FRF of the test and H_m of the model, under the same excitation and estimated alike: "
        f"H1 = S_yx / S_xx, Hann window, half overlap, lines every {frequency[1] - frequency[0]:g} Hz. "
        "Σ_f sums over lines, Σ_s over sensors; * is the complex conjugate."
    )
    items = "".join(
        f"<dt>{term}</dt>\n"
        + (f'<dd class="formula">{html.formula(formula)}</dd>\n' if formula else "")
        + (f"<dd>{html.formula(words)}</dd>\n" if words else "")
        for term, formula, words in _DEFINITIONS
    )
    return html.paragraph(html.formula(intro)) + f"<dl>\n{items}</dl>\n"


_DEFINITIONS = (
    ("RMSE, of a sensor", "√ mean_f (20 log_10(|H_m| / |H_t|))²", "In dB."),
    ("MRE, mean relative error, of a sensor", "mean_f ||H_m| − |H_t|| / |H_t|", ""),
    (
        "FRAC, frequency response assurance criterion, of a sensor (Heylen and Lammens 1996)",
        "|Σ_f H_t H_m*|² / (Σ_f |H_t|² · Σ_f |H_m|²)",
        "1 for equal FRFs; it does not see a complex scale factor.",
    ),
    (
        "CSAC, cross signature assurance criterion, of a line (Zang, Grafe and Imregun 2001)",
        "|Σ_s H_t* H_m|² / (Σ_s |H_t|² · Σ_s |H_m|²)",
        "1 for equal shapes along the rig, whatever their size. Where one number is given it is the mean over lines.",
    ),
    (
        "CSF, cross signature scale factor, of a line (Grafe 1998)",
        "2 |Σ_s H_t* H_m| / (Σ_s |H_t|² + Σ_s |H_m|²)",
        "1 only for equal shapes of equal size. Where one number is given it is the mean over lines.",
    ),
    (
        "CSAC and CSF of one sensor (our variant)",
        "",
        "The same with a sum over a window of nine lines in place of Σ_s, centred on a line and cut off at the ends of "
        "the band.",
    ),
    ("RE, relative error of a natural frequency", "|f_m − f_t| / f_t", ""),
    (
        "MAC, modal assurance criterion (Allemang and Brown 1982)",
        "|φ_t^H φ_m|² / ((φ_t^H φ_t) (φ_m^H φ_m))",
        "Of mode shapes φ. Modes come out of the FRFs by the least-squares complex frequency method and are paired by "
        "MAC and frequency.",
    ),
    (
        "Repeat floor",
        "",
        "The same measures between two records of the rig at one level, with different seeds of the random excitation: "
        "noise, drift, and what a nonlinear rig scatters into its FRFs.",
    ),
    ("Level", "", "RMS of the excitation."),
    (
        "Contact",
        "",
        "A bushing counts as touched while its simulated contact force is above 1 mN and 1 % of its peak.",
    ),
)
