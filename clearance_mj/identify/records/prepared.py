"""Prepared records: channels side by side, read once, checked once, and handed on through an identification."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...core.errors import RecordError
from ...io.dataset import Dataset, Record
from ...rig import Rig
from ...rig.dimensions import planar
from ...signals.channel_check import check_channel
from ...signals.excitation import Excitation
from ...signals.response import Response

__all__ = ["EXCITATION", "PreparedRecord", "prepare", "prepared"]

EXCITATION = "excitation"


@dataclass(frozen=True, eq=False)
class PreparedRecord:
    """The samples of a record's accelerometers, then probes, then of its excitation, and what each channel is."""

    name: str  #: the record's
    rig: Rig  #: that it was measured on, or a hypothesis of it
    fs: float  #: samples per second
    kind: str  #: "base" or "force": what excites
    band: tuple[float, float] | None  #: of the excitation, Hz
    reference: str  #: degree of freedom of the excitation
    channels: tuple[str, ...]  #: (n_channels,) names: "accelerometer 3:+Z", "probe 6:+Z", and "excitation"
    signals: np.ndarray
    """(n_t, n_channels), SI units; channels side by side, so that sums over time are taken sample by sample"""
    probes: bool  #: whether every clearance has a displacement probe

    @property
    def duration(self) -> float:
        """Duration in s."""
        return len(self.signals) / self.fs

    @property
    def displacement(self) -> np.ndarray | None:
        """(n_bushings, n_t) of the probes, m; None unless every clearance has one."""
        return self.signals[:, len(self.rig.sensors) : -1].T if self.probes else None

    def excitation(self) -> Excitation:
        """Return the measured excitation, to simulate with."""
        return Excitation(
            self.signals[:, -1], self.fs, self.kind, self.band, {"generator": "record", "record": self.name}
        )

    def response(self) -> Response:
        """Return what the sensors measured, as `Record.response` does."""
        return Response(
            self.fs, self.signals[:, -1], self.signals[:, : len(self.rig.sensors)].T, self.displacement, kind=self.kind,
            band=self.band, responses=tuple(self.rig.sensor_labels), reference=self.reference,
        )  # fmt: skip

    @cached_property
    def faults(self) -> dict[str, str]:
        """Why channels cannot be used, by their names; empty if all can."""
        found = {}
        for name, signal in zip(self.channels, self.signals.T):
            try:
                check_channel(f'record "{self.name}": {name}', signal, self.fs)
            except RecordError as error:
                found[name] = str(error)
        return found

    def require_usable(self, channel: str | None = None) -> None:
        """Refuse the record if a channel cannot be used.

        Parameters
        ----------
        channel : str, optional
            The only one that matters; by default all do.

        Raises
        ------
        RecordError
            Names the channel and what is wrong with it.
        """
        for name, fault in self.faults.items():
            if channel in (None, name):
                raise RecordError(fault)

    def without_probes(self) -> PreparedRecord:
        """Return the record as if it had no displacement probes."""
        if not self.probes:
            return self
        kept, names = [*range(len(self.rig.sensors)), -1], self.channels
        return dataclasses.replace(
            self, channels=tuple(names[i] for i in kept), signals=self.signals[:, kept], probes=False
        )


def prepared(record: Record | PreparedRecord) -> PreparedRecord:
    """Return a record prepared; one that is prepared already is returned as it is.

    Parameters
    ----------
    record : Record or PreparedRecord
        The record, whose file is read now if that has not been done.

    Raises
    ------
    RecordError
        If the file cannot be read.
    """
    if isinstance(record, PreparedRecord):
        return record
    response = record.response()
    displacement = [] if response.displacement is None else [response.displacement]
    channels = [f"accelerometer {label}" for label in response.responses]
    channels += [f"probe {label}" for label in record.rig.probe_labels] if displacement else []
    signals = np.ascontiguousarray(np.vstack((response.acceleration, *displacement, response.excitation)).T)
    return PreparedRecord(
        record.name, record.rig, record.fs, record.excitation_kind, response.band, response.reference,
        (*channels, EXCITATION), signals, bool(displacement),
    )  # fmt: skip


def prepare(dataset: Dataset | Sequence[Record | PreparedRecord]) -> tuple[PreparedRecord, ...]:
    """Return the records of a dataset to identify from, prepared.

    Parameters
    ----------
    dataset : Dataset or sequence of Record
        Records of a dataset with role "validate" are never opened.

    Raises
    ------
    RecordError
        If there is no record to identify from, or a file cannot be read.
    ClearanceError
        If the rig moves in space.
    """
    if isinstance(dataset, Dataset):
        planar(dataset.rig, "identification")
    return tuple(map(prepared, dataset.to_identify() if isinstance(dataset, Dataset) else dataset))
