"""Universal files written by us and read by pyuff, and the other way round."""

import dataclasses
from itertools import product

import numpy as np
import pytest
import pyuff

from clearance_mj import RecordError, read_uff, write_uff
from clearance_mj.io.uff import DIRECTIONS, scan_uff
from clearance_mj.signals import join_references

from .uff_by_hand import RNG, channels, frf

# pyuff as the independent reader and writer


def test_pyuff_reads_our_channels(tmp_path):
    sent = channels()
    write_uff(tmp_path / "a.uff", sent)
    header, units, *functions = pyuff.UFF(str(tmp_path / "a.uff")).read_sets()
    assert (header["type"], header["date_file_written"]) == (151, "01-Jan-00")
    assert (units["type"], units["units_code"], units["length"], units["force"]) == (164, 1, 1.0, 1.0)
    specs = {"acceleration": 12, "displacement": 8, "velocity": 11, "force": 13}
    assert len(functions) == len(sent)
    for f, c in zip(functions, sent):
        np.testing.assert_array_equal(f["data"], c.value)
        np.testing.assert_allclose(f["x"], np.arange(64) / 2048, rtol=2e-6)
        assert (f["id1"], f["rsp_node"], f["rsp_dir"]) == (c.name, c.node, DIRECTIONS[c.direction])
        assert (f["func_type"], f["ord_data_type"], f["abscissa_spacing"]) == (1, 2, 1)
        assert (f["abscissa_spec_data_type"], f["ordinate_spec_data_type"]) == (17, specs[c.quantity])
        assert f["n_bytes"] == 256


def test_pyuff_reads_our_frf(tmp_path):
    write_uff(tmp_path / "h.uff", join_references([frf(), dataclasses.replace(frf(), references=("5:+Z",))]))
    with pytest.raises(RecordError, match=r"needs time records .* its functions are 4 \(freq.*\), 6 \(coherence\)"):
        scan_uff(tmp_path / "h.uff")
    functions = pyuff.UFF(str(tmp_path / "h.uff")).read_sets()[2:]
    assert [f["func_type"] for f in functions] == [4, 4, 4, 6, 6, 6] * 2
    frfs = [(f["ref_node"], f["ref_dir"], f["rsp_node"]) for f in functions if f["func_type"] == 4]
    assert frfs == [*product((100, 5), (3,), (1, 2, 8))]
    assert {(f["ordinate_spec_data_type"], f["orddenom_spec_data_type"]) for f in functions[:3]} == {(12, 12)}


def by_pyuff(path, **changes):
    x = np.arange(64) / 2048
    dset = {
        "type": 58, "binary": 0, "func_type": 1, "rsp_node": 3, "rsp_dir": 3, "ref_node": 0, "ref_dir": 0,
        "abscissa_spacing": 1, "abscissa_spec_data_type": 17, "ordinate_spec_data_type": 12,
        "orddenom_spec_data_type": 0, "x": x, "data": RNG.standard_normal(64),
    }  # fmt: skip
    dset |= changes
    pyuff.UFF(str(path)).write_sets([dset], mode="add")
    return dset["data"]


OF_FRF = {"binary": 1, "func_type": 4, "abscissa_spec_data_type": 18, "orddenom_spec_data_type": 13}
each_layout = pytest.mark.parametrize("binary, spacing", [*product((0, 1), (0, 1))])


@each_layout
def test_we_read_pyuffs_time_functions(tmp_path, binary, spacing):
    """pyuff marks evenly sampled functions as uneven unless told otherwise (OpenModal issue 14)."""
    data = by_pyuff(tmp_path / "a.uff", binary=binary, abscissa_spacing=spacing)
    (got,) = read_uff(tmp_path / "a.uff")
    np.testing.assert_allclose(got.value, data, rtol=0 if binary else 1e-11)
    assert got.fs == pytest.approx(2048.0, rel=0 if binary and not spacing else 1e-5)


@each_layout
def test_we_read_pyuffs_frfs(tmp_path, binary, spacing):
    """pyuff declares half the bytes of a complex binary set; the number of samples is right."""
    value, f = RNG.standard_normal(64) + 1j * RNG.standard_normal(64), 5 + 0.5 * np.arange(64)
    changes = OF_FRF | {"binary": binary, "abscissa_spacing": spacing, "ref_node": 1, "ref_dir": 3}
    by_pyuff(tmp_path / "a.uff", x=f, data=value, **changes)
    got = read_uff(tmp_path / "a.uff")
    np.testing.assert_allclose(got.functions, [value], rtol=0 if binary else 1e-10)
    np.testing.assert_array_equal(got.frequency, f)
    assert (got.reference, got.quantity) == ("1:+Z", "acceleration/force")


def test_we_read_pyuffs_frfs_to_several_references(tmp_path):
    """A hammer that roves over four points, two accelerometers: written point by point."""
    f, value = 5 + 0.5 * np.arange(64), RNG.standard_normal((2, 4, 64)) + 1j * RNG.standard_normal((2, 4, 64))
    for (j, reference), (i, response) in product(enumerate((4, 3, 9, 1)), enumerate((2, 7))):
        place = {"rsp_node": response, "ref_node": reference, "ref_dir": -2}
        by_pyuff(tmp_path / "a.uff", x=f, data=value[i, j], **OF_FRF, **place)
    got = read_uff(tmp_path / "a.uff")
    assert (got.responses, got.references) == (("2:+Z", "7:+Z"), ("4:-Y", "3:-Y", "9:-Y", "1:-Y"))
    np.testing.assert_array_equal(got.value, value)
