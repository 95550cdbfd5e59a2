"""Identification on structures that are no cantilevers. Truth: the laws of synthetic records, made by a
Runge-Kutta march written here (the chain of masses) or by the modal engine."""

import dataclasses

import numpy as np
import pytest

from clearance_mj.clearance import ConstantLaw
from clearance_mj.core.errors import RecordError
from clearance_mj.core.jit import jit
from clearance_mj.engines import Modal, simulate
from clearance_mj.identify.forces.restoring import restoring_force
from clearance_mj.identify.methods.amplitude import amplitude_law
from clearance_mj.identify.methods.constant import fit_constant
from clearance_mj.identify.methods.force_balance import force_balance_law
from clearance_mj.identify.methods.physical import fit_output_error
from clearance_mj.identify.methods.ridge import ridge_law
from clearance_mj.identify.records.lowest_mode import ridge_band
from clearance_mj.identify.registry import get_method
from clearance_mj.io.dataset import Dataset
from clearance_mj.rig import Grease, Rig, Sensor
from clearance_mj.signals.excitation import hammer, level_ramp, random
from clearance_mj.signals.response import Response
from clearance_mj.signals.sampling import interpolate
from clearance_mj.structure import Matrices

from ..structures import DAMPING, MASS, STIFFNESS, chain, stepped, two_shafts
from .records import FS, noisy, record_of

GREASE = Grease(2500.0, 6.0)
LAW = ConstantLaw([6000.0, 9000.0], [10.0, 6.0], grease=GREASE)
WITHIN_BAND = random(10.0, FS, rms=6.0, seed=5, band=(4.0, 60.0))
FINER = 8
JOINED = np.array([[-1.0, 1.0, 0.0], [0.0, 0.0, 1.0]])  # of the chain: mass 2 against mass 1, mass 3 against the base


@jit
def _rates(state, a, m, c, k, gaps, law):
    """Velocities and accelerations of the three masses relative to the base."""
    rates, force = np.empty(6), np.zeros(3)
    for j, (i, other) in enumerate(((1, 0), (2, -1))):  # mass 2 against mass 1, mass 3 against the base
        u, w = state[i], state[3 + i]
        if other >= 0:
            u, w = u - state[other], w - state[3 + other]
        f, depth = law[j, 2] * u + law[j, 3] * w, abs(u) - gaps[j]
        if depth > 0.0:
            f += max(law[j, 0] * depth + law[j, 1] * w * np.sign(u), 0.0) * np.sign(u)
        force[i] += f
        if other >= 0:
            force[other] -= f
    for i in range(3):
        for j in range(3):
            force[i] += c[i, j] * state[3 + j] + k[i, j] * state[j]
        rates[i], rates[3 + i] = state[3 + i], -force[i] / m[i] - a
    return rates


@jit
def _march(base, h, m, c, k, gaps, law):
    """Runge-Kutta steps of 2 h over base accelerations a half step apart; states (n, 6), accelerations (n, 3)."""
    n = base.size // 2
    state, states, accelerations = np.zeros(6), np.empty((n, 6)), np.empty((n, 3))
    for i in range(n):
        last = base[min(2 * i + 2, base.size - 1)]
        a1 = _rates(state, base[2 * i], m, c, k, gaps, law)
        states[i], accelerations[i] = state, a1[3:] + base[2 * i]
        a2 = _rates(state + h * a1, base[2 * i + 1], m, c, k, gaps, law)
        a3 = _rates(state + h * a2, base[2 * i + 1], m, c, k, gaps, law)
        a4 = _rates(state + 2 * h * a3, last, m, c, k, gaps, law)
        state = state + h / 3 * (a1 + 2 * a2 + 2 * a3 + a4)
    return states, accelerations


def marched(rig: Rig, excitation, law) -> Response:
    """The chain under a shaken base, every 8th step; its accelerations have hardly anything beyond half the rate."""
    laws = np.array([(k, c, GREASE.stiffness, GREASE.damping) for k, c in zip(law.k, law.c)])
    gaps = np.array([b.gap for b in rig.bushings])
    base = interpolate(excitation.value, 2 * FINER)
    h = 1 / (2 * FINER * excitation.fs)
    states, accelerations = _march(base, h, MASS.diagonal().copy(), DAMPING, STIFFNESS, gaps, laws)
    displacement = JOINED @ states[::FINER, :3].T
    return Response(
        FS, excitation.value, accelerations[::FINER].T, displacement, band=excitation.band,
        responses=tuple(rig.sensor_labels),
    )  # fmt: skip


@pytest.fixture(scope="module")
def of_chain():
    rig = chain()
    return noisy(rig, marched(rig, WITHIN_BAND, LAW))


@pytest.fixture(scope="module")
def of_stepped():
    return record_of(stepped(), random(8.0, FS, rms=5.0, seed=5), LAW, Modal(modes=10))


def test_restoring_forces_of_a_stepped_shaft(of_stepped):
    """Against those that were simulated with fewer modes: 3 % of their RMS, as for the cantilever."""
    record, response = of_stepped
    force = restoring_force(record)
    truth = (response.contact_force + response.grease_force)[:, force.valid]
    assert np.all((force.force[:, force.valid] - truth).std(axis=1) < 0.03 * truth.std(axis=1))


def test_clearances_that_no_record_tells_apart():
    """Two of them between the same two points."""
    record, _ = record_of(chain(bushings=2 * chain().bushings[1:]), random(2.0, FS, rms=1.0, seed=5), LAW, Modal())
    with pytest.raises(RecordError, match="do not tell the forces in the clearances from each other"):
        restoring_force(record)


