"""Figure 3: damping and stiffness that fall steadily, identified from a free decay (working condition 2)."""

from clearance_mj.reproduce import main

if __name__ == "__main__":
    main("figure_03", snrs=(100, 20), seeds=5)
