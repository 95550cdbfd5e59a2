"""Laws: the tables that engines interpolate, every refusal, and files."""

import json

import jsonschema
import numba
import numpy as np
import pytest

from clearance_mj import clearance as models
from clearance_mj.clearance.kernel import follow_law
from clearance_mj.clearance.law_files import law_from_dict, law_schema
from clearance_mj.clearance.record import clearance_records
from clearance_mj.core.errors import LawError
from clearance_mj.core.jit import jit
from clearance_mj.rig import Bushing, Contact, Grease

from ..conftest import TABLE1

SLIP = models.MaxwellSlip((3e3, 1e3), (0.2, 0.1), elastic=500.0, damping=2.0, film_height=8e-4)
FILM = Grease(5e3, 2.0, 0.8, 1.1, 1.5e7, 5e6, 1.5, 8e-4, 0.1)


def rig_with(n):
    return TABLE1.replace(bushings=tuple(Bushing(0.2 * j + 0.1, 3e-4, 0.01, FILM, Contact(1.0)) for j in range(n)))


def values(law, n, at):
    """Parameters of n contacts where time, or the envelope of the motion, has the value ``at``, as loops read them."""
    bushings, numbers = clearance_records(rig_with(n), law, 1e-3)
    numbers[bushings["place"]] = at
    _follow(bushings, numbers, at)
    return np.transpose([numbers[b["contact"] :][: b["width"]] for b in bushings])


@jit
def _follow(bushings, numbers, at):
    for j in range(bushings.size):
        follow_law(bushings[j], numbers, at, (0,))


def test_constant():
    law = models.ConstantLaw([1e4, 2e4], [1.0, 3.0])
    for at in (-1.0, 0.0, 7.0):
        np.testing.assert_array_equal(values(law, 2, at), [[1e4, 2e4], [1.0, 3.0]])
    assert not law.table(2).by_amplitude and not np.any(law.table(2).adhesion)


def test_one_value_serves_all_bushings():
    np.testing.assert_array_equal(values(models.ConstantLaw(1e4, 2.0), 3, 0.0), [[1e4] * 3, [2.0] * 3])
    np.testing.assert_array_equal(values(models.ConstantLaw([1e4, 3e4], 2.0), 2, 0.0), [[1e4, 3e4], [2.0] * 2])
    halfway = values(models.TimeLaw([0, 1], [1e4, 3e4], [1.0, 3.0]), 2, 0.5)
    np.testing.assert_array_equal(halfway, [[2e4, 2e4], [2.0, 2.0]])


@pytest.mark.parametrize("kind", [models.TimeLaw, models.AmplitudeLaw])
def test_interpolation(kind):
    """numpy.interp: linear between the rows, the end rows beyond."""
    rng = np.random.default_rng(4)
    abscissa = np.cumsum(rng.uniform(0.1, 2, 9))
    k, c = rng.uniform(1e3, 1e5, (9, 2)), rng.uniform(0, 9, (9, 2))
    for at in (0.0, *abscissa, *rng.uniform(0, 15, 30)):
        expected = [[np.interp(at, abscissa, v[:, j]) for j in range(2)] for v in (k, c)]
        np.testing.assert_allclose(values(kind(abscissa, k, c), 2, at), expected, rtol=1e-13)


def test_a_schedule_begins_again():
    """numpy.interp with a period: linear from the last row to the first one a period later."""
    rng, period = np.random.default_rng(5), 0.7
    t, k, c = np.array([0.1, 0.15, 0.4, 0.65]), rng.uniform(1e3, 1e5, (4, 2)), rng.uniform(0, 9, (4, 2))
    law = models.TimeLaw(t, k, c, period=period)
    for at in (0.0, *t, 0.7, 0.75, *rng.uniform(0, 20, 40)):
        expected = [[np.interp(at, t, v[:, j], period=period) for j in range(2)] for v in (k, c)]
        np.testing.assert_allclose(values(law, 2, at), expected, rtol=1e-9)
    np.testing.assert_array_equal(law.table(2).parameters[0], law.table(2).parameters[-1])
    assert law.table(2).abscissa.tolist() == [0.0, *t, period]
    assert "again after 0.7 s" in str(law)


