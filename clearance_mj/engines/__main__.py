"""Write the MJCF of a rig beside its TOML: ``python -m clearance_mj.engines models/table1_rig.toml``."""

import argparse
from pathlib import Path

from ..core.files import replacing
from ..rig import Rig
from .links import build_links


def main() -> None:
    """Write ``<rig>_links.xml``."""
    parser = argparse.ArgumentParser(prog="python -m clearance_mj.engines", description=__doc__)
    parser.add_argument("rig", type=Path, help="rig file (TOML)")
    path = parser.parse_args().rig
    with replacing(path.with_name(f"{path.stem}_links.xml")) as temporary:
        temporary.write_text(build_links(Rig.load(path)).to_xml(), encoding="utf-8")


if __name__ == "__main__":
    main()
