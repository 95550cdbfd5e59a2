"""The audit reproduces known verdicts from the article's tables, and follows the tables when they change."""

import html
import json
import shutil

import pandas as pd
import pytest

from clearance_mj.core.errors import RecordError
from experiments.article.audit import audit, to_html, to_markdown
from experiments.article.audit.__main__ import main

from ..conftest import ROOT
from ..refusals import assert_refused

TABLES = ROOT / "data" / "article"
TABLE4, TABLE5 = "table4_120kmh.csv", "table5_120kmh_peaks.csv"


@pytest.fixture(scope="module")
def claims():
    return audit(TABLES)


def verdicts(claims, text, where=""):
    matching = [c.verdict.split("; elsewhere")[0] for c in claims if text in c.text and where in c.where]
    assert matching, text
    return matching


def recomputed(claims, text):
    return [c.recomputed for c in claims if text in c.text]


OF_NEW = "divides by the new value"
WITHIN = "ok within the table's rounding"
MISPRINT = "wrong; perhaps a misprint of"
SWAPPED = ("that of the heading error", "that of the lateral position error")
EXPECTED = [
    ("relative error of mode", "Table 1", ["ok"] * 8),
    ("reduction of mode", "", ["ok"] * 4),
    ("'s MAC", "", [OF_NEW] * 8),
    ("maximum MAC, initial", "", [f"{MISPRINT} 0.4183, the minimum"]),
    ("maximum MAC, updated", "", ["the minimum"]),
    ("maximum frequency error", "", ["ok"] * 2),
    (" model", "Table 2", ["ok"] * 10 + ["not credible; by chance 6e-06", "not credible; by chance 1e-13"]),
    ("change of the mean MRE", "", ["ok"]),
    ("change of the mean RMSE", "", ["ok"]),
    ("change of the mean FRAC", "", [OF_NEW]),
    ("change of the mean CSAC", "abstract", [OF_NEW]),
    ("change of the mean CSAC", "Section", [f"{MISPRINT} 6.55, which {OF_NEW}"]),
    ("change of the mean CSF", "", [OF_NEW]),
    ("error against SMC", "", [f"{MISPRINT} -24.2, relative to the old value"] + ["ok"] * 4),
    ("reliability", "", ["ok"]),
    ("lateral position error against MPC", "abstract", [SWAPPED[0]]),
    ("heading error against MPC", "abstract", [SWAPPED[1]]),
    ("error against MPC", "Section 4.3", ["ok"] * 2),
    ("heading error of the text", "", ["row is labelled yaw velocity error peak, deg/s"]),
    ("acceleration against", "conclusion", ["that of the yaw velocity"] * 2),
    ("peak yaw velocity against", "conclusion", ["that of the lateral acceleration"] * 2),
    ("peak yaw velocity against MPC", "Section", ["that of the lateral acceleration; a decrease"]),
    ("unit of the lateral acceleration", "", ["unit should be m/s²"]),
    ("against speed times yaw velocity", "", ["inconsistent with the yaw velocity"] * 3),
    ("ends of a cantilever", "", ["free at both ends; a clamp needs Y(0) = Y'(0) = 0"]),
    ("cos λ ch λ", "", ["misprint of -1"]),
    ("asymptote", "", ["misprint of (2i - 1)π/2"]),
    ("mode shape 1", "", ["not free at x = l; cos λ + ch λ in the denominator is, for a cantilever"] * 2),
    ("second form of K", "", ["misprint of Y (EI Y'')''"]),
    ("damping of condition 2, SNR", "", ["biased where ω varies; -A'/A - ω'/(2ω) is not"]),
    ("real part of c", "", ["twice too large"]),
    ("damping of condition 2 over", "", ["negative after 1 s"]),
    ("translations", "", ["ok", "ok", "wrong", "wrong", "ok"]),
]  # fmt: skip


@pytest.mark.parametrize(("text", "where", "expected"), EXPECTED, ids=[f"{t} {w}".strip() for t, w, _ in EXPECTED])
def test_verdict(claims, text, where, expected):
    """Worked out by hand from the article's tables."""
    assert verdicts(claims, text, where) == expected


@pytest.mark.parametrize(("text", "values"), [
    ("'s MAC", ["+75.20 %", "+45.11 %", "+63.86 %", "+103.01 %"]),
    ("change of the mean", ["-27.68 %", "-63.41 %", "+18.74 %", "+7.01 %", "+7.01 %", "+14.12 %"]),
    ("error against SMC", ["-24.2 % (-26.9 to -21.5)", "-14.3 %", "-15.6 %"]),
    ("columns independent", ["FRAC - MRE = 0.0630 in 5 of 8 rows", "FRAC - MRE = 0.3680 in 8 of 8 rows"]),
    ("speed times yaw velocity", ["33.3 m/s × 2.6 deg/s = 1.51 m/s²"]),
])  # fmt: skip
def test_recomputed(claims, text, values):
    assert recomputed(claims, text)[: len(values)] == values


def test_places_that_contradict_each_other_say_so(claims):
    csac = {c.where: c.verdict for c in claims if c.text == "change of the mean CSAC"}
    assert csac["abstract, conclusion 2"].endswith("; elsewhere +6.65 %")
    assert csac["Section 4.2"].endswith("; elsewhere +6.55 %")
    assert not any("elsewhere" in c.verdict for c in claims if "MAC" in c.text)  # 42.92 and 42.923 agree


