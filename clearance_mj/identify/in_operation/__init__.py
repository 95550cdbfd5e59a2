"""Identification from records of a machine in operation: probes and keyphasor alone."""
