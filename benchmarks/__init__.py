"""Benchmarks of clearance_mj: ratios measured side by side in one run."""
