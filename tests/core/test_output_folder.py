"""Folders that hold other files too: only what the manifest lists, unchanged, is ever replaced or removed."""

import json
import os
import signal

import pytest

from clearance_mj.core.cache import file_lock
from clearance_mj.core.errors import ClearanceError
from clearance_mj.core.output_folder import WORK, OutputFolder, output_folder

from ..processes import FORK, content, ended, kill
from ..refusals import assert_refused

FOREIGN = {
    "thesis.tex": b"\x00precious", ".DS_Store": b"\x01", "figures/photo.png": b"not a png", "tables/raw.csv": b"1,2\n",
    "laws/deep/er/notes.txt": b"", "new": b"a file of this name", "cache/data.nc": b"mine",
}  # fmt: skip
BESIDE = {"paper.old/report.html": b"old", "paper.partial/cache/x.nc": b"partial", "paper.partial/lock": b""}


def write(folder, files):
    for name, data in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(data)


def shown(folder):
    """Everything but the hidden working folder."""
    return {name: data for name, data in content(folder).items() if not name.startswith(WORK)}


def run(out, *names, what="study", text="new"):
    with output_folder(out, what) as folder:
        write(folder.new, {name: f"{text} {name}".encode() for name in names})


def files(*names, text="new"):
    return {name: f"{text} {name}".encode() for name in names}


FIRST = ("report.html", "summary.json", "figures/rig.png", "figures/modes.png", "tables/a.csv")
SECOND = ("report.html", "summary.json", "figures/rig.png", "laws/nominal.json")


@pytest.fixture
def out(tmp_path):
    """A folder of somebody's own files, with such beside it as an earlier version took for its own."""
    write(tmp_path / "paper", FOREIGN)
    write(tmp_path, BESIDE)
    yield tmp_path / "paper"
    assert {n: data for n, data in content(tmp_path).items() if n in BESIDE} == BESIDE
    assert {n: data for n, data in content(tmp_path / "paper").items() if n in FOREIGN} == FOREIGN


def test_other_files_stay_byte_for_byte(out):
    run(out, *FIRST)
    assert shown(out) == FOREIGN | files(*FIRST)
    write(out, {"figures/annotated.png": b"drawn over"})
    run(out, *SECOND, text="second")
    assert shown(out) == FOREIGN | files(*SECOND, text="second") | {"figures/annotated.png": b"drawn over"}


def test_folders_that_become_empty_go(tmp_path):
    run(tmp_path / "out", *FIRST)
    run(tmp_path / "out", "report.html")
    assert {p.name for p in (tmp_path / "out").iterdir()} == {WORK, "report.html"}


def test_two_commands_in_one_folder(out):
    run(out, *FIRST)
    run(out, "law.json", what="identify")
    run(out, *SECOND, text="second")
    assert shown(out) == FOREIGN | files(*SECOND, text="second") | files("law.json")


def test_a_link_to_a_folder(out, tmp_path):
    (tmp_path / "link").symlink_to(out)
    run(tmp_path / "link", *FIRST)
    assert (tmp_path / "link").is_symlink() and shown(out) == FOREIGN | files(*FIRST)
    (tmp_path / "dangling").symlink_to(tmp_path / "elsewhere")
    run(tmp_path / "dangling", *FIRST)
    assert shown(tmp_path / "elsewhere") == files(*FIRST)


@pytest.mark.parametrize("name", ["report.html", "figures/rig.png"])
def test_a_file_that_was_edited_is_kept_and_named(out, name):
    run(out, *FIRST)
    (out / name).write_bytes(b"edited")
    before = content(out)
    with pytest.raises(ClearanceError, match=rf"paper/{name} was changed after clearance-mj wrote it; move it away"):
        run(out, *SECOND)
    assert content(out) == before


def test_a_file_that_was_removed_is_written_again(out):
    run(out, *FIRST)
    (out / "report.html").unlink()
    run(out, *FIRST)
    assert shown(out) == FOREIGN | files(*FIRST)


@pytest.mark.parametrize(("name", "words"), [
    ("thesis.tex", "thesis.tex is there and not listed as written by this version"),
    ("cache/data.nc", "cache/data.nc is there and not listed as written by this version"),
    ("thesis.tex/rig.png", r"thesis\.tex is a file where a folder is needed"),
])  # fmt: skip
def test_a_file_that_is_in_the_way_is_not_replaced(out, name, words):
    """Such as a report of a version that wrote no manifest: nothing says that nobody changed it."""
    assert_refused(ClearanceError, f"paper/{words}", run, out, "report.html", name)
    assert shown(out) == FOREIGN


