"""Assignment of the channels of a logger's files to the sensors of a rig, by names, units and the records."""
