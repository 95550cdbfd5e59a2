"""The report of a study: one HTML file to read, its figures as PNG and its numbers as CSV."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ..core.output_folder import output_folder
from ..core.provenance import WORK
from ..io.dataset import Dataset
from ..study import Study, write_results
from . import html
from .sections import registered_sections, section
from .writer import ReportWriter

__all__ = ["report_study", "section", "write_report"]


def report_study(
    path: str | Path, out: str | Path, engines: Sequence[str] | None = None, methods: Sequence[str] | None = None,
    workers: int | None = None, progress: bool = False, identified: str | Path | None = None,
) -> Study:  # fmt: skip
    """Run the study of a dataset, and write its results and report into a folder.

    Parameters
    ----------
    path : str or Path
        Folder of the dataset.
    out : str or Path
        Folder for the results, see `output_folder`: an earlier study there is replaced once the new one is whole, other
        files stay. Laws and cases are kept for the next study, also of one that was interrupted.
    engines, methods : sequence of str
        As for `Study`.
    workers : int, optional
        Threads; default: one for each core.
    progress : bool
        Show progress bars.
    identified : str or Path, optional
        Folder of the command `identify`: what it has found in the same records by the same code is taken over.

    Raises
    ------
    RecordError, RigError
        If the dataset is not whole; nothing is written then.
    ClearanceError
        If a file in ``out`` is in the way, or another process is writing there.
    """
    study = Study(Dataset.load(path), methods, engines, workers=workers, progress=progress)
    with output_folder(out, "study", [Path(path)]) as folder:
        folder.refuse_others("report.html", "summary.json", "results.nc")
        study.cache = folder.cache
        if identified is not None:
            folder.cache.others = (Path(identified) / WORK / "cache",)
        write_results(study, folder.new)
        write_report(study, folder.new, progress)
        folder.cache.drop_unused()
    return study


def write_report(study: Study, folder: str | Path, progress: bool = False) -> None:
    """Write ``report.html``, ``figures/*.png`` and ``tables/*.csv``: every registered section.

    Parameters
    ----------
    study : Study
        What to report.
    folder : str or Path
        Folder that is written to; it is made if needed.
    progress : bool
        Show a progress bar.
    """
    writer = ReportWriter(Path(folder), progress)
    written = [html.PageSection(name, entry.title, entry.write(study, writer)) for name, entry in registered_sections()]
    sections = [section for section in written if section.body]
    title = f"Clearance study of rig “{study.dataset.rig.name}”"
    source = html.render("source.html.j2", study=study, source=study.dataset.source)
    writer.page(title, sections, source + html.examples(study.dataset.rig), "report.html")
