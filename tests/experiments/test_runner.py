"""What is written, what is kept, what is computed again; with an item that costs nothing."""

import hashlib
import importlib
import json
import sys
from pathlib import Path
from types import ModuleType

import pandas as pd
import pytest
from matplotlib.figure import Figure

from clearance_mj.core.errors import ClearanceError
from clearance_mj.core.output_folder import WORK
from clearance_mj.report.style import Drawing
from clearance_mj.report.tables import Column
from experiments.article import ITEMS, Inputs, Item, Result, register, reproduce
from experiments.article.__main__ import main
from experiments.article.items import select
from experiments.article.result import to_table

from .. import processes
from ..conftest import ROOT
from ..refusals import assert_refused


@pytest.fixture
def calls(monkeypatch):
    """How often the item "small", the only one, was computed, by quick or not."""
    made = []

    def run(item, quick, rig):
        made.append(quick)
        figure = Figure((2, 2))
        figure.subplots().plot([0, 1])
        rows = pd.DataFrame({"who": ["ours", "theirs"], "x": [0.5, float("nan")]})
        return Result(
            "done", "a < b", (Drawing("small", figure, "A line", "line"),),
            {"small": rows[["x"]][:1], "small_errors": pd.DataFrame({"e": [1 / 3]})},
            (to_table("t", "Both", (Column("who"), Column("x", "m", ".2f")), rows),), {"ours": "everything"},
        )  # fmt: skip

    module = ModuleType("small_item")
    module.run = run
    monkeypatch.setitem(sys.modules, "small_item", module)
    monkeypatch.setattr(Inputs, "rig", None)
    kept = dict(ITEMS)
    ITEMS.clear()
    register(Item("small", "Small & simple", "small_item:run", ("quick", "rig")))
    yield made
    ITEMS.clear()
    ITEMS.update(kept)  # in their order, which item by item would not keep


def test_the_articles_figures_and_tables_are_complete():
    assert {*(f"figure_{i:02d}" for i in range(1, 14)), *(f"table_{i}" for i in range(1, 6))} <= set(ITEMS)


@pytest.mark.parametrize("name", ITEMS)
def test_every_item_has_code_texts_and_page(name):
    module, function = ITEMS[name].function.split(":")
    assert callable(getattr(importlib.import_module(module, "experiments.article"), function))
    assert ITEMS[name].texts["article"] and ITEMS[name].texts["differs"]
    page = (ROOT / "docs" / "experiments" / f"{name}.md").read_text(encoding="utf-8")
    assert page.startswith(f"# {ITEMS[name].title}\n")


def test_selection_keeps_the_order_and_drops_repeats():
    assert [item.name for item in select(["table_1", "figure_02", "table_1"])] == ["figure_02", "table_1"]
    assert select([]) == select(["all"]) == select(["figure_02", "all"]) == list(ITEMS.values())


def test_an_unknown_name_lists_the_known_ones():
    with pytest.raises(ClearanceError, match=r'"figure_99" is unknown; known: all, figure_01, .*table_2'):
        select(["figure_02", "figure_99"])


@pytest.mark.slow
def test_the_command_runs_alone(tmp_path):
    done = processes.run("-m", "experiments.article", "figure_02", "--out", tmp_path, "--quick", patience=600, cwd=ROOT)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "figure_02.png").read_bytes()[:4] == b"\x89PNG"
    assert len((tmp_path / "figure_02.csv").read_text().splitlines()) > 10


@pytest.fixture
def records(tmp_path):
    folder = tmp_path / "records"
    folder.mkdir()
    (folder / "dataset.toml").write_text("one")
    return folder


def run(tmp_path, records, **options):
    return reproduce(["small"], tmp_path / "out", records, progress=False, **options)


def test_files_and_pages(calls, tmp_path, records):
    (item,) = run(tmp_path, records)
    out = tmp_path / "out"
    assert set(item["files"]) == {"small.png", "small.svg", "small.csv", "small_errors.csv", "small.md"}
    assert {path.name for path in out.iterdir()} - {WORK} == {*item["files"], "small.json", "index.html"}
    assert (out / "small_errors.csv").read_text() == "e\n0.3333333333333333\n"
    page = (out / "index.html").read_text()
    assert "Small &amp; simple" in page and "a &lt; b" in page and "synthetic" in page
    assert "data:image/svg+xml;base64," in page and 'src="http' not in page
    markdown = (out / "small.md").read_text()
    assert markdown.startswith("# Small & simple\n")
    assert "| who | x (m) |\n| --- | ---: |\n| ours | 0.50 |\n| theirs | – |" in markdown


def test_what_is_there_is_kept(calls, tmp_path, records):
    first = run(tmp_path, records)
    assert run(tmp_path, records) == first and calls == [False]


CHANGED = {"records": ("records/dataset.toml", "two"), "damaged file": ("out/small.csv", "x\n0.6\n"),
           "damaged record": ("out/small.json", "\0")}  # fmt: skip


@pytest.mark.parametrize("change", ["quick", "missing file", *CHANGED])
def test_what_changed_is_computed_again(calls, tmp_path, records, change):
    run(tmp_path, records)
    if change == "missing file":
        (tmp_path / "out" / "small.svg").unlink()
    elif change in CHANGED:
        file, content = CHANGED[change]
        (tmp_path / file).write_text(content)
    run(tmp_path, records, quick=change == "quick")
    aside = {path.name: path.read_text() for path in (tmp_path / "out").glob("*.changed")}
    assert aside == ({f"{Path(file).name}.changed": content} if change.startswith("damaged") else {})
    assert calls == [False, change == "quick"] and (tmp_path / "out" / "small.csv").read_text() == "x\n0.5\n"
    assert "--quick" in (tmp_path / "out" / "index.html").read_text() or change != "quick"


def test_an_interrupted_item_is_not_taken_for_finished(calls, tmp_path, records, monkeypatch):
    run(tmp_path, records)
    (records / "dataset.toml").write_text("two")

    def interrupted(item, *inputs):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(sys.modules["small_item"], "run", interrupted)
        with pytest.raises(KeyboardInterrupt):
            run(tmp_path, records)
    run(tmp_path, records)
    assert len(calls) == 2


@pytest.mark.parametrize("name", ["small.csv", "small.json", "index.html"])
def test_files_of_others_stay(calls, tmp_path, records, name):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / name).write_text("mine")
    assert_refused(ClearanceError, f"{name} is there and not listed as written by this version", run, tmp_path, records)
    assert (tmp_path / "out" / name).read_text() == "mine"


def test_out_is_a_file(calls, tmp_path, records):
    (tmp_path / "out").write_text("")
    assert_refused(ClearanceError, "is a file; give a folder", run, tmp_path, records)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [(["figure_99"], 'item "figure_99" is unknown'), (["--dataset", "nowhere", "table_1"], "nowhere: does not exist")],
)
def test_bad_input_is_one_line_and_status_2(arguments, words, tmp_path, capsys):
    assert main(["--quiet", "--out", str(tmp_path / "out"), *arguments]) == 2
    error = capsys.readouterr().err
    assert words in error and error.count("\n") == 1


def test_json_has_the_digest_of_every_file(calls, tmp_path, records, capsys):
    out = tmp_path / "out"
    assert main(["all", "--json", "--quiet", "--out", str(out), "--dataset", str(records)]) == 0
    (item,) = json.loads(capsys.readouterr().out)["items"]
    assert item["files"]["small.csv"] == hashlib.sha256((out / "small.csv").read_bytes()).hexdigest()
