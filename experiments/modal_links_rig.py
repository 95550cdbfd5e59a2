"""Modal against links against rig: shapes, backbones, harmonics, jumps, best linear approximations."""

from clearance_mj.reproduce import main

if __name__ == "__main__":
    main("modal_links_rig")
