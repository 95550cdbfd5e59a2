"""Sensor placement against brute force, designs known in closed form, and identities of the Fisher information."""

import csv
import json
from itertools import combinations, product

import numpy as np
import pytest

from clearance_mj.beam import mode_shapes
from clearance_mj.cli import main
from clearance_mj.core.errors import ClearanceError
from clearance_mj.placement import Candidates, candidates, evaluate, grid, place_sensors

from ..conftest import ROOT
from ..structures import chain, stepped, two_shafts

RIG = str(ROOT / "models" / "table1_rig.toml")
HEURISTICS = ("backward", "forward", "exchange")


def white(shapes, position=None):
    shapes = np.asarray(shapes, dtype=float)
    return Candidates(np.arange(len(shapes)) if position is None else position, shapes, np.eye(len(shapes)))


def random_places(seed, n=12, modes=3, correlated=False):
    rng = np.random.default_rng(seed)
    disturbance = rng.standard_normal((n, 2)) if correlated else np.zeros((n, 2))
    shapes, covariance = rng.standard_normal((n, modes)), np.diag(rng.uniform(0.5, 2, n))
    return Candidates(np.arange(n), shapes, covariance + disturbance @ disturbance.T)


def by_brute_force(places, n, criterion=np.linalg.det):
    """The best value and layout, one layout at a time."""

    def value(chosen):
        rows = places.shapes[list(chosen)]
        return criterion(rows.T @ np.linalg.inv(places.noise[np.ix_(chosen, chosen)]) @ rows)

    best = max(combinations(range(len(places.position)), n), key=value)
    return value(best), best


def test_eight_of_24_sensors_on_the_rig(rig):
    """All 735471 layouts, with determinants by the theorem of Cauchy and Binet: sums of squared 4 × 4 minors."""
    places = candidates(rig, grid(rig, 24))
    quadruples = np.array(list(combinations(range(24), 4)))
    number = np.zeros((24,) * 4, dtype=np.int32)
    number[tuple(quadruples.T)] = np.arange(len(quadruples))
    minors = np.linalg.det(places.shapes[quadruples]) ** 2
    layouts = np.fromiter((i for c in combinations(range(24), 8) for i in c), dtype=np.int8).reshape(-1, 8)
    determinant = sum(minors[number[tuple(layouts[:, c].T)]] for c in combinations(range(8), 4))
    best = determinant.max()
    determinants = {m: place_sensors(places, 8, method=m).determinant for m in HEURISTICS}
    assert determinants["exchange"] >= 0.99 * best
    assert max(determinants.values()) <= best * (1 + 1e-9)
    assert determinants["exchange"] >= max(determinants["backward"], determinants["forward"])


@pytest.mark.parametrize("correlated", [False, True])
@pytest.mark.parametrize("seed", range(5))
def test_exhaustive_is_brute_force_and_exchange_comes_close(seed, correlated):
    places = random_places(seed, correlated=correlated)
    best, chosen = by_brute_force(places, 5)
    exhaustive = place_sensors(places, 5, method="exhaustive")
    assert set(exhaustive.chosen) == set(chosen)
    assert exhaustive.determinant == pytest.approx(best, rel=1e-9)
    assert place_sensors(places, 5).determinant >= 0.99 * best


@pytest.mark.parametrize("method", [*HEURISTICS, "exhaustive"])
def test_trace_is_exact_without_correlation(method):
    """The trace is a sum over sensors: every method finds its largest."""
    places = random_places(7)
    best, chosen = by_brute_force(places, 5, np.trace)
    placement = place_sensors(places, 5, "trace", method)
    assert (placement.chosen, placement.trace) == (chosen, pytest.approx(best))


def test_orthogonal_rows():
    """Rows s_i e_i: each sensor sees one coordinate. The best of each are chosen; each loss loses its coordinate."""
    rows = np.vstack((np.diag([3.0, 2.0, 1.0]), np.diag([1.0, 1.5, 4.0])))
    placement = place_sensors(white(rows), 3)
    assert set(placement.chosen) == {0, 1, 5}
    assert placement.determinant == pytest.approx((3 * 2 * 4) ** 2)
    np.testing.assert_allclose(placement.contribution, 1)
    np.testing.assert_allclose(placement.std, [1 / 3, 1 / 2, 1 / 4])
    assert np.isinf(placement.std_after_loss).all()
    assert (placement.worst_mac, placement.trace) == (pytest.approx(0, abs=1e-12), pytest.approx(29))


def test_hadamard_bound():
    """Four of the rows (1, ±1, ±1, ±1): no determinant exceeds 4⁴ (Hadamard), reached by a half fraction 2³⁻¹."""
    rows = [(1, *signs) for signs in product((-1, 1), repeat=3)]
    placement = place_sensors(white(rows), 4)
    assert placement.determinant == pytest.approx(256)
    assert placement.condition == pytest.approx(1)


