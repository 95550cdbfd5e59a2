"""clearance-mj live: the page's address is told and kept private; bad input is one line."""

import os
import signal
import stat

import pytest

from clearance_mj.cli import main

from ..conftest import SMALL_LAW
from ..processes import PATIENCE, started, wait_for
from .conftest import RIG

pytest.importorskip("tornado", reason="the live page needs Tornado (the extra live)")


def test_the_address_is_told_until_the_page_ends(monkeypatch, capsys, tmp_path, small_dataset, output_of):
    seen = {}

    def serve(page, ready):
        ready()
        out = tmp_path / "address"
        seen.update(page=page, text=out.read_text(), mode=stat.S_IMODE(out.stat().st_mode))
        raise KeyboardInterrupt

    monkeypatch.setattr("clearance_mj.live.server.serve", serve)
    SMALL_LAW.save(tmp_path / "law.json")
    arguments = ["live", str(small_dataset), "--law", str(tmp_path / "law.json"), "--no-browser", "--out"]
    printed = output_of(*arguments, tmp_path / "address").out
    assert seen["text"] == seen["page"].address + "\n" and f"live: {seen['text']}" in printed
    assert seen["mode"] == 0o600 and not (tmp_path / "address").exists()
    (tmp_path / "address").write_text("http://127.0.0.1:1/of-a-page-that-was-killed/")  # readable to all
    assert main([*arguments, str(tmp_path / "address")]) == 0 and seen["mode"] == 0o600
    os.mkfifo(tmp_path / "pipe")
    assert main([*arguments, str(tmp_path / "pipe")]) == 2 and (tmp_path / "pipe").is_fifo()
    assert "pipe: is a pipe, not a file; give another name" in capsys.readouterr().err
    session = seen["page"].session()
    assert session.model.law == SMALL_LAW and session.dataset.path == small_dataset  # the rig's folder is a dataset's


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
@pytest.mark.parametrize("ending, interrupts", [
    (signal.SIGINT, signal.default_int_handler), (signal.SIGTERM, signal.default_int_handler),
    (signal.SIGTERM, signal.SIG_IGN),
])  # fmt: skip
def test_a_signal_ends_the_page_and_removes_its_address(tmp_path, ending, interrupts):
    address, printed = tmp_path / "address", tmp_path / "printed"
    command = ("-m", "clearance_mj", "live", RIG, "--no-browser", "--out", address)
    with printed.open("w") as out, started(*command, out=out, interrupts=interrupts) as process:
        wait_for(lambda: address.exists() and "Ctrl-C" in printed.read_text())
        process.send_signal(ending)
        assert process.wait(PATIENCE) == 0
    live, _, last = printed.read_text().splitlines()
    assert live.startswith("live: http://127.0.0.1:") and last.startswith("closed")
    assert not address.exists()


def test_bad_input(refused, tmp_path):
    assert "cannot be read" in refused("live", tmp_path / "rig.toml")
    assert "does not exist" in refused("live", RIG, "--dataset", tmp_path / "none", "--no-browser")
    assert "--port 70000: needs a number from 0 to 65535" in refused("live", RIG, "--port", 70000, "--no-browser")
