"""Write the MJCF of a rig beside its TOML: ``python -m clearance_mj.engines models/table1_rig.toml``."""

import argparse
from pathlib import Path

from ..core.files import replacing
from ..rig import Rig
from . import mjcf


def main() -> None:
    """Write ``<rig>_links.xml`` and ``<rig>_modes.xml``."""
    parser = argparse.ArgumentParser(prog="python -m clearance_mj.engines", description=__doc__)
    parser.add_argument("rig", type=Path, help="rig file (TOML)")
    path = parser.parse_args().rig
    for name, text in mjcf(Rig.load(path)).items():
        with replacing(path.with_name(f"{path.stem}_{name}.xml")) as temporary:
            temporary.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
