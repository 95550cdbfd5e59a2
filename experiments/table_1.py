"""Table 1: natural frequencies, their relative errors, and MAC."""

from clearance_mj.reproduce import main

if __name__ == "__main__":
    main("table_1", levels=(0.5, 1.0, 2.0, 5.0, 8.0))
