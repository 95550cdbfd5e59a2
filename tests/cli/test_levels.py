"""Levels, limits and speeds have units: those of an acceleration or a force, by what excites the rig."""

import argparse

import pytest

from clearance_mj.cli.options import kmh, level, levels

from ..conftest import ROOT
from .conftest import RIG

GRAVITY, MILE = 9.80665, 1609.344  # m/s² and m, exact (NIST SP 811, 2008, B.8)


@pytest.mark.parametrize("read, text, kind, value", [
    (level, "0.5g", "base", 0.5 * GRAVITY), (level, "3N", "force", 3.0), (level, "1 lbf", "force", 4.4482216152605),
    (level, "2", "unbalance", 2.0), (levels, "1g,200mm/s2", "base", (GRAVITY, 0.2)),
    (levels, "1g:2g:3", "base", (GRAVITY, 1.5 * GRAVITY, 2 * GRAVITY)), (levels, "1,2", "unbalance", (1.0, 2.0)),
])  # fmt: skip
def test_a_level_is_read_by_the_kind_of_its_excitation(read, text, kind, value):
    assert read(text)(kind) == pytest.approx(value, rel=1e-14)


@pytest.mark.parametrize("read", [level, levels])
def test_what_is_no_level_is_refused_at_once(read):
    for text in ("3kg", "three", "nan"):
        with pytest.raises(argparse.ArgumentTypeError):
            read(text)


def test_speeds_are_kilometres_an_hour_or_have_a_unit():
    assert (kmh("80"), kmh("80km/h"), kmh("10m/s")) == (80.0, 80.0, 36.0)
    assert kmh("50mph") == pytest.approx(50 * MILE / 1000, rel=1e-9)
    with pytest.raises(argparse.ArgumentTypeError, match="velocity"):
        kmh("80kg")


def test_peaks_with_units_are_those_without(tmp_path, answer):
    given = ("peaks", RIG, "--road", "A", "--at", "body", "--duration", 5)
    plain = answer(*given, "--speed", 36, "--rms", 0.1 * GRAVITY, "--limit", 2, "--out", tmp_path / "a")
    united = answer(*given, "--speed", "10m/s", "--rms", "0.1g", "--limit", "0.002kN", "--out", tmp_path / "b")
    assert united["largest"] == plain["largest"] and united["psd"]["value"] == plain["psd"]["value"]


def test_a_limit_is_of_the_quantity(tmp_path, refused):
    given = ("peaks", RIG, "--road", "A", "--speed", 36, "--quantity", "penetration", "--out", tmp_path / "out")
    assert 'unit "N" of displacement is unknown' in refused(*given, "--limit", "3N")
    assert '"" is no number' in refused(*given, "--limit", "")


@pytest.mark.parametrize("command, given", [
    ("simulate", ("--rms", "3N", "--duration", 1)),
    ("animate", ("--rms", "3N", "--duration", 1)),
    ("motion", ("--levels", "3N", "--duration", 1)),
    ("listen", ("--levels", "3N", "--sensor", 8, "--area", 1, "--distance", 1, "--method", "none")),
    ("rattle-map", ("--levels", "3N")),
    ("response", ("--level", "3N")),
    ("life", ("--level", "3N", "--gap-limit", "x2")),
    ("peaks", ("--road", "A", "--speed", 80, "--rms", "3N")),
    ("production", ("--scatter", ROOT / "models" / "scatter" / "table1.toml", "--levels", "3N", "--designs", 2)),
])  # fmt: skip
def test_newtons_do_not_shake_a_base(command, given, tmp_path, refused):
    out = ("--out", tmp_path / ("out.nc" if command == "simulate" else "out.gif" if command == "animate" else "out"))
    assert 'level 3N of kind "base": unit "N" of acceleration' in refused(command, RIG, *given, *out)