def test_amplitude_table():
    table = models.AmplitudeLaw([0.0, 1e-3], [1.0, 2.0], [0.0, 0.0], release=0.05).table(1)
    assert table.by_amplitude
    assert table.release == 0.05
    assert models.AmplitudeLaw([0.0], [1.0], [0.0]).table(1).release == 0.03  # physics.md, section 4


def test_contact_table():
    """Each bushing its own model."""
    pulls, first_order = models.KelvinVoigt(1e4, 2.0, adhesion=True), models.HuntCrossley(1e6, 0.8, first_order=True)
    law = models.ContactLaw((pulls, first_order, models.Flores(2e6, 0.5, 1.4)))
    np.testing.assert_allclose(values(law, 3, 0.0), [[1e4, 1e6, 2e6], [2.0, 1.5, 1.4], [1.0, 0.3, 1.6]], rtol=1e-14)
    np.testing.assert_array_equal(law.table(3).adhesion, [True, False, False])
    assert len(set(law.table(3).contact_law)) == 2  # one address for all Hertz contacts


def test_largest():
    """What time steps must follow: the stiffest row; of a Hertz contact n K dⁿ⁻¹ at one gap of penetration."""
    k, c = models.TimeLaw([0.0, 1.0, 2.0], [[1e4, 5.0], [3e4, 2.0], [2e4, 1.0]], [3.0, 4.0, 1.0]).largest([3e-4, 3e-4])
    np.testing.assert_array_equal([k, c], [[3e4, 5.0], [4.0, 4.0]])
    hertz = models.ContactLaw(models.HuntCrossley(1e6, 0.8))
    np.testing.assert_allclose(hertz.largest([4e-4])[0], 1.5 * 1e6 * 0.02, rtol=1e-14)


@pytest.mark.parametrize(("make", "message"), [
    (lambda: models.ConstantLaw(-1.0, 0.0), "k must be finite and >= 0, got -1"),
    (lambda: models.ConstantLaw([1.0, np.nan], 0.0), "k must be finite and >= 0, got nan"),
    (lambda: models.ConstantLaw(1.0, np.inf), "c must be finite and >= 0, got inf"),
    (lambda: models.ConstantLaw("stiff", 0.0), "k must be numbers, got 'stiff'"),
    (lambda: models.ConstantLaw([[1.0, 2.0]], 0.0), r"one value per bushing, got shape \(1, 2\)"),
    (lambda: models.TimeLaw([0.0, 0.0], [1.0, 1.0], [0.0, 0.0]), "t must be one increasing row"),
    (lambda: models.TimeLaw([1.0, 0.0], [1.0, 1.0], [0.0, 0.0]), "t must be one increasing row"),
    (lambda: models.TimeLaw([0.0, 1.0], [1.0, 1.0, 1.0], [0.0, 0.0]), r"k has shape \(3, 1\), needs \(2, n_bushings\)"),
    (lambda: models.TimeLaw([0.0, 1.0], [1.0, 1.0], [0.0]), r"c has shape \(1, 1\), needs \(2, n_bushings\) to fit t"),
    (lambda: models.TimeLaw([0, 1], [1, 2], [0, 0], period=1.0),
     "period must be a time beyond the last t, 1 s, got 1.0"),
    (lambda: models.TimeLaw([0.0, 1.0], [1.0, 2.0], [0.0, 0.0], period="long"), "period must be a time"),
    (lambda: models.AmplitudeLaw([-1e-4, 1e-4], [1, 1], [0, 0]), "amplitude must be finite and >= 0, got -0.0001"),
    (lambda: models.AmplitudeLaw([1e-3, 1e-4], [1.0, 1.0], [0.0, 0.0]), "amplitude must be one increasing row"),
    (lambda: models.AmplitudeLaw([0.0], [1.0], [0.0], release=0.0), "release must be a time > 0 s, got 0.0"),
    (lambda: models.AmplitudeLaw([0.0], [1.0], [0.0], release=np.nan), "release must be a time > 0 s, got nan"),
    (lambda: models.ContactLaw((models.KelvinVoigt(1.0), 5.0)), r"contact\[1\] must be of ContactModel, got 5.0"),
    (lambda: models.ConstantLaw([1.0, 2.0, 3.0], [1.0, 2.0]), "k and c"),
    (lambda: models.TimeLaw([0.0, 1.0], np.ones((2, 2)), np.ones((2, 3))), "k and c"),
    (lambda: models.ConstantLaw([], []), "k"),
    (lambda: models.TimeLaw([], [], []), "t"),
    (lambda: models.ContactLaw(5.0), "contact"),
    (lambda: models.ContactLaw(()), "contact"),
    (lambda: models.ConstantLaw(1.0, 0.0, grease=5.0), "grease"),
    (lambda: models.ConstantLaw(1.0, 0.0, grease=(Grease(1.0), "thick")), "grease"),
    (lambda: models.AmplitudeLaw([0.0], [1.0], [0.0], release="slow"), "release"),
])  # fmt: skip
def test_refusals(make, message):
    with pytest.raises(LawError, match=message):
        make()


