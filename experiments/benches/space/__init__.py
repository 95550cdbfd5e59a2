"""Virtual benches whose shafts move along y and z in round bushings, and turn."""
