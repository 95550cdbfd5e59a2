"""Fits of contact and grease: along restoring forces, by output error, and their misfit."""
