"""Every output of every command says which versions and which inputs it comes from; what is stale is said."""

import hashlib
import io
import json
import zipfile

import pytest

from clearance_mj.clearance import ConstantLaw
from clearance_mj.cli import main
from clearance_mj.core.provenance import BESIDE, MANIFEST, WORK, made_from, stale
from clearance_mj.io import formats
from clearance_mj.io.dataset import write_dataset
from clearance_mj.live.export import exported
from clearance_mj.live.session import Session
from clearance_mj.model import Model

from ..fuzz import samples
from ..fuzz.mutations import toml
from ..identify.test_diagnosis import RIG

QUICK = {
    "place": "place rig.toml --sensors 4 --candidates 6 --modes 1,2 --out out",
    "compare": "compare frf.uff frf.csv --modes 0 --out out",
    "simulate": "simulate rig.toml --engine modal --duration 0.05 --fs 1024 --out out/r.nc",
    "nominal": "identify bench --method nominal --no-figures --out out/found",
    "convert": "convert record.uff out/a.csv",
    "records": "convert record.uff out --rig rig.toml",
}
LONGER = {
    "animate": "animate rig.toml --engine modal --duration 0.1 --fs 1024 --seconds 0.02 --slow 9 --out out/a.gif",
    "energy": "simulate rig.toml --engine modal --duration 0.05 --fs 1024 --out out/r.nc --energy out",
    "motion": "motion rig.toml --engine modal --duration 0.1 --fs 1024 --levels 1 --sine 50 --out out",
    "modes": "modes modal.uff --modes 2 --out out",
    "calibrate": "calibrate rig.toml frequencies.csv --free beam.length=0.9:1.1 --starts 1 --out out",
    "update-rig": "update-rig bench --out out", "law": "identify bench --method constant --out out/found",
    "bench": "identify bench --out out", "sweep": "sweep plan.toml --workers 1 --out out",
    "response": "response rig.toml --level 1 --from 8 --to 9 --harmonics 1 --modes 2 --out out",
    "backbone": "backbone rig.toml --harmonics 1 --modes 2 --from 1e-5 --to 2e-5 --out out",
    "rattle-map": "rattle-map rig.toml --levels 1 --from 8 --to 9 --steps 2 --harmonics 1 --modes 2 --out out",
    "twin": "twin bench/ramp.uff --rig bench/rig.toml --learn 2 --window 1 --rig-exact --out out",
    "study": "study bench --engines modal --methods nominal --out out",
    "vehicle": "vehicle --controller smc --manoeuvre slalom --speed 60 --plant single-track --out out",
}  # fmt: skip
OF_A_SWEEP = {"plan.json", "results.nc.sha256", "lock"}  # its own keeping


@pytest.fixture
def world(tmp_path, monkeypatch):
    """Folder of inputs, in which commands are run."""
    monkeypatch.chdir(tmp_path)
    for file, data in samples.beside_plan().items():
        (tmp_path / file).write_bytes(data)
    for name, frf in (("frf.uff", samples.frf()), ("frf.csv", samples.frf()), ("modal.uff", samples.modal_frf())):
        formats.write(tmp_path / name, frf)
    (tmp_path / "frequencies.csv").write_bytes(samples.FREQUENCIES[1])
    (tmp_path / "plan.toml").write_bytes(toml(samples.PLAN))
    write_dataset(tmp_path / "bench", *samples.bench())
    return tmp_path


def digest(path):
    return hashlib.sha256(path.read_bytes()).hexdigest()


@pytest.mark.parametrize(
    "name", [*QUICK, *(pytest.param(name, marks=pytest.mark.slow) for name in LONGER)], ids=[*QUICK, *LONGER]
)
def test_every_output_says_what_it_comes_from(name, world):
    """In itself; in the manifest of its folder; or in a file beside it. Nothing else may be there."""
    line = (QUICK | LONGER)[name].split()
    known = {digest(path) for path in world.rglob("*") if path.is_file()}
    assert main([*line, "--quiet"]) == 0
    outputs = [path for path in (world / "out").rglob("*") if path.is_file() and WORK not in path.parts]
    outputs += [path for path in world.glob("*_figures/*.png")]
    assert outputs
    for path in outputs:
        text = path.read_bytes().decode("latin-1")
        of_itself = '"libraries"' in text.replace('\\"', '"') and any(one in text for one in known)
        if name == "vehicle":
            of_itself = '"libraries"' in text  # it reads nothing
        of_itself |= name == "records" and any(one in (world / "out" / "dataset.toml").read_text() for one in known)
        assert of_itself or path.name in OF_A_SWEEP or _beside(path, name), path


