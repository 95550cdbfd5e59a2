"""Figure 12: lateral and heading error at 120 km/h."""

from clearance_mj.reproduce import main

if __name__ == "__main__":
    main("figure_12")