def test_cubic_polynomial_wants_gauss_lobatto_points():
    """Four readings tell a cubic best at ±1 and ±1/√5 (Guest, Annals of Mathematical Statistics 29, 1958)."""
    x = np.linspace(-1, 1, 401)
    placement = place_sensors(white(np.vander(x, 4), x), 4)
    np.testing.assert_allclose(placement.position, [-1, -(5**-0.5), 5**-0.5, 1], atol=0.005)


def test_backward_is_effective_independence():
    """Kammer's own recipe: delete the least diagonal element of Φ (ΦᵀΦ)⁻¹ Φᵀ."""
    places = white(np.random.default_rng(3).standard_normal((20, 4)))
    left = list(range(20))
    while len(left) > 6:
        rows = places.shapes[left]
        del left[int(np.argmin(np.diag(rows @ np.linalg.inv(rows.T @ rows) @ rows.T)))]
    placement = place_sensors(places, 6, method="backward")
    assert list(placement.chosen) == left
    rows = places.shapes[left]
    np.testing.assert_allclose(placement.contribution, np.diag(rows @ np.linalg.inv(rows.T @ rows) @ rows.T))
    assert placement.contribution.sum() == pytest.approx(4)


@pytest.mark.parametrize("correlated", [False, True])
def test_loss_of_a_sensor_is_the_layout_without_it(correlated):
    places = random_places(11, correlated=correlated)
    whole = evaluate(places, range(6))
    for i in range(6):
        without = evaluate(places, [j for j in range(6) if j != i])
        assert whole.determinant_after_loss[i] == pytest.approx(without.determinant / whole.determinant)
        np.testing.assert_allclose(whole.std_after_loss[i], without.std)


def test_deviations_are_those_of_an_estimate():
    """Weighted least squares of 20000 noisy readings scatters as the layout says (standard error of each 0.5 %)."""
    places, rng = random_places(5, correlated=True), np.random.default_rng(0)
    evaluation = evaluate(places, range(6))
    noise = places.noise[:6, :6]
    readings = np.linalg.cholesky(noise) @ rng.standard_normal((6, 20000))
    weighted = np.linalg.solve(noise, places.shapes[:6])
    estimates = np.linalg.solve(weighted.T @ places.shapes[:6], weighted.T @ readings)
    np.testing.assert_allclose(estimates.std(axis=1), evaluation.std, rtol=0.02)


def test_candidates_of_the_rig(rig):
    x = grid(rig, 30)
    assert x.size == 30
    assert x[-1] == pytest.approx(rig.beam.length)
    assert not any(b.ends[0] < p < b.ends[1] for p in x for b in rig.bushings)
    plain = candidates(rig, x, (1, 3), weight=(2.0, 3.0), noise=0.1)
    np.testing.assert_allclose(plain.shapes, mode_shapes(rig, x, 3)[:, [0, 2]] * [2, 3], rtol=1e-6)
    np.testing.assert_allclose(plain.noise, 0.01 * np.eye(30))
    disturbed = candidates(rig, x, (1,), noise=np.full(30, 0.2), unwanted=(4,))
    fourth = mode_shapes(rig, x, 4)[:, 3]
    np.testing.assert_allclose(disturbed.noise, 0.04 * np.eye(30) + np.outer(fourth, fourth), rtol=1e-6, atol=1e-9)


def test_candidates_of_other_structures():
    """Pinned ends carry no sensor, free ones may; several shafts share the candidates by their lengths, 0.9 : 0.7."""
    x = grid(stepped(), 24)
    assert x.size == 24 and 0 < x[0] and x[-1] < 1.1
    points = grid(two_shafts(), 16).tolist()
    assert [sum(p.startswith(name) for p in points) for name in ("inner", "outer")] == [9, 7]
    assert points[0] != "inner@0" and "outer@0.25" in points and "outer@0.95" in points
    placement = place_sensors(candidates(two_shafts(), points), 6)
    assert set(placement.position) <= set(points)
    named = candidates(chain(), ["1:+Z", "2:-Z", "3:+Z"], (1, 2))
    assert evaluate(named, [0, 1]).labels == ["1:+Z", "2:-Z"]
    with pytest.raises(ClearanceError, match="no shaft to spread candidates over"):
        grid(chain(), 5)
    with pytest.raises(ClearanceError, match=r'a candidate must lie on the structure: .*"9:'):
        candidates(chain(), ["1:+Z", "9:+Z"], (1, 2))
    with pytest.raises(ClearanceError, match="rig 'chain' has 3 modes, so there is no mode 4"):
        candidates(chain(), ["1:+Z", "2:+Z"])