def test_links_in_place_of_our_files_are_not_followed(out, tmp_path):
    run(out, *FIRST)
    (out / "report.html").rename(tmp_path / "report.html")
    (out / "report.html").symlink_to(tmp_path / "report.html")
    assert_refused(ClearanceError, "was changed after", run, out, *SECOND)


def leading(name):
    return json.dumps({"files": {name: {"sha256": "0", "by": "study"}}}), r" \(a path leads out of the folder\)"


@pytest.mark.parametrize(
    ("text", "words"),
    [*(leading(name) for name in ("../thesis.tex", "/thesis.tex", "figures/../../thesis.tex")),
     *((text, "") for text in ("", "[]", '{"files": 3}', "{}"))],
)  # fmt: skip
def test_a_damaged_manifest(tmp_path, text, words):
    run(tmp_path / "out", *FIRST)
    before = shown(tmp_path / "out")
    (tmp_path / "out" / WORK / "manifest.json").write_text(text)
    assert_refused(ClearanceError, rf"manifest\.json: is damaged{words}", run, tmp_path / "out", *SECOND)
    assert shown(tmp_path / "out") == before


def test_a_failure_leaves_what_was_there_and_results_for_the_next_try(out):
    run(out, *FIRST)
    before = content(out)
    with pytest.raises(KeyboardInterrupt), output_folder(out, "study") as folder:
        write(folder.new, files(*SECOND))
        folder.cache.get("case", 1, lambda: "result", lambda data, path: path.write_text(data), lambda path: "")
        raise KeyboardInterrupt
    assert shown(out) == {n: data for n, data in before.items() if not n.startswith(WORK)}
    with output_folder(out, "study") as folder:
        assert folder.cache.get("case", 1, None, None, lambda path: path.read_text()) == "result"
        folder.cache.drop_unused()
        assert {path.suffix for path in folder.cache.folder.iterdir()} == {".nc", ".sha256"}
    with output_folder(out, "study") as folder:
        folder.cache.drop_unused()
        assert not [*folder.cache.folder.iterdir()]


def test_a_refusal_leaves_no_trace(out, tmp_path):
    with pytest.raises(ClearanceError), output_folder(out, "study") as folder:
        folder.refuse_others("thesis.tex")
    assert content(out) == FOREIGN
    with pytest.raises(ClearanceError), output_folder(tmp_path / "new", "study"):
        raise ClearanceError
    assert not (tmp_path / "new").exists()


def test_a_hidden_folder_of_somebody_else(tmp_path):
    write(tmp_path, {f"{WORK}/diary.txt": b"dear"})
    assert_refused(ClearanceError, r"\.clearance-mj is not a working folder of clearance-mj", run, tmp_path, *FIRST)
    assert content(tmp_path) == {f"{WORK}/diary.txt": b"dear"}


def test_one_process_at_a_time(tmp_path):
    run(tmp_path, *FIRST)
    message = f"another study .process {os.getpid()}. is writing there"
    with file_lock(tmp_path / WORK / "lock", "study"), pytest.raises(ClearanceError, match=message):
        run(tmp_path, *SECOND)


CALLS = [1, 5, *(pytest.param(call, marks=pytest.mark.slow) for call in (2, 3, 4, *range(6, 12)))]


@pytest.mark.parametrize("call", CALLS)
def test_killed_while_it_publishes(out, call, monkeypatch):
    """Before each file that it removes or moves. The report goes first and comes last; the next command finishes."""
    run(out, *FIRST)

    def publish():
        count, finish = iter(range(1, 100)), OutputFolder._finish_moves

        def counted(function):
            return lambda *args, **kwargs: (kill() if next(count) == call else None, function(*args, **kwargs))[1]

        def patched(folder):
            if folder._moves.exists():
                for name in ("unlink", "replace"):
                    setattr(type(out), name, counted(getattr(type(out), name)))
            finish(folder)

        OutputFolder._finish_moves = patched
        run(out, *SECOND, text="second")

    process = FORK.Process(target=publish)
    process.start()
    assert ended(process) == -signal.SIGKILL
    old, new = FOREIGN | files(*FIRST), FOREIGN | files(*SECOND, text="second")
    left = shown(out)
    assert left in (old, new) or "report.html" not in left
    with pytest.raises(ClearanceError), output_folder(out, "study"):
        raise ClearanceError
    assert shown(out) == new
