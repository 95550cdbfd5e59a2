"""Studies of a rig in space: FRFs, directional FRFs and orbits whose agreement is known."""

import dataclasses
import warnings

import numpy as np
import pytest

from clearance_mj import FRF, ClearanceError, Dataset, Model, RecordError, linear_model
from clearance_mj.engines.equilibrium import static_equilibrium
from clearance_mj.identify.records.checks import IdentifiabilityWarning
from clearance_mj.report.sections import directions, turning
from clearance_mj.report.writer import ReportWriter
from clearance_mj.rig import Spin
from clearance_mj.signals import Orbits, directional_frfs, orbits_by_turn
from clearance_mj.study import Study
from clearance_mj.study.matrices import matrices_of, matrix_rows
from clearance_mj.study.orbit_measures import compare_orbits, compare_run_ups, onset_of_contact
from clearance_mj.study.turning import TurningComparison
from clearance_mj.study.whirl_in_test import simulated_whirl

from ..conftest import ROOT
from .turning_rig import RIG, turning_dataset, turning_record

SHIPPED = ROOT / "data" / "turning_rig"


@pytest.fixture(scope="module")
def study():
    return Study(turning_dataset(), ("nominal",), workers=1)


def test_repeats_are_paired_by_direction_and_spin(study):
    parts = {part.condition.words: [r.name for r in part.driven] for part in study.parts}
    assert parts == {
        "along y, at 573 rev/min": ["y_a", "y_b"], "along z, at 573 rev/min": ["z_a", "z_b"],
    }  # fmt: skip
    groups = {round(c.spin.speed): [r.name for r in repeats] for c, repeats in TurningComparison(study).speeds.items()}
    assert groups == {60: ["orbit_60_a", "orbit_60_b"], 100: ["orbit_100_a", "orbit_100_b"]}


def test_parts_of_a_study_share_its_laws_and_ask_the_records_for_no_other():
    dataset = turning_dataset()
    study = Study(dataclasses.replace(dataset, records=dataset.validate), ("nominal",))  # "bench" could not be had
    with warnings.catch_warnings(action="error", category=IdentifiabilityWarning):
        parts = study.parts
    assert all(part.studied_laws is study.studied_laws for part in parts) and len(parts) == 2


def test_a_model_under_its_own_records_has_no_error(study):
    rows = [row for row in study.rows() if row["law"] == "nominal"]
    assert [(row["direction"], round(row["spin_rpm"])) for row in rows] == [("y", 573), ("z", 573)]
    assert max(row["rmse_db"] for row in rows) < 0.01  # dB: the keyphasor tells the speed to 1e-5
    assert all(row["rmse_db"] < 0.01 for row in matrix_rows(study) if row["law"] == "nominal")


@pytest.mark.parametrize("angle", [0.0, 0.3])
def test_a_shaft_rests_where_it_does_however_its_probes_are_turned(angle):
    """Offset and sag are along y and z, what probes read is along their own axes."""
    bushing = dataclasses.replace(RIG.bushings[0], offset_y=1e-3, offset=-5e-4, probe_angle=angle)
    rig = RIG.replace(bushings=(bushing,), gravity=(0.0, 0.0, -9.81))
    record = dataclasses.replace(turning_record("orbit", "validate", Spin(60.0), duration=1.0), rig=rig)
    placed = simulated_whirl("nominal", Model(rig), record, "modal", None)
    sag = static_equilibrium(rig.replace(spin=None, unbalances=())).displacement
    (y, z), (cos, sin) = sag + np.array([1e-3, -5e-4]), (np.cos(angle), np.sin(angle))
    assert placed.rest[0] == pytest.approx([cos * y + sin * z, cos * z - sin * y], rel=1e-6) and -sag[1] > 1e-5


def test_frfs_are_those_of_the_modes(study):
    """H = r - ω² φ (K - ω² M + iω (C + Ω G))⁻¹ b, of a shaft that nothing touches."""
    model, (frfs,) = linear_model(RIG, 8), matrices_of(study)
    omega = 2 * np.pi * frfs.test.frequency
    for column, axis in enumerate("yz"):
        of_axis = linear_model(next(r for r in study.driven if r.name == f"{axis}_a").tested_rig, 8)
        viscous = np.diag(model.damping) + 60.0 * model.gyroscopic
        expected_frf = np.array([
            of_axis.sensors_on_base
            - w**2 * of_axis.at_sensors @ np.linalg.solve(
                np.diag(model.omega**2) - w**2 * np.eye(model.size) + 1j * w * viscous, of_axis.input("base")
            )
            for w in omega
        ]).T  # fmt: skip
        difference = frfs.models["nominal"].value[:, column] - expected_frf
        assert np.sqrt(np.mean(np.abs(difference) ** 2)) < 0.03 * np.sqrt(np.mean(np.abs(expected_frf) ** 2))


def gyroscopic_frfs(spin):
    """FRFs of a disc that tilts, with J = 1, Jp = 1.6, k = 9, c = 0.2: along y and z, to moments along y and z."""
    omega = np.linspace(0.1, 8.0, 80)
    a, b = 9 - omega**2 + 0.2j * omega, 1j * omega * spin * 1.6
    value = np.array([[a, -b], [b, a]]) / (a**2 + b**2)
    return FRF(omega / (2 * np.pi), value, None, ("1:+Y", "1:+Z"), ("200:+Y", "200:+Z"), "rotation/moment")


