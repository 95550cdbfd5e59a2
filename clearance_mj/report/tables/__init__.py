"""The numbers of a report: tidy rows, which go into CSV files, and the tables that are made of them."""

from .agreement import best_law, verdict, verdict_table
from .contact import contact_rows, contact_table
from .improvement import IMPROVED, base_law, improvement_rows, improvement_table
from .inputs import engine_rows, engine_table, parameter_rows, parameter_table, record_rows, record_table
from .modes_and_sensors import mode_rows, mode_table, seed_rows, sensor_mean_rows, sensor_rows, sensor_tables
from .study import FLOOR, MEASURES, OVERALL, Measure, engines, excitation_unit, is_synthetic, main_engine
from .table import Column, Table, write_csv

__all__ = [
    "FLOOR",
    "IMPROVED",
    "MEASURES",
    "OVERALL",
    "Column",
    "Measure",
    "Table",
    "base_law",
    "best_law",
    "contact_rows",
    "contact_table",
    "engine_rows",
    "engine_table",
    "engines",
    "excitation_unit",
    "improvement_rows",
    "improvement_table",
    "is_synthetic",
    "main_engine",
    "mode_rows",
    "mode_table",
    "parameter_rows",
    "parameter_table",
    "record_rows",
    "record_table",
    "seed_rows",
    "sensor_mean_rows",
    "sensor_rows",
    "sensor_tables",
    "verdict",
    "verdict_table",
    "write_csv",
]
