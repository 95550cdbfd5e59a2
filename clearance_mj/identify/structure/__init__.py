"""The linear structure: its update to records, its open parameters, and its possible faults."""
