"""Figure 2: damping and stiffness that step at 2 s, identified from a free decay (working condition 1)."""

from clearance_mj.reproduce import main

if __name__ == "__main__":
    main("figure_02", snrs=(100, 20), seeds=5)
