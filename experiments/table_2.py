"""Table 2: MRE, RMSE, FRAC, CSAC and CSF of every sensor."""

from clearance_mj.reproduce import main

if __name__ == "__main__":
    main("table_2", levels=(0.5, 1.0, 2.0, 5.0, 8.0))
