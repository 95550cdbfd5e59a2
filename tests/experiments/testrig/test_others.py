"""The rigs that the identification was not developed on, end to end."""

import numpy as np
import pytest

from clearance_mj import Dataset, csac, csf, estimate_frf, frac, identify, rmse_db, simulate
from experiments.testrig import generate


@pytest.mark.slow
def test_output_error_on_a_rig_with_two_kinds_of_grease(tmp_path):
    """What docs/other_rigs.md says of the rig "mixed" on the modal engine; its grease is neither of the law's kind."""
    generate(tmp_path / "mixed", "mixed")
    dataset = Dataset.load(tmp_path / "mixed")
    law = identify.law(dataset)
    assert not any(record.opened for record in dataset.validate)
    tests = {r.name: estimate_frf(r.response()).value for r in dataset.validate}
    for record in dataset.validate:
        model = estimate_frf(simulate(dataset.rig, record.excitation(), law, "modal")).value
        test, repeat = tests[record.name], tests[record.name[:-1] + {"a": "b", "b": "a"}[record.name[-1]]]
        assert np.mean(rmse_db(test, model)) < 2 / 3 * np.mean(rmse_db(test, repeat))
        assert min(frac(test, model).mean(), csac(test, model).mean(), csf(test, model).mean()) > 0.99
