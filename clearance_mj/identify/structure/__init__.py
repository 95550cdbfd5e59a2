"""The linear structure: updating it to records, what its file leaves open, and what may be wrong with it."""
