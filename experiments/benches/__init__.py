"""Virtual benches that the rig file describes badly, simulated with physics that the package does not have."""
