"""Table 5: peaks of lateral acceleration and yaw rate at 120 km/h."""

from clearance_mj.reproduce import main

if __name__ == "__main__":
    main("table_5")