def test_weights_do_not_move_the_determinant(rig):
    x = grid(rig, 16)
    assert len({place_sensors(candidates(rig, x, weight=w), 6).chosen for w in (1.0, (5.0, 1.0, 0.2, 3.0))}) == 1


def test_noisy_places_are_avoided(rig):
    x = grid(rig, 24)
    quiet = place_sensors(candidates(rig, x), 6)
    noise = np.where(np.isin(np.arange(24), quiet.chosen), 20.0, 1.0)
    assert not set(place_sensors(candidates(rig, x, noise=noise), 6).chosen) & set(quiet.chosen)


@pytest.mark.parametrize("method", [*HEURISTICS, "exhaustive"])
def test_required_positions_keep_their_sensors(method):
    places = random_places(2)
    assert {3, 8} <= set(place_sensors(places, 5, method=method, required=(8, 3)).chosen)


@pytest.mark.parametrize(
    ("n", "options", "message"),
    [
        (2, {}, "2 sensors cannot tell 3 modes"),
        (13, {}, "13 sensors need as many candidates; there are 12"),
        (5, {"criterion": "beauty"}, 'criterion "beauty" is unknown; use determinant, trace'),
        (5, {"method": "luck"}, 'method "luck" is unknown; use backward, forward, exchange, exhaustive'),
        (5, {"required": (99,)}, "required candidates"),
        (3, {"required": (1, 2, 3, 4)}, "required candidates"),
    ],
)
def test_impossible_requests(n, options, message):
    with pytest.raises(ClearanceError, match=message):
        place_sensors(random_places(0), n, **options)


def test_layouts_that_are_too_many_or_do_not_tell_every_mode():
    with pytest.raises(ClearanceError, match="too many to try"):
        place_sensors(random_places(0, n=60), 20, method="exhaustive")
    with pytest.raises(ClearanceError, match="do not tell 2 modes apart"):
        place_sensors(white([[9, 0], [8, 0], [7, 0], [1, 1]]), 2, "trace")


@pytest.mark.parametrize(
    ("position", "options", "message"),
    [
        ([0.5, 0.5], {}, "must differ"),
        ([0.0, 0.5], {}, "lie on the shaft"),
        ([0.5, 1.2], {}, "lie on the shaft"),
        ([0.5, 0.6], {"modes": (0, 1)}, "modes count from 1"),
        ([0.5, 0.6], {"modes": (1, 1)}, "each once"),
        ([0.5, 0.6], {"modes": (1,), "unwanted": (1,)}, "wanted or unwanted"),
        ([0.5, 0.6], {"weight": (1, 2, 3)}, "weights: give one number > 0 or 4"),
        ([0.5, 0.6], {"noise": 0.0}, "noise: give one number > 0 or 2"),
    ],
)
def test_impossible_candidates(rig, position, options, message):
    with pytest.raises(ClearanceError, match=message):
        candidates(rig, position, **options)


def test_noise_must_be_a_covariance():
    with pytest.raises(ClearanceError, match="positive definite"):
        Candidates(np.arange(2), np.eye(2), np.array([[1.0, 2.0], [2.0, 1.0]]))


def test_command_writes_table_numbers_and_figure(tmp_path, capsys):
    noise = tmp_path / "noise.csv"
    noise.write_text("position_m,std\n0,1\n1,2\n")
    arguments = ["place", RIG, "--sensors", "6", "--candidates", "20", "--at", "0.5484", "--noise", str(noise)]
    assert main([*arguments, "--out", str(tmp_path / "out"), "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert 0.5484 in result["position_m"]
    with (tmp_path / "out" / "placement.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [float(row["position_m"]) for row in rows] == result["position_m"]
    assert json.loads((tmp_path / "out" / "placement.json").read_text())["determinant"] == result["determinant"]
    assert (tmp_path / "out" / "placement.png").read_bytes()[:4] == b"\x89PNG"


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--sensors", "3"], "3 sensors cannot tell 4 modes"),
        (["--sensors", "9", "--candidates", "8"], "9 sensors need as many candidates; there are 8"),
        (["--candidates", "0"], "at least 1 candidate"),
        (["--at", "1.5"], "lie on the shaft"),
        (["--out", RIG], "is a file; give a folder"),
        (["--noise", "loud"], "neither a number nor a file"),
        (["--noise", RIG], "must be CSV with columns position_m and std"),
    ],
)
def test_command_refuses_bad_input(tmp_path, capsys, options, message):
    assert main(["place", RIG, "--out", str(tmp_path / "out"), *options]) == 2
    captured = capsys.readouterr()
    assert captured.err.count("\n") == 1
    assert message in captured.err
    assert not (tmp_path / "out").exists()
