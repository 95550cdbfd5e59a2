"""Figure 1: the cantilever with double clearance, drawn from its rig file."""

from clearance_mj.reproduce import main

if __name__ == "__main__":
    main("figure_01")
