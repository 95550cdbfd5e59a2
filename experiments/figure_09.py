"""Figure 9: CSAC of each sensor over frequency."""

from clearance_mj.reproduce import main

if __name__ == "__main__":
    main("figure_09", level=2.0)
