"""Identification of joints that slip: loops of force over travel, jointed modes, jointed structures."""
