"""The live page's charts without a browser: what their axes say."""

import json
import shutil

import pytest

from ..conftest import ROOT
from ..processes import run

SCRIPTS = [ROOT / "clearance_mj" / path for path in ("report/templates/charts.js", "live/page/figures.js")]
NODE = shutil.which("node")
PAGE = """
const host = { clientWidth: 300, setAttribute() {}, addEventListener() {} };
Object.assign(globalThis, { matchMedia: () => ({}), getComputedStyle: () => ({ getPropertyValue: () => "" }),
  document: { getElementById: () => host }, ResizeObserver: class { observe() {} } });
globalThis.uPlot = function (options) { this.over = host; globalThis.drawn = options; };
const read = (path) => require("fs").readFileSync(path, "utf8");
require("vm").runInThisContext(process.argv.slice(1).map(read).join("") + `;
new LiveChart("any", { logY: true }).show([{}], [[1, 2], [1e-6, 1e-4]]);
console.log(JSON.stringify(drawn.axes[1].values(null, [1e-7, 1e-6, null, 1e-4, 0.1, 1000])));`);
"""


@pytest.mark.skipif(NODE is None, reason="needs Node.js")
def test_small_numbers_of_a_logarithmic_axis_are_not_0():
    said = run(NODE, "-e", PAGE, *SCRIPTS)
    assert said.returncode == 0, said.stderr
    assert json.loads(said.stdout) == ["1e-7", "0.000001", "", "0.0001", "0.1", "1000"]