def _beside(path, name):
    """Whether another file says it, with the digest of this one."""
    if path.name.endswith(BESIDE):
        return True
    if (sidecar := path.with_name(path.name + BESIDE)).exists():
        made = json.loads(sidecar.read_text())
        return made["sha256"] == digest(path) and made["libraries"] and made["inputs"]
    for folder in path.parents:
        if (folder / MANIFEST).exists():
            manifest = json.loads((folder / MANIFEST).read_text())
            entry = manifest["files"][path.relative_to(folder).as_posix()]
            made = manifest["made"][entry["by"]]
            return entry["sha256"] == digest(path) and made["libraries"] and (made["inputs"] or name == "vehicle")
    made = json.loads((path.parent / "provenance.json").read_text())  # of a sweep
    return made["files"][path.name] == digest(path) and made["inputs"]


def test_what_the_live_page_exports(tmp_path):
    RIG.save(tmp_path / "rig.toml")
    session = Session(Model(RIG, ConstantLaw(2e4, 5.0)))
    session.show(session.setting({"duration": 4.0}))
    with zipfile.ZipFile(io.BytesIO(exported(session.shown, None, [tmp_path / "rig.toml"]))) as archive:
        made = json.loads(archive.read("provenance.json"))
        files = {name: hashlib.sha256(archive.read(name)).hexdigest() for name in archive.namelist()}
    del files["provenance.json"]
    assert made["files"] == files and {"rig.toml", "law.json", "frf.csv"} <= files.keys()
    assert made["inputs"] == {str(tmp_path / "rig.toml"): digest(tmp_path / "rig.toml")}


def test_a_stale_or_foreign_file_is_noticed(world, capsys):
    """A figure's table that was edited; a rig that was changed after its law was found; another law of that name."""
    for line in (QUICK["place"], QUICK["nominal"], QUICK["convert"]):
        assert main([*line.split(), "--quiet"]) == 0
    table, law = world / "out" / "placement.csv", world / "out" / "found" / "law.json"
    assert stale([table, law, world / "out" / "a.csv"]) == []
    table.write_text("x\n1\n")
    with (world / "out" / "a.csv").open("a") as file:
        file.write("\n")
    (world / "bench" / "rig.toml").write_text((world / "rig.toml").read_text())
    (world / "rig.toml").write_text("# another\n" + (world / "rig.toml").read_text())
    assert stale([table]) == [
        f"{table} was changed after clearance-mj place wrote it",
        f"{table} was made from another {world / 'rig.toml'} than is there now",
    ]
    converted = world / "out" / "a.csv"
    assert stale([converted]) == [f"{converted} was changed after clearance-mj convert wrote it"]
    capsys.readouterr()
    simulate = "simulate bench --law out/found/law.json --engine modal --duration 0.05 --quiet --out s.nc"
    assert main(simulate.split()) == 0
    said, rig = capsys.readouterr().err.splitlines(), world / "bench" / "rig.toml"
    assert said[0] == f"clearance-mj: note: out/found/law.json was made from another {rig} than is there now"


def test_a_dataset_to_which_a_record_was_added_is_no_other(tmp_path):
    """What was made from its records still is; a list that was edited otherwise is another one."""
    folder, law = tmp_path / "data", tmp_path / "law.json"
    folder.mkdir()
    (folder / "ramp.uff").write_bytes(b"a record")
    listed = '[[records]]\nfile = "ramp.uff"\n'
    (folder / "dataset.toml").write_text(listed)
    law.write_text(json.dumps({"provenance": made_from([folder], "identify")}))
    (folder / "dataset.toml").write_text(listed + '[[records]]\nfile = "level_5.uff"\n')
    assert stale([law]) == []
    for other in (listed.replace("ramp", "other"), listed + "fs = 1024\n"):
        (folder / "dataset.toml").write_text(other)
        assert stale([law]) == [f"{law} was made from another {folder / 'dataset.toml'} than is there now"]


@pytest.mark.parametrize("text", ["", "[]", "{", '{"provenance": 3}', '{"provenance": {"inputs": [1]}}', "[" * 10**5])
def test_records_of_nothing(tmp_path, text):
    (tmp_path / "law.json").write_text(text)
    (tmp_path / WORK).mkdir()
    assert stale([tmp_path / "law.json"]) == []
    (tmp_path / MANIFEST).write_text(text)
    assert stale([tmp_path / "law.json"]) == []
