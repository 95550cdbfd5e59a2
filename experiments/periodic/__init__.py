"""Periodic responses: the pages of the documentation and their verification by marches in time."""
