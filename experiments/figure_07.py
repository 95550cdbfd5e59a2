"""Figure 7: FRFs at the two clearances, sensors 6 and 7."""

from clearance_mj.reproduce import main

if __name__ == "__main__":
    main("figure_07", nodes=(6, 7), level=2.0)