@pytest.mark.parametrize("spin", [0.0, 1.5])
def test_directional_frfs_of_a_gyroscopic_disc(spin):
    """Lee (1991): one line for forward and backward, 1/(k - Jω² + icω + Ω Jp ω), and nothing reverse."""
    frfs = directional_frfs(gyroscopic_frfs(spin))
    omega = 2 * np.pi * frfs.frequency
    np.testing.assert_allclose(frfs.normal[0], 1 / (9 - omega**2 + 0.2j * omega + spin * 1.6 * omega), rtol=1e-12)
    assert np.abs(frfs.reverse).max() < 1e-15


def test_directional_frfs_mind_the_sense_of_sensors():
    frf = gyroscopic_frfs(1.5)
    value = frf.value * np.array([[[1.0]], [[-1.0]]])
    turned = FRF(frf.frequency, value, None, ("1:+Y", "1:-Z"), frf.references, frf.quantity)
    assert directional_frfs(turned) == directional_frfs(frf)


def test_directional_frfs_need_both_directions():
    with pytest.raises(RecordError, match="one reference along y and one along z; there are 200:"):
        directional_frfs(gyroscopic_frfs(0.0).to_reference("200:+Y"))


def circle(radius=1e-5, phase=0.0, middle=0.0, speed=50.0):
    time = np.arange(4096) / 2048
    w = middle + radius * np.exp(1j * (speed * time + phase))
    return orbits_by_turn(w.real, w.imag, 2048.0, speed * time)


CHANGED = [({}, 0.0), ({"radius": 2e-5}, 1.0), ({"phase": np.pi / 2}, np.sqrt(2)), ({"middle": 3e-5}, 0.0)]


@pytest.mark.parametrize(("other", "error"), CHANGED)
def test_errors_of_orbits(other, error):
    differences = compare_orbits(circle(), circle(**other))
    assert differences["error"] == pytest.approx(error, abs=1e-6)
    assert differences["middle_m"] == pytest.approx(other.get("middle", 0.0), abs=1e-9)
    assert differences["forward_test_m"] == pytest.approx(1e-5, rel=1e-6)


def test_orbits_are_those_of_the_model_once_run_out_is_off(study):
    """The records are the model's, but for run-out of a fifth of the orbit and more."""
    rows = TurningComparison(study).orbit_rows()
    model = [row for row in rows if row["law"] == "nominal"]
    assert len(model) == 4 and max(row["error"] for row in model) < 0.02
    assert [row["error"] for row in rows if row["law"] == "repeat"] == [0.0, 0.0]
    raw = TurningComparison(study)
    raw.run_out = None
    assert min(row["error"] for row in raw.orbit_rows() if row["law"] == "nominal") > 0.1


def spiral(largest):
    """A run-up whose radius grows with the square of the speed, to the largest."""
    speed = np.linspace(50.0, 150.0, 60)
    w = largest * (speed[:, None] / 150) ** 2 * np.exp(2j * np.pi * np.arange(32) / 32)
    return Orbits(np.cumsum(2 * np.pi / speed), speed, np.stack((w.real, w.imag), axis=1))


def test_onset_of_contact():
    """A radius of r (Ω/150)² about the middle comes within 2 % of a gap g at Ω = 150 √(0.98 g/r)."""
    onset = onset_of_contact(spiral(2e-4), np.zeros(2), 1e-4)
    assert onset == pytest.approx(150 * np.sqrt(0.98 / 2) * 30 / np.pi, rel=0.02)
    assert np.isnan(onset_of_contact(spiral(0.9e-4), np.zeros(2), 1e-4))


def test_run_ups_against_themselves_and_twice_as_large():
    assert compare_run_ups(spiral(1e-4), spiral(1e-4))["forward_error"] == 0.0
    differences = compare_run_ups(spiral(1e-4), spiral(2e-4))
    assert differences["forward_error"] == pytest.approx(1.0)
    assert differences["backward_error"] == pytest.approx(0.0, abs=1e-12)
    assert differences["peak_test_rpm"] == pytest.approx(150 * 30 / np.pi)


def test_sections_write_figures_and_tables(study, tmp_path):
    writer = ReportWriter(tmp_path)
    body = directions.directions(study, writer) + turning.turning(study, writer)
    writer.page("turning", [])
    assert "Directional FRFs" in body and "Orbits beside orbits" in body
    assert {path.name for path in (tmp_path / "tables").iterdir()} == {"frf_matrices.csv", "orbits.csv", "run_ups.csv"}
    drawn = {path.name for path in (tmp_path / "figures").iterdir()}
    assert {"directional_level_2_573rpm.png", "frf_matrix_1_level_2_573rpm.png", "orbits_bushing_1.png"} <= drawn


def test_methods_that_know_the_plane_alone_are_refused():
    with pytest.raises(ClearanceError, match='method "constant" knows planar rigs'):
        Study(turning_dataset(), ("nominal", "constant"))


def test_the_shipped_rig_has_repeats_of_all_it_validates_on_and_is_synthetic():
    dataset = Dataset.load(SHIPPED)
    study = Study(dataset, ("nominal",))
    assert dataset.is_synthetic and not (SHIPPED / "truth.toml").exists()
    assert [len(part.driven) for part in study.parts] == [2, 2]
    turning = TurningComparison(study)
    assert [len(records) for records in (*turning.speeds.values(), *turning.run_ups.values())] == [2, 2, 2]
    assert sum(path.stat().st_size for path in SHIPPED.iterdir()) < 6e6
