"""A map of channels: its file, what it makes of channels, and what it refuses."""

import dataclasses

import numpy as np
import pytest

import clearance_mj as cm
from clearance_mj.io.channels import UNKNOWN

VALUE = np.array([1.0, -2.0, 3.0])


def raw(name, quantity=UNKNOWN, unit=""):
    return cm.Channel(name, 0, "S", quantity, VALUE, 100.0, unit=unit)


def test_units_places_and_signs():
    channels = cm.ChannelMap({"A": "acc:3:-Z [g]", "B": "base", "T": "skip", "P": "disp:6 [0.5 mm]"})
    a, b, p = channels.apply([raw("A"), raw("B", "acceleration"), raw("T"), raw("P")])
    assert (a.label, a.quantity, a.value.tolist()) == ("3:-Z", "acceleration", (9.80665 * VALUE).tolist())
    assert (b.label, b.value.tolist()) == ("100:+Z", VALUE.tolist())
    assert (p.label, p.quantity, p.value.tolist()) == ("6:+Z", "displacement", (0.5e-3 * VALUE).tolist())


def test_a_unit_of_the_map_goes_before_that_of_the_file():
    """Numbers that the file says to be in mm/s², read as SI units, are in g."""
    read = dataclasses.replace(raw("A", "acceleration", "mm/s^2"), value=VALUE * 1e-3)
    (channel,) = cm.ChannelMap({"A": "acc:1 [g]"}).apply([read])
    assert np.allclose(channel.value, 9.80665 * VALUE, rtol=1e-15)


def test_the_file_holds_names_and_reasons(tmp_path):
    channels = {'Accel "3" [g]': "acc:3", "Kanal ü": "?", "T": "skip"}
    made = cm.ChannelMap(channels, {"Kanal ü": "acc:1 or acc:2"}, ("of one afternoon",))
    made.save(tmp_path / "map.toml")
    assert cm.ChannelMap.load(tmp_path / "map.toml").channels == channels
    text = (tmp_path / "map.toml").read_text(encoding="utf-8")
    assert text.startswith("# of one afternoon\n[channels]\n") and "# acc:1 or acc:2\n" in text
    assert made.undecided == ("Kanal ü",) and "Kanal ü" in repr(made)


@pytest.mark.parametrize("channels, read, message", [
    ({"A": "?"}, raw("A"), 'channel "A" is undecided in the map: write what it is'),
    ({"B": "base"}, raw("A"), 'channel "A" is not in the map, which has "B"; add a line such as "A" = '),
    ({"A": "disp:6"}, raw("A", "acceleration"), "is acceleration by its unit in the file"),
    ({"A": "skip"}, raw("A"), "no channel that the map does not skip"),
])  # fmt: skip
def test_refused_channels(channels, read, message):
    with pytest.raises(cm.RecordError, match="^[^\n]*" + message.replace("?", r"\?")):
        cm.ChannelMap(channels).apply([read])


@pytest.mark.parametrize("text, message", [
    ("[channels]\nA = 3\n", r"needs a table \[channels\]"), ("A = 'base'\n", r"needs a table \[channels\]"),
    ("[channels\n", "no TOML file"), ("[channels]\nA = 'acc3'\n", 'channel "A"'),
    ("[channels]\nA = 'acc:3 [lb]'\n", 'unit "lb" of acceleration is unknown'),
    ("[channels]\nA = 'acc:1/base'\n", "is an FRF"),
])  # fmt: skip
def test_refused_files(tmp_path, text, message):
    path = tmp_path / "map.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(cm.RecordError, match="map.toml: .*" + message):
        cm.ChannelMap.load(path)
