"""Helpers of every part, none of them of the field: errors, files, units, tasks, caches, messages, drawing."""