@pytest.mark.parametrize("law", [
    models.ConstantLaw([1.0, 2.0, 3.0], [0.0, 0.0, 0.0]),
    models.TimeLaw([0.0, 1.0], np.ones((2, 3)), np.ones((2, 3))),
    models.AmplitudeLaw([0.0, 1.0], np.ones((2, 3)), np.ones((2, 3))),
    models.ContactLaw((models.KelvinVoigt(1.0),) * 3),
])  # fmt: skip
def test_law_of_another_rig(law):
    with pytest.raises(LawError, match="for 3 bushings, the rig has 2; give one value for all of them or one each"):
        law.table(2)


LAWS = [
    models.ConstantLaw([1e4, 2e4], [1.0, 0.1 + 0.2]),
    models.ConstantLaw(1e4, 1 / 3, grease=FILM),
    models.TimeLaw(
        [0.0, 0.1, 5.0], [[1e4, 2e4], [0.0, 1e5], [3e4, 3e4]], [1.0, 2.0, 3.0], grease=(FILM, Grease(4e3, 1.0))
    ),
    models.TimeLaw([0.0, 0.1], [[1e4, 2e4], [0.0, 1e5]], [1.0, 2.0], period=0.3),
    models.AmplitudeLaw([0.0, 3e-4], [1e4, 2e4], [1.0, 2.0], release=0.017, grease=FILM),
    models.ContactLaw((models.KelvinVoigt(1e4, 2.0, adhesion=True), models.HuntCrossley(1e6, 0.8))),
    models.ContactLaw((models.LankaraniNikravesh(1e6, 0.8), models.Flores(1e6, 0.7, 1.4)), grease=(FILM, FILM)),
    models.ContactLaw((models.HuntCrossley1975(1e6, 8e5, 1.4), models.Cubic(1e4, 1e10, 2.0)), grease=SLIP),
    models.ContactLaw(models.AdamsImpact(1e6, 1.5, 3.0, 1 / 3e4), grease=FILM),
    models.ConstantLaw(1e4, 1.0, grease=(SLIP, FILM)),
]


def test_one_compiled_loop_serves_all_laws():
    """Numba compiles an engine's loop, some seconds, for every type of its arguments."""
    rig = rig_with(2)
    assert len({numba.typeof(clearance_records(rig, law, 1e-3)) for law in LAWS}) == 1


def test_laws_of_the_same_content_are_equal():
    for i, law in enumerate(LAWS):
        assert law == law_from_dict(law.to_dict()) and hash(law) == hash(law_from_dict(law.to_dict()))
        assert [law == other for other in LAWS] == [i == j for j in range(len(LAWS))]
    one, same, other = (models.ConstantLaw(*given) for given in (([1e4], 1.0), (1e4, [1.0]), (1e4, 2.0)))
    assert one == same != other and one != 1.0


