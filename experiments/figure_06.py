"""Figure 6: the test model, as MuJoCo renders it."""

from clearance_mj.reproduce import main

if __name__ == "__main__":
    main("figure_06")
