"""Standard streams and environments as they are on other machines: closed, full, another character set, read-only."""

import ctypes
import io
import os
import shutil
import sys

import pytest

from clearance_mj import Rig
from clearance_mj.cli import main, names

from ..conftest import ROOT
from ..processes import FORK, ended, run
from .conftest import RIG

NO_WAY_AROUND_PERMISSIONS = (1, 2)  # CAP_DAC_OVERRIDE and CAP_DAC_READ_SEARCH of the superuser
DROP = 24  # PR_CAPBSET_DROP


def streamed(folder, standard_output):
    """Status and standard error of ``place`` whose standard output is a number, or closed; it ends as Python does."""

    def place():
        if standard_output is None:
            for number in (0, 1):
                os.close(number)
            sys.stdout = None
        else:
            os.dup2(standard_output, 1)
            sys.stdout = open(1, "w", encoding="utf-8", closefd=False)
        with (folder / "stderr.txt").open("w", buffering=1) as sys.stderr:
            status = main(["place", str(RIG), "--out", str(folder / "p")])
            sys.stdout.flush()
        os._exit(status)

    process = FORK.Process(target=place)
    process.start()
    return ended(process), (folder / "stderr.txt").read_text()


@pytest.mark.parametrize("encoding", ["ascii", "latin-1"])
def test_words_in_other_character_sets(encoding, tmp_path, monkeypatch):
    """Units and signs such as ² and ≥ are in no or few of them; the help of every command, and a path."""
    stream = io.TextIOWrapper(io.BytesIO(), encoding=encoding)
    monkeypatch.setattr(sys, "stdout", stream)
    for name in names():
        with pytest.raises(SystemExit) as ended:
            main([name, "--help"])
        assert ended.value.code == 0
    assert main(["new", "bench", "--out", str(tmp_path / "𝔘.toml")]) == 0
    assert rf"written: {tmp_path}/\U0001d518.toml".encode() + b"\n" in stream.buffer.getvalue()


def test_a_name_beyond_the_basic_plane(tmp_path):
    path = tmp_path / "rig.toml"
    assert main(["new", "Bäx𝔘\x7f", "--out", str(path)]) == 0 and Rig.load(path).name == "Bäx𝔘\x7f"


def test_standard_output_that_is_full(tmp_path):
    with open("/dev/full", "w") as full:
        assert streamed(tmp_path, full.fileno()) == (1, "clearance-mj: No space left on device\n")
    assert (tmp_path / "p" / "placement.csv").is_file()  # all the same


def test_closed_standard_output(tmp_path):
    """What is opened next would have its number: results must not hold words."""
    assert streamed(tmp_path, None) == (0, "")
    assert (tmp_path / "p" / "placement.csv").read_text().startswith("sensor,position_m,contribution")


def test_a_pipe_that_nobody_reads(tmp_path):
    read, write = os.pipe()
    os.close(read)
    assert streamed(tmp_path, write) == (1, "")
    os.close(write)
    assert (tmp_path / "p" / "placement.csv").is_file()


@pytest.mark.slow
@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="capabilities are Linux's")
@pytest.mark.parametrize("writable", [True, False])
def test_read_only_package_without_a_home(tmp_path, writable):
    """As in a container: numba refused to compile. Without any folder that can be written it compiles every time."""
    package, temporary = tmp_path / "site" / "clearance_mj", tmp_path / "temporary"
    shutil.copytree(ROOT / "clearance_mj", package, ignore=shutil.ignore_patterns("__pycache__"))
    temporary.mkdir()
    for folder in (package, *package.rglob("*")):
        folder.chmod(0o555 if folder.is_dir() else 0o444)

    def drop():
        for capability in NO_WAY_AROUND_PERMISSIONS:
            ctypes.CDLL(None).prctl(DROP, capability, 0, 0, 0)

    words = "import clearance_mj.clearance.kernel as k; print(k.__file__)"
    if not writable:
        words = f"import tempfile; tempfile.gettempdir = lambda: '/proc'; {words}"
    environment = os.environ | {
        "HOME": "/proc/none", "XDG_CACHE_HOME": "/proc/none", "PYTHONPATH": str(package.parent),
        "PYTHONDONTWRITEBYTECODE": "1", "TMPDIR": str(temporary),
    }  # fmt: skip
    done = run("-c", words, env=environment, cwd=tmp_path, preexec_fn=drop)
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == str(package / "clearance" / "kernel.py")
    assert ("keeps what it compiles in" if writable else "compiles anew in every process") in done.stderr
    assert [path.name for path in temporary.iterdir()] == [f"clearance_mj-{os.getuid()}"] * writable
