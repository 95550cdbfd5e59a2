"""Files of tests and results: universal files, CSV, MATLAB, NetCDF, HDF5, datasets."""
