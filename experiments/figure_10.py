"""Figure 10: CSF of each sensor over frequency."""

from clearance_mj.reproduce import main

if __name__ == "__main__":
    main("figure_10", level=2.0)
