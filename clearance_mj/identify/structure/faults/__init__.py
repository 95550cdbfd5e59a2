"""Gross faults of rigs, instruments and records: one file for each kind of cause, and their diagnosis."""