CHANGES = [
    ("table1_natural_frequency.csv", "1", "initial_mac", "0.6592", "mode 1's MAC", "", WITHIN),
    ("table1_natural_frequency.csv", "3", "updated_hz", "92.65", "mode 3, updated", "Table 1", "wrong"),
    ("table1_natural_frequency.csv", "2", "initial_mac", "0.4173", "maximum MAC, initial", "", "the minimum"),
    ("table1_natural_frequency.csv", "4", "updated_mac", "0.8600", "mode 4's MAC", "abstract", "wrong"),
    ("table2_frf_errors.csv", "8", "updated_csf", "0.8957", "mean CSF, updated", "", "wrong"),
    ("table2_frf_errors.csv", "8", "updated_csf", "0.8957", "every CSF", "", "wrong"),
    ("table2_frf_errors.csv", "1", "initial_frac", "0.8644", "independent, initial", "", "ok"),
    ("table3_72kmh.csv", "lateral_position_error_peak", "smc_cm", "0.026", "error against SMC", "4.3", "ok"),
    (TABLE4, "lateral_position_error_peak", "mpc", "0.0933", "error against MPC", "abstract", "ok"),
    (TABLE5, "lateral_acceleration_peak", "unit_as_printed", "m/s^2", "unit of the lateral", "", "ok"),
    (TABLE5, "yaw_velocity_peak", "smc_cm", "-8.9", "of SMC-CM, against speed", "", "ok"),
    (TABLE5, "yaw_velocity_peak", "mpc", "-2.105", "yaw velocity against MPC", "4.3", "ok"),
    (TABLE5, "yaw_velocity_peak", "mpc", "-3.4", "yaw velocity against MPC", "4.3", "a decrease"),
]  # fmt: skip


@pytest.mark.parametrize(("file", "row", "column", "value", "text", "where", "verdict"), CHANGES)
def test_a_changed_table_changes_the_verdict(claims, tmp_path, file, row, column, value, text, where, verdict):
    shutil.copytree(TABLES, tmp_path / "tables")
    change(tmp_path / "tables" / file, row, column, value)
    changed_verdict = verdicts(audit(tmp_path / "tables"), text, where)[0]
    assert changed_verdict == verdict and changed_verdict != verdicts(claims, text, where)[0]


def change(path, row, column, value):
    table = pd.read_csv(path, index_col=0, dtype=str)
    table.loc[row, column] = value
    table.to_csv(path)


@pytest.mark.parametrize(("damage", "message"), [
    (lambda f: (f / TABLE4).unlink(), "table4_120kmh.csv: the article's table is not there"),
    (lambda f: change(f / TABLE5, "yaw_velocity_peak", "mpc", "fast"), "mpc of yaw_velocity_peak is 'fast', not"),
    (lambda f: change(f / TABLE5, "yaw_velocity_peak", "mpc", "0"), "mpc of yaw_velocity_peak is 0; changes need"),
    (lambda f: change(f / TABLE5, "yaw_velocity_peak", "mpc", "1e30"), "is 1e30; changes need sizes from 1e-6 to"),
    (lambda f: (f / "table2_frf_errors.csv").write_text("sensor\nmean\n"), "has no row of a sensor"),
    (lambda f: (f / TABLE5).write_text("quantity,mpc\na,1\n"), "has 1 rows, 2 are needed"),
    (lambda f: (f / TABLE4).write_bytes(b"\xff\xfe"), "table4_120kmh.csv: cannot be read as a table"),
    (lambda f: (f / "table3_72kmh.csv").write_text("quantity,smc\n"), "has no smc of lateral_position_error_peak"),
])  # fmt: skip
def test_tables_that_cannot_be_used(tmp_path, damage, message):
    shutil.copytree(TABLES, tmp_path / "tables")
    damage(tmp_path / "tables")
    assert_refused(RecordError, message, audit, tmp_path / "tables")


def test_the_documentation_is_what_the_code_makes(claims):
    assert (ROOT / "docs" / "audit.md").read_text(encoding="utf-8") == to_markdown(claims)


def test_html_shows_every_claim(claims):
    page = to_html(claims)
    assert page.count("<tr>") == len(claims) + len(dict.fromkeys(c.part for c in claims))
    assert "free at both ends; a clamp needs Y(0) = Y'(0) = 0" in html.unescape(page)


def test_the_command_reads_tables_and_prints_json(claims, capsys):
    assert main(["--tables", str(TABLES), "--json"]) == 0
    assert [c["verdict"] for c in json.loads(capsys.readouterr().out)["claims"]] == [c.verdict for c in claims]


def test_files_by_their_suffix(claims, tmp_path, capsys):
    for suffix in ("md", "html", "csv"):
        assert main(["--out", str(tmp_path / f"audit.{suffix}"), "--json"]) == 0
    assert (tmp_path / "audit.md").read_text(encoding="utf-8") == to_markdown(claims)
    assert list(pd.read_csv(tmp_path / "audit.csv")["verdict"]) == [c.verdict for c in claims]
    capsys.readouterr()
    assert main(["--out", str(tmp_path / "audit.pdf")]) == 2
    assert "an audit is written as .md, .html, .csv" in capsys.readouterr().err
