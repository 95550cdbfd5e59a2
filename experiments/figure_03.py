"""Figure 3: damping and stiffness that fall steadily, identified from a free decay (working condition 2)."""

from figure_02 import main

if __name__ == "__main__":
    main(2, "figure_03")
