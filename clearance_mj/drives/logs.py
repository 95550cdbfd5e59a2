"""Files that logs of drives come in, as tables: Parquet, MCAP with joint states of ROS 2, all formats of records."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from ..core.errors import RecordError
from ..core.files import plain_file
from ..core.units import UNITS
from ..io.channels import UNKNOWN, require_one_time
from ..io.csv_tables import read_columns
from ..io.formats import FORMATS, read_channels

__all__ = ["read_table"]

STATE = "sensor_msgs/msg/JointState"
FIELDS = (".position", ".velocity", ".effort")  # of joints, in SI units


def read_table(path: str | Path) -> pd.DataFrame:
    """Return the columns of a log: ``.parquet``, ``.mcap`` with joint states of ROS 2, a format of records, or text.

    Tables of text are read as loggers write them; units stand in brackets behind the names of columns, ``motor [deg]``.
    Of joint states the columns are ``time`` (s, of the messages' stamps), ``JOINT.position``, ``JOINT.velocity`` and
    ``JOINT.effort``; of joints that several topics have, ``/topic JOINT.position``. Topics are brought to the times of
    the first by linear interpolation.

    Parameters
    ----------
    path : path
        The file.

    Raises
    ------
    RecordError
        For a file that cannot be read, or whose format needs a package that is not installed.
    """
    name = Path(path).name.lower()
    kind, read = next((c for c in READERS.items() if name.endswith(c[0])), ("a log", _records))
    try:
        return read(plain_file(path))
    except ImportError:
        raise RecordError(f'{path}: {kind} needs further packages: pip install "clearance-mj[logs]"') from None
    except RecordError:
        raise
    except Exception as error:  # each reader has errors of its own
        raise RecordError(f"{path}: cannot be read as {kind.removeprefix('.')}: {error}") from None


def _records(path: Path) -> pd.DataFrame:
    known = FORMATS.get(Path(path.name.lower().removesuffix(".gz")).suffix)
    if known is None or known.read is FORMATS[".csv"].read:
        return pd.DataFrame(read_columns(path))
    channels = read_channels(path)
    require_one_time(channels)
    units = (c.unit if c.quantity == UNKNOWN else next(iter(UNITS[c.quantity])) for c in channels)
    named = {f"{c.name} [{unit}]" if unit else c.name: c.value for c, unit in zip(channels, units)}
    return pd.DataFrame({"time": channels[0].time} | named)


def _joint_states(path: Path) -> pd.DataFrame:
    from mcap.reader import make_reader
    from mcap_ros2.decoder import DecoderFactory

    topics: dict[str, list[tuple[float, Any]]] = {}
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        for schema, channel, _, message in reader.iter_decoded_messages():
            if schema is not None and schema.name == STATE:
                stamp = message.header.stamp
                topics.setdefault(channel.topic, []).append((stamp.sec + 1e-9 * stamp.nanosec, message))
    if not topics:
        raise RecordError(f"{path}: no topic has joint states ({STATE})")
    joints = [joint for messages in topics.values() for joint in messages[0][1].name]
    first = next(iter(topics.values()))
    time = np.array([stamp for stamp, _ in first])
    columns = {"time": time - time[0]}
    for topic, messages in topics.items():
        own = np.array([stamp for stamp, _ in messages])
        for joint in messages[0][1].name:
            prefix = joint if joints.count(joint) == 1 else f"{topic} {joint}"
            for field in FIELDS:
                values = [_value(message, joint, field[1:]) for _, message in messages]
                if not np.isnan(values).all():
                    columns[f"{prefix}{field}"] = np.interp(time, own, values)
    return pd.DataFrame(columns)


def _value(message: Any, joint: str, field: str) -> float:
    """A joint's number in one message, whose joints may come in any order, without fields that nobody measures."""
    values, names = getattr(message, field), list(message.name)
    return float(values[names.index(joint)]) if joint in names and len(values) == len(names) else float("nan")


READERS: dict[str, Callable[[Path], pd.DataFrame]] = {".parquet": pd.read_parquet, ".mcap": _joint_states}
