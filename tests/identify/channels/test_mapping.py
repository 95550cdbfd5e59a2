"""Channels of drawn benches, of physics that the package does not contain, on rig files that are wrong."""

import dataclasses
import warnings
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import clearance_mj as cm
from clearance_mj.identify.channels.check import check_places
from clearance_mj.identify.channels.units import decide_units
from clearance_mj.identify.records.prepared import prepare
from clearance_mj.io.channels import UNKNOWN, Channel
from clearance_mj.io.columns import channel_name
from experiments.benches.logger import as_logged, drawn_bench, measured
from experiments.benches.mapping import map_drawn_bench

from ...refusals import assert_refused

TABLE1 = Path(__file__).parents[3] / "data" / "table1_rig"
FOUR_ACCELEROMETERS = 11  # seed of a bench with one bushing, four accelerometers and no probe


@cache
def bench():
    drawn = drawn_bench(FOUR_ACCELEROMETERS)
    return drawn.rig, [*measured(drawn).values()]


@pytest.fixture
def rig():
    return bench()[0]


@pytest.fixture
def records():
    return bench()[1]


def logged(said=1.0):
    return as_logged(bench()[1], FOUR_ACCELEROMETERS, said)


def changed(records, change):
    return [[change(channel) for channel in channels] for channels in records]


def test_names_order_signs_and_units_that_say_nothing():
    """The truth is that of the drawn logger."""
    channels, truth = logged(said=0.0)
    channel_map = cm.map_channels(channels, bench()[0])
    assert dict(channel_map.channels) == truth and channel_map.undecided == ()


def test_swapped_and_inverted_channels_are_found_whatever_the_file_says(rig, records):
    places = {"1:+Z": (4, "-Z"), "4:+Z": (1, "+Z")}  # the file takes 1 for 4, which is the other way round, and 4 for 1

    def lying(channel):
        node, direction = places.get(channel.label, (channel.node, channel.direction))
        name = "base" if node == 100 else f"acc:{node}"
        value = -channel.value if direction == "-Z" else channel.value
        return dataclasses.replace(channel, name=name, node=node, direction="+Z", value=value)

    channel_map = cm.map_channels(changed(records, lying), rig)
    expected = {"base": "base", "acc:4": "acc:1:-Z", "acc:1": "acc:4", "acc:2": "acc:2", "acc:3": "acc:3"}
    assert dict(channel_map.channels) == expected and "the file says node 4" in channel_map.reasons["acc:4"]


@pytest.mark.parametrize("wrong", [["base", "2:+Z"], None], ids=["base and one sensor", "every acceleration"])
def test_a_unit_that_is_not_that_of_the_file_is_asked_for(rig, records, wrong):
    """Numbers in g that are read as m/s²: transfer functions tell those of some, motion in the gap those of all."""
    wrong = ["100:+Z" if one == "base" else one for one in wrong] if wrong else None

    def in_g(channel):
        if wrong and channel.label not in wrong:
            return channel
        return dataclasses.replace(channel, value=channel.value / 9.80665)

    channel_map = cm.map_channels(changed(records, in_g), rig)
    asked = [c.name for c in records[0] if wrong is None or c.label in wrong]
    assert sorted(channel_map.undecided) == sorted(asked)
    assert all("[g]" in channel_map.reasons[name] for name in asked)


def test_what_no_unit_explains_is_asked_for(rig, records):
    double = changed(records, lambda c: dataclasses.replace(c, value=2 * c.value) if c.node == 2 else c)
    channel_map = cm.map_channels(double, rig)
    (name,) = channel_map.undecided
    assert name.startswith("accelerometer 2")
    numbers, _, offered = channel_map.reasons[name].rpartition("; likeliest ")
    gain = float(numbers.partition("as if they were in ")[2].split()[0])
    assert gain == pytest.approx(0.5, rel=0.05) and "[" not in offered  # what is in m/s2 already is offered as it is


@pytest.mark.slow
def test_channels_that_are_no_vibration_of_the_rig_are_left_out(rig, records):
    noise = np.random.default_rng(0).standard_normal(records[0][0].size)

    def more(channels):
        first = channels[0]
        temperature = Channel("Temp", 0, "S", UNKNOWN, 20 + noise[: first.size], first.fs, unit="°C")
        return [*channels, temperature, Channel("Clock", 0, "S", UNKNOWN, first.time, first.fs)]

    channel_map = cm.map_channels([more(channels) for channels in records], rig)
    assert channel_map.channels["Temp"] == channel_map.channels["Clock"] == "skip"
    assert "moves with no other channel" in channel_map.reasons["Temp"]
    assert "clock" in channel_map.reasons["Clock"] and channel_map.undecided == ()


