"""Restoring forces of the clearances, of whole records and window by window."""
