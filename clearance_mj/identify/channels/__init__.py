"""Which channel of a logger's files is which sensor of a rig: found from names, units and the records themselves."""