@pytest.mark.slow
def test_fewer_channels_than_unknown_forces_are_asked_for():
    """An excitation and one accelerometer beside two clearances: forces there explain whatever the channels hold."""
    rig = cm.Rig.load(TABLE1 / "rig.toml")
    x = np.random.default_rng(3).standard_normal(4096)
    y = np.convolve(x, np.exp(-np.arange(30) / 9))[: x.size]
    channels = [Channel(name, 0, "S", UNKNOWN, value, 2048.0) for name, value in (("Ref", x), ("A1", y))]
    channel_map = cm.map_channels([channels], rig)
    assert set(channel_map.undecided) <= {"Ref", "A1"} and "A1" in channel_map.undecided


def test_records_that_drift_alone_are_refused():
    """Channels that move once in a record of 2 s, of which a line at 0.5 Hz would show no period."""
    time = np.arange(4096) / 2048.0
    drift = np.sin(np.pi * time / time[-1])
    channels = [Channel(name, 0, "S", UNKNOWN, drift**n, 2048.0) for n, name in enumerate(("A1", "A2", "Ref"), 1)]
    words = "as short as these tell nothing above 4 Hz, and most of their power is below 1"
    assert_refused(cm.RecordError, words, cm.map_channels, [channels], cm.Rig.load(TABLE1 / "rig.toml"))


def test_without_the_excitation_everything_is_asked_for(rig, records):
    without = [[c for c in channels if c.node != 100] for channels in records]
    channel_map = cm.map_channels(without, rig)
    assert len(channel_map.undecided) == 4 and "was its excitation recorded" in channel_map.notes[0]


@pytest.mark.slow
def test_a_wrong_sampling_rate_is_named(rig, records):
    channel_map = cm.map_channels(changed(records, lambda c: dataclasses.replace(c, fs=c.fs / 2)), rig)
    assert len(channel_map.undecided) == 5 and "2048 Hz instead of 1024 Hz" in channel_map.notes[0]


@pytest.mark.slow
def test_voltages_are_asked_for(rig, records):
    volts = changed(records, lambda c: dataclasses.replace(c, quantity=UNKNOWN, unit="V", value=c.value * 0.0102))
    channel_map = cm.map_channels(volts, rig)
    assert all('its unit "V"' in channel_map.reasons[name] for name in channel_map.channels)
    assert len(channel_map.undecided) == 5


