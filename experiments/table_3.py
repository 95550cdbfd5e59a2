"""Table 3: SMC and SMC-CM at 72 km/h."""

from clearance_mj.reproduce import main

if __name__ == "__main__":
    main("table_3")