@pytest.mark.parametrize("which", ["stepped", pytest.param("chain", marks=pytest.mark.slow)])
def test_force_balance_and_amplitude(which, request, measured):
    record = request.getfixturevalue(f"of_{which}")
    record = record[0] if isinstance(record, tuple) else record
    dataset = Dataset(record.rig, (record,))
    law = force_balance_law(dataset)
    source = f"synthetic record of the {which}, 1 % noise"
    over_amplitude, _ = amplitude_law(dataset)
    for j in range(2):
        measured.equal(f"force balance, {which}[{j}]: k (N/m)", law.k[j], LAW.k[j], source, rel=0.03)
        measured.equal(f"force balance, {which}[{j}]: c (N s/m)", law.c[j], LAW.c[j], source, rel=0.08)
        measured.equal(f"force balance, {which}[{j}]: grease k", law.grease[j].stiffness, 2500.0, source, rel=0.03)
        measured.equal(f"force balance, {which}[{j}]: grease c", law.grease[j].damping, 6.0, source, rel=0.03)
        most = np.interp(3 * record.rig.bushings[j].gap, over_amplitude.amplitude, over_amplitude.k[:, j])
        measured.equal(f"amplitude, {which}[{j}]: k at three gaps (N/m)", most, LAW.k[j], source, rel=0.05)


@pytest.mark.slow
def test_best_constants_of_the_chain(measured):
    record = noisy(chain(), marched(chain(), WITHIN_BAND, ConstantLaw([8e3] * 2, [10.0] * 2)))
    fit = fit_constant(Dataset(record.rig, (record,)))
    limits = (8e3, 0.02), (10.0, 0.1), (2500.0, 0.01), (6.0, 0.05)
    for name, value, (known, limit) in zip("kckc", fit.estimates.value, limits):
        measured.equal(f"constants by output error, chain: {name}", value, known, "Runge-Kutta march", rel=limit)
    assert fit.residual_db < 0.3


@pytest.mark.slow
@pytest.mark.parametrize("make", [stepped, two_shafts])
def test_best_constants_of_shafts(make):
    """Of records with other modes than those that the fit has."""
    excitation, law = random(10.0, FS, rms=6.0, seed=5), ConstantLaw(6e3, 10.0, grease=GREASE)
    record, _ = record_of(make(), excitation, law, Modal(modes=10))
    fit = fit_constant(Dataset(record.rig, (record,)))
    np.testing.assert_allclose(fit.estimates.value, (6e3, 10.0, 2500.0, 6.0), rtol=0.05)


@pytest.mark.slow
@pytest.mark.parametrize("make, band", [(stepped, (5.0, 220.0)), (chain, (4.0, 60.0))])
def test_output_error(make, band):
    """The physical law meets the constants that the record was made with: force at one gap, exponent 1."""
    law = ConstantLaw(6e3, 10.0, grease=GREASE)
    record, _ = record_of(make(), level_ramp(20.0, FS, start_rms=0.5, end_rms=8.0, seed=5, band=band), law)
    fit = fit_output_error(Dataset(record.rig, (record,)))
    values = dict(zip((p["name"] for p in fit.parameters), fit.estimates.value))
    for j in range(2):
        assert values[f"contact force at one gap, bushings[{j}]"] == pytest.approx(6e3 * 3e-4, rel=0.06)
        assert values[f"contact exponent, bushings[{j}]"] == pytest.approx(1.0, abs=0.05)
        assert values[f"grease stiffness, bushings[{j}]"] == pytest.approx(2500.0, rel=0.05)


@pytest.mark.parametrize("make", [stepped, chain])
def test_ridge_in_a_free_decay(make):
    """While the motion fills the gap twice: k = 6000 N/m within 3 %."""
    rig = make()
    rig = rig.replace(bushings=tuple(dataclasses.replace(b, grease=Grease(3000.0, 0.3)) for b in rig.bushings))
    hit = hammer(4.0, FS, peak=100.0, width=0.04, times=[0.1])
    law = ridge_law(Dataset(rig, (record_of(rig, hit, ConstantLaw(6e3, 2.0), noise=0.001)[0],)))
    np.testing.assert_allclose(np.median(law.k[(law.t > 0.4) & (law.t < 0.8)], axis=0), 6e3, rtol=0.03)


def test_ridge_band_of_structures_with_few_modes_or_none_below():
    """A single mass has no second mode; motion without a restoring force is no mode: sqrt(2 k/m) of two free masses."""
    single = Matrices("m-kg-s", mass=[[1.0]], stiffness=[[400.0]], dofs=("1:Z",))
    rig = Rig("one", None, (), (Sensor(1, "1:+Z"),), structure=single)
    np.testing.assert_allclose(ridge_band(rig), np.array([10.0, 40.0]) / (2 * np.pi))
    free = Matrices("m-kg-s", mass=np.eye(2), stiffness=[[200.0, -200.0], [-200.0, 200.0]], dofs=("1:Z", "2:Z"))
    rig = Rig("free", None, (), (Sensor(1, "1:+Z"),), structure=free)
    np.testing.assert_allclose(ridge_band(rig), np.array([10.0, 40.0]) / (2 * np.pi))


def test_a_rig_without_clearances_has_nothing_to_identify():
    rig = chain(bushings=())
    dataset = Dataset(rig, (noisy(rig, simulate(rig, random(1.0, FS, seed=1), ConstantLaw(0.0, 0.0), "modal")),))
    for method in ("constant", "output-error", "force-balance", "ridge"):
        with pytest.raises(RecordError, match="'chain' has no bushings, so there is no clearance to identify"):
            get_method(method).find(dataset, None)
