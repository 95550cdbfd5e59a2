"""Figure 11: lateral and yaw rate error at 72 km/h."""

from clearance_mj.reproduce import main

if __name__ == "__main__":
    main("figure_11")
