"""Table 4: tracking errors at 120 km/h."""

from clearance_mj.reproduce import main

if __name__ == "__main__":
    main("table_4")