def stepped(channel, size=8192, steps=(10.0, 17.0, 31.0)):
    """A channel under sines of 2 s, one after the other."""
    sines = [np.sin(2 * np.pi * f * np.arange(size // len(steps)) / channel.fs) for f in steps]
    return dataclasses.replace(channel, value=np.concatenate(sines))


def test_a_stepped_sine_leaves_the_map_to_the_other_records():
    """The truth is that of the drawn logger."""
    channels, truth = logged(said=0.0)
    files = {f"{i}.csv": record for i, record in enumerate(channels)} | {"sine.csv": [*map(stepped, channels[0])]}
    channel_map = cm.map_channels(files, bench()[0])
    assert dict(channel_map.channels) == truth
    assert channel_map.notes[0] == "sine.csv: is a stepped sine, the other records decide"


def test_the_excitation_of_a_stepped_sine_is_taken_for_what_it_is():
    """Three steps of a record, whose labels are the truth, tell the excitation, and are no records of another rig."""
    rig = cm.Rig.load(TABLE1 / "rig.toml")
    channels = cm.read(TABLE1 / "sine_1.uff")
    three = [dataclasses.replace(c, node=0, direction="S", value=c.value[: int(4.5 * c.fs)]) for c in channels]
    channel_map = cm.map_channels([three], rig)
    said = "\n".join((*channel_map.reasons.values(), *channel_map.notes))
    assert "not of this rig" not in said and "sampling rate" not in said
    (base,) = [c.name for c in channels if c.node == 100]
    assert channel_map.channels[base] == "base" or channel_map.reasons[base].endswith("likeliest base")
    assert "the records are under a stepped sine alone" in channel_map.notes[0]


@pytest.mark.slow
def test_a_stepped_sine_of_many_steps_is_mapped():
    rig = cm.Rig.load(TABLE1 / "rig.toml")
    channels = cm.read(TABLE1 / "sine_1.uff")
    channel_map = cm.map_channels([[dataclasses.replace(c, node=0, direction="S") for c in channels]], rig)
    assert dict(channel_map.channels) == {c.name: channel_name(c.label, c.quantity) for c in channels}


@pytest.mark.parametrize("files, message", [
    (lambda r: [[c for c in r[0]], [c for c in r[1] if c.node != 2]], "has no channel"),
    (lambda r: [[dataclasses.replace(c, value=c.value[:500]) for c in r[0]]], "needs 2048"),
    (lambda r: [[dataclasses.replace(c, value=0 * c.value + 1) for c in r[0]]], "needs two channels that move"),
    (lambda r: [[dataclasses.replace(c, name="A") for c in r[0]]], 'two channels have the name "A"'),
    (lambda r: [], "no file to map"),
])  # fmt: skip
def test_refused(rig, records, files, message):
    assert_refused(cm.RecordError, message, cm.map_channels, files(records), rig)


def test_units_of_gains():
    """Readings in g over a base in mm/s²; a probe in m tells the base's unit."""
    gains = [1e-3 / 9.80665, 1e-3, 1e-3]  # over what one unit of the base's would be
    units = decide_units(["acceleration", "displacement", "acceleration"], [False, True, False], gains, 1000.0, True)
    assert units.label == ("g", "", "mm/s2") and units.sure
    assert not any(units.contradicts)


@pytest.mark.slow
@pytest.mark.parametrize("first", [1, *(pytest.param(i, marks=pytest.mark.release) for i in range(11, 61, 10))])
def test_no_channel_of_sixty_drawn_benches_is_mapped_wrongly(first):
    """At least 95 % of the benches need no question: of each ten at most one does, of all sixty at most three."""
    outcomes = [map_drawn_bench(seed) for seed in range(first, first + 10)]
    assert [one.wrong for one in outcomes] == [()] * 10
    assert sum(bool(one.asked) for one in outcomes) <= 1


LABELLED = {
    "swapped": (lambda c: dataclasses.replace(c, node={1: 4, 4: 1}.get(c.node, c.node)),
                r"4:\+Z is accelerometer 1:\+Z"),
    "base reversed": (lambda c: dataclasses.replace(c, value=-c.value) if c.node == 100 else c, "has the wrong sign"),
    "one in g": (lambda c: dataclasses.replace(c, value=c.value / 9.80665) if c.node == 3 else c, "3:\\+Z is in g"),
}  # fmt: skip


@pytest.mark.parametrize("lie", LABELLED)
def test_identification_refuses_records_whose_channels_are_something_else(rig, records, lie):
    """Before anything is fitted: the fit would be to other sensors."""
    change, message = LABELLED[lie]
    assert_refused(cm.RecordError, message, cm.identify.fit_bench, dataset_of(rig, changed(records, change)))


def test_all_accelerations_in_g_are_warned_of(rig, records):
    in_g = changed(records, lambda c: dataclasses.replace(c, value=c.value / 9.80665))
    with pytest.warns(UserWarning, match="accelerations may be in g"):
        check_places(prepare(dataset_of(rig, in_g)))


def test_records_that_are_what_they_say_pass(rig, records):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_places(prepare(dataset_of(rig, records)))


def dataset_of(rig, records):
    cases = ((f"r{i}", "identify", rig, channels[0].fs, channels) for i, channels in enumerate(records))
    return cm.Dataset(rig, tuple(cm.Record(*case, band=(5.0, 220.0)) for case in cases), None)


@pytest.mark.parametrize("late", [
    {"3": -2.5},
    *(pytest.param(each, marks=pytest.mark.slow) for each in ({"3": 1.0}, {"100": 3.0}, {"1": 4.0, "2": 1.5})),
], ids=str)  # fmt: skip
def test_late_channels_are_named(rig, records, late):
    """Samples by which channels of a sound bench are moved: these come back, and every place and sign as without."""
    sound = cm.map_channels(changed(records, lambda channel: channel), rig)

    def moved(channel):
        phase = np.exp(-2j * np.pi * np.fft.rfftfreq(2 * channel.size) * late.get(str(channel.node), 0.0))
        value = np.fft.irfft(np.fft.rfft(channel.value, 2 * channel.size) * phase, 2 * channel.size)[: channel.size]
        return dataclasses.replace(channel, value=value)

    channel_map = cm.map_channels(changed(records, moved), rig)
    assert dict(channel_map.channels) == dict(sound.channels) and not channel_map.undecided
    names = {str(channel.node): channel.name for channel in records[0]}
    said = {note.split(" is ")[0]: note for note in channel_map.notes}
    assert said.keys() == {names[node] for node in late}
    for node, samples in late.items():
        words = said[names[node]]
        assert float(words.split("(")[1].split()[0]) == pytest.approx(abs(samples), abs=0.21)
        assert ("early" if samples < 0 else "late") in words


def test_a_clipped_channel_of_one_file_is_named(rig, records):

    def clipped(channel):
        top = 0.5 * np.abs(channel.value).max()
        return dataclasses.replace(channel, value=np.clip(channel.value, -top, top))

    first, *rest = records
    channel_map = cm.map_channels([[clipped(c) if c.node == 3 else c for c in first], *rest], rig)
    (note,) = (note for note in channel_map.notes if "clipped" in note)
    name = next(c.name for c in first if c.node == 3)
    assert note.startswith(f'record 1: channel "{name}" is clipped at ')
