"""Data set 151: what the file is about."""

from __future__ import annotations

DATE, TIME = "01-Jan-00", "00:00:00"
"""The same object gives the same bytes: pyuff would put in the present time."""


def header_set(title: str) -> dict:
    """The data set as pyuff writes it."""
    return {
        "type": 151,
        "model_name": "clearance_mj",
        "description": title,
        "db_app": "clearance_mj",
        "program": "clearance_mj",
        "version_db1": 0,
        "version_db2": 0,
        "file_type": 0,
        "date_db_created": DATE,
        "time_db_created": TIME,
        "date_db_saved": DATE,
        "time_db_saved": TIME,
        "date_file_written": DATE,
        "time_file_written": TIME,
    }
