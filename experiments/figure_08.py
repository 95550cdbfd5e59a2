"""Figure 8: FRFs away from the clearances, sensors 1, 2, 3, 4, 5 and 8."""

from clearance_mj.reproduce import main

if __name__ == "__main__":
    main("figure_08", nodes=(1, 2, 3, 4, 5, 8), level=2.0)