@pytest.mark.parametrize("law", LAWS, ids=lambda law: law.kind)
def test_save_and_load(law, tmp_path):
    """A law read back is the law that was saved, to the last bit."""
    path = tmp_path / "law.json"
    law.save(path)
    back = models.load_law(path)
    assert back == law
    for a, b in zip(law.table(2), back.table(2)):
        np.testing.assert_array_equal(a, b)
    back.save(tmp_path / "again.json")
    assert (tmp_path / "again.json").read_bytes() == path.read_bytes()


@pytest.mark.parametrize(("text", "message"), [
    ("", "not a law file"),
    ("[1, 2]", "not a law file"),
    ('{"kind": "magic"}', 'needs "kind" to be one of constant, time, amplitude, contact'),
    ('{"kind": "constant", "k": [1.0]}', "not a whole law file of kind constant"),
    ('{"kind": "constant", "k": [1.0], "c": [-1.0]}', "c must be finite and >= 0"),
    ('{"kind": "constant", "k": [1.0], "c": [1.0], "d": [1.0]}', "not a whole law file of kind constant"),
    ('{"kind": "constant", "k": [1.0], "c": [1.0], "grease": [{"stifness": 1}]}', r"grease\[0\].stifness"),
    ('{"kind": "constant", "k": [1.0], "c": [1.0], "grease": 3}', "not a whole law file of kind constant"),
    ('{"kind": "contact", "contact": [{"model": "glue"}]}', r"contact\[0\].model 'glue' is unknown; use .*flores"),
    ('{"kind": "contact", "contact": {"model": "flores"}}', '"contact" must be a list, of one model or one for each'),
    ('{"kind": "contact", "contact": [7]}', r"contact\[0\] must be a table of keys, got 7"),
    ('{"kind": "constant", "k": [1], "c": [1], "grease": [{"model": "tar"}]}', r"grease\[0\].model 'tar' is unknown"),
    ('{"kind": "constant", "k": [1], "c": 1, "grease": [{"model": "maxwell-slip", "springs": 3, "forces": 1}]}',
     r"grease\[0\].springs must be a list, got 3"),
    ('{"kind": "contact", "contact": [{"model": "flores", "stiffness": "hard", "restitution": 1}]}', "contact"),
    ('{"kind": "time", "t": [0], "k": [[1], [2]], "c": [1]}', "k has shape"),
    ('{"kind": "time", "t": [0, 1], "k": [[1, 2], [2]], "c": [1]}', "k must be numbers"),
    ('{"kind": ["constant"]}', "not a law file"),
])  # fmt: skip
def test_damaged_files(text, message, tmp_path):
    path = tmp_path / "law.json"
    path.write_text(text)
    with pytest.raises(LawError, match=message) as error:
        models.load_law(path)
    assert str(path) in str(error.value)
    with pytest.raises(LawError, match=r"none\.json: cannot be read"):
        models.load_law(tmp_path / "none.json")


def test_a_file_is_plain_json(tmp_path):
    models.TimeLaw([0.0, 1.0], [1e4, 2e4], [1.0, 2.0]).save(tmp_path / "law.json")
    expected = {"kind": "time", "t": [0, 1], "k": [[1e4], [2e4]], "c": [[1], [2]], "grease": None}
    assert json.loads((tmp_path / "law.json").read_text()) == expected


def test_a_law_cannot_be_changed_from_outside():
    """Laws are shared between threads."""
    k = np.array([1e4, 2e4])
    law = models.ConstantLaw(k, 1.0)
    k[0] = 5.0
    assert law.table(2).parameters[0, 0, 0] == 1e4
    with pytest.raises(ValueError, match="read-only"):
        law.k[0] = 5.0


@pytest.mark.parametrize("law", LAWS, ids=lambda law: law.kind)
def test_schema_takes_what_is_saved_and_refuses_what_is_not_read(law):
    validator = jsonschema.Draft202012Validator(law_schema())
    data = json.loads(json.dumps(law.to_dict()))
    validator.validate(data)
    for change in ({"kind": "other"}, {"colour": 1}, {"grease": 3}, {"k": "x"}, {"contact": [{"model": "none"}]}):
        assert not validator.is_valid(data | change), change
        with pytest.raises(LawError):
            law_from_dict(data | change)
