"""Files of loggers as npTDMS and asammdf write them."""

from asammdf import MDF
from nptdms import TdmsWriter


def tdms(folder, *objects):
    """Write the objects of one segment; return the path."""
    with TdmsWriter(folder / "a.tdms") as writer:
        writer.write_segment([*objects])
    return folder / "a.tdms"


def mdf(folder, *groups, version="4.10"):
    """Write groups of signals with one time each; return the path."""
    path = folder / ("a.mf4" if version >= "4" else "a.mdf")
    with MDF(version=version) as file:
        for group in groups:
            file.append(group, common_timebase=len(group) > 1)
        file.save(path, overwrite=True)
    return path


def blocks(data, kind):
    """Where the links of each block of a kind end in an MDF file of version 4."""
    starts = (i for i in range(len(data)) if data[i : i + 4] == kind)
    return [i + 24 + 8 * int.from_bytes(data[i + 16 : i + 24], "little") for i in starts]
