"""Plans of sweeps that cannot be."""

import pytest

from clearance_mj import ClearanceError, ConstantLaw, Grease

from ..conftest import ROOT
from .plans import DESIGN, EXCITATION, GAP, LEVEL, OUTPUTS, loaded, small, text

# What is refused.

VARIED = {
    "unknown part": (GAP.replace("rig.", "rog."), "vary rog.bushings.gap: begin with rig., law. or excitation."),
    "unknown field": (GAP.replace(".gap", ".gab"), "bushings[0].gab is not a known key"),
    "no such entry": (GAP.replace("bushings", "bushings[5]"), "bushings[5].gap leads nowhere"),
    "not a path": (GAP.replace("rig.bushings", "rig.bushings[x]"), "is not a path such as"),
    "text": (GAP.replace("bushings.gap", "name"), "only numbers can vary"),
    "excitation's field": (LEVEL.replace("rms", "peak"), "vary excitation.peak: unknown; random has"),
    "no law": (GAP.replace("rig.bushings.gap", "law.k"), "the plan has no law file"),
    "axis": (LEVEL.replace("rms", "fs"), "cannot vary, the results' axes depend on it"),
    "low above high": (GAP.replace("5e-4", "1e-4"), "needs low < high, got 0.0002 and 0.0001"),
    "log of zero": (LEVEL.replace("low = 0.5", "low = 0"), "a log scale needs low > 0, got 0"),
    "values and range": (GAP + "values = [1e-4]", "give either values, or low and high"),
    "seed between": (LEVEL.replace("rms", "seed"), "takes whole numbers; give them as values"),
    "twice": (GAP + GAP.replace("bushings", "bushings[0]"), "a field varies twice"),
    "impossible rig": (GAP.replace("gap", "position").replace("2e-4", "0.1").replace("5e-4", "0.9"), "overlaps"),
    "unknown key": (GAP + "step = 1", "vary[0].step is not a known key"),
    "nothing": ("", "the plan varies nothing"),
}
TABLES = {
    "power of two": (DESIGN.format(samples=1000).replace("latin-hypercube", "sobol"), "take 512 or 1024"),
    "design": ('[design]\nmethod = "halton"', 'design.method "halton" is unknown'),
    "no count": ('[design]\nmethod = "grid"', "a grid needs values, or low, high and count >= 2"),
    "generator": (EXCITATION.replace("random", "noise"), "excitation.generator 'noise' is unknown"),
    "excitation": (EXCITATION + "level = 3", "excitation.level is unknown"),
    "negative seed": (EXCITATION + "seed = -1", "seed -1: must be a whole number >= 0"),
    "text": (EXCITATION.replace("= 1\n", '= "long"\n'), "excitation: "),
    "too short": (EXCITATION.replace("duration = 1", "duration = 0.1"), "the record lasts 0.0996"),
    "sensor": ("[outputs]\nresolution = 2\nfrf = [99]", "outputs.frf: node 99 is no sensor"),
    "band": ("[outputs]\npeaks = [[50, 20]]", "outputs.peaks: 50 to 20 Hz"),
    "no lines": ("[outputs]\nresolution = 2\npeaks = [[300, 400]]", "no line of the FRFs lies in 300 to 400 Hz"),
}
RECORD = ROOT / "data" / "table1_rig" / "level_1_a.uff"
HEADS = {
    'law = "gone.json"': "gone.json",
    'engine = "spectral"': 'engine "spectral" is unknown',
    'engine = { name = "modal", links = 3 }': "modal.links is not a known key; known: modes, resolution",
    'reference = "gone.uff"': "gone.uff",
    "vary = 3": "vary must be a list of tables",
    "engine = 3": "engine must be a name or a table",
    f'reference = "{RECORD}"': "outputs.band is missing: the reference is a record",
    "rigg = 1": "rigg is not a known key",
}
FOUR = DESIGN.format(samples=4)
PLANS = {name: (text(EXCITATION, FOUR, OUTPUTS, vary), message) for name, (vary, message) in VARIED.items()}
for name, (table, message) in TABLES.items():
    others = (other for other in (EXCITATION, FOUR, OUTPUTS) if other.split()[0] != table.split()[0])
    PLANS[name] = text(table, *others, GAP), message
for head, message in HEADS.items():
    PLANS[head] = text(EXCITATION, FOUR, "" if "vary" in head else GAP, head=head), message


@pytest.mark.parametrize(("content", "message"), PLANS.values(), ids=PLANS)
def test_impossible_plan(content, message, tmp_path, refused):
    plan = tmp_path / "plan.toml"
    plan.write_text(content, encoding="utf-8")
    error = refused("sweep", plan, "--out", tmp_path / "out")
    assert message in error and str(plan) in error and not (tmp_path / "out").exists()


def test_other_refusals(tmp_path, refused):
    plan = tmp_path / "plan.toml"
    assert "cannot be read" in refused("sweep", plan)
    plan.write_text(small(4), encoding="utf-8")
    assert "workers must be 1 to 1024" in refused("sweep", plan, "--out", tmp_path / "o", "--workers", 0)
    (tmp_path / "thesis.tex").write_text("precious")
    assert "which is not of a sweep" in refused("sweep", plan, "--out", tmp_path)
    assert "is a file" in refused("sweep", plan, "--out", plan)


@pytest.mark.parametrize(("field", "instead"), [("contact.stiffness", "vary law."), ("grease.damping", "law.grease")])
def test_fields_that_a_law_replaces(field, instead, tmp_path):
    ConstantLaw(5e3, 3.0, grease=Grease(2000.0, 2.0)).save(tmp_path / "law.json")
    vary = GAP.replace("gap", field)
    with pytest.raises(ClearanceError, match=f"has no effect.*{instead}"):
        loaded(tmp_path, text(EXCITATION, DESIGN.format(samples=4), vary, head='law = "law.json"'))
