"""Prepared records: channels side by side, read once, checked once, and handed on through an identification."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ...core.errors import RecordError
from ...core.quantities import QUANTITIES
from ...io.dataset import Dataset, Record
from ...rig import Rig
from ...rig.sensing import clearance_of
from ...signals.channel_check import check_channel
from ...signals.excitation import Excitation
from ...signals.keyphasor import ShaftTurning
from ...signals.response import Response
from ...signals.sampling import decimate
from .run_out import SLOW, TURNS, run_out, run_out_at

__all__ = ["EXCITATION", "PreparedRecord", "prepare", "prepare_turning", "prepared", "require_one_mark"]

EXCITATION = "excitation"
TURN_WIDTH, TURN_SPREAD = 1.5, 0.01  # Hz, and fraction of it, either side of each


@dataclass(frozen=True, eq=False)
class PreparedRecord:
    """The samples of a record's sensors, then probes, then of its excitation, with the channels' names."""

    name: str  #: the record's
    rig: Rig  #: that it was measured on, or a hypothesis of it
    tested: Rig  #: the former with the record's direction of excitation and spin
    fs: float  #: samples per second
    kind: str  #: "base" or "force": kind of excitation
    band: tuple[float, float] | None  #: of the excitation, Hz
    reference: str  #: degree of freedom of the excitation
    channels: tuple[str, ...]  #: (n_channels,) names: "accelerometer 3:+Z", "probe 6:+Z", and "excitation"
    signals: np.ndarray
    """(n_t, n_channels), SI units; channels side by side, so that sums over time are taken sample by sample"""
    probes: bool  #: True if every clearance has a displacement probe, a round one two
    turning: ShaftTurning | None = None  #: of a shaft that turned
    absent: tuple[str, ...] = ()
    """channels that were left out of this record: their samples are 0, and nothing may be concluded from them"""
    slow_roll: float = 0.0
    """rad/s, of the slow turning whose motion over the shaft's angle was subtracted from the probes; 0: of none"""

    @property
    def duration(self) -> float:
        """Duration in s."""
        return len(self.signals) / self.fs

    @property
    def present(self) -> np.ndarray:
        """(n_channels,) bool, channels that were not left out."""
        return np.array([name not in self.absent for name in self.channels])

    @property
    def displacement(self) -> np.ndarray | None:
        """(n_rows, n_t) of the probes, m, see `Rig.clearance_rows`; None unless every clearance has them."""
        return self.signals[:, self._n_sensors : -1].T if self.probes else None

    @property
    def _n_sensors(self) -> int:
        """Sensors that were recorded: all of the rig, or none."""
        return sum(not name.startswith("probe") for name in self.channels) - 1

    def excitation(self) -> Excitation:
        """Return the measured excitation, to simulate with."""
        kind, origin = "force" if self.kind == "force" else "base", {"generator": "record", "record": self.name}
        return Excitation(self.signals[:, -1], self.fs, kind, self.band, origin)

    def response(self) -> Response:
        """Return the measured response, as `Record.response` does."""
        recorded = np.flatnonzero(self.present[: self._n_sensors])
        return Response(
            self.fs, self.signals[:, -1], self.signals[:, recorded].T, self.displacement,
            kind="force" if self.kind == "force" else "base", band=self.band,
            responses=tuple(self.rig.sensor_labels[i] for i in recorded), reference=self.reference,
            quantities=tuple(self.rig.sensors[i].quantity for i in recorded),
        )  # fmt: skip

    def away_from_turns(self, frequency: np.ndarray) -> np.ndarray:
        """Return which frequencies (n_f,), Hz, are away from the shaft's turns, where unbalance and run-out act.

        Parameters
        ----------
        frequency : ndarray, shape (n_f,)
            Hz.
        """
        away = np.ones(frequency.size, dtype=bool)
        if self.turning is not None:
            for order in range(1, TURNS + 1):
                turns = order * abs(self.turning.mean_speed) / (2 * np.pi)
                away &= np.abs(frequency - turns) > TURN_WIDTH + TURN_SPREAD * turns
        return away

    @cached_property
    def faults(self) -> dict[str, str]:
        """Faults of channels that cannot be used, by their names; empty if all can."""
        faults = {}
        for name, signal in zip(self.channels, self.signals.T):
            if (name == EXCITATION and self.kind == "spin") or name in self.absent:
                continue
            try:
                check_channel(f'record "{self.name}": {name}', signal, self.fs)
            except RecordError as error:
                faults[name] = str(error)
        return faults

    def require_usable(self, channel: str | None = None) -> None:
        """Refuse the record if a channel cannot be used.

        Parameters
        ----------
        channel : str, optional
            The only one that matters; by default all do.

        Raises
        ------
        RecordError
            Names the channel and its fault.
        """
        for name, fault in self.faults.items():
            if channel in (None, name):
                raise RecordError(fault)

    def part(self, samples: slice) -> PreparedRecord:
        """Return a part of the record.

        Parameters
        ----------
        samples : slice
            Of its samples.
        """
        turning = None if self.turning is None else self.turning.part(samples)
        return replace(self, signals=self.signals[samples], turning=turning)

    def slowed(self, rate: float) -> PreparedRecord:
        """Return the record with fewer samples a second, as few as a whole factor allows.

        Parameters
        ----------
        rate : float
            Samples per second, at least.
        """
        if (factor := int(self.fs // rate)) < 2:
            return self
        turning = None if self.turning is None else self.turning.part(slice(None, None, factor))
        return replace(self, fs=self.fs / factor, signals=decimate(self.signals, factor), turning=turning)

    def without_probes(self) -> PreparedRecord:
        """Return the record as if it had no displacement probes."""
        if not self.probes:
            return self
        columns = [*range(self._n_sensors), -1]
        names = tuple(self.channels[i] for i in columns)
        return replace(self, channels=names, signals=self.signals[:, columns], probes=False)


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
    if forces := [s.label for s in record.rig.sensors if clearance_of(record.rig, s) is not None]:
        raise RecordError(
            f"identification finds the forces in clearances itself and uses none that is measured: leave sensor "
            f"{forces[0]} out of the rig file"
        )
    sensors: list[tuple[str, str]] = [(s.label, s.quantity) for s in record.rig.sensors] if response.responses else []
    recorded = [*zip(response.responses, response.quantities)]
    readings = np.zeros((len(sensors), record.size))
    readings[[sensors.index(sensor) for sensor in recorded]] = response.channels
    names = [f"{QUANTITIES[quantity].instrument} {label}" for label, quantity in sensors]
    probes = [f"probe {label}" for label in record.rig.probe_labels] if displacement else []
    signals = np.ascontiguousarray(np.vstack((readings, *displacement, response.excitation)).T)
    absent = tuple(name for name, sensor in zip(names, sensors) if sensor not in recorded)
    return PreparedRecord(
        record.name, record.rig, record.tested_rig, record.fs, record.excitation_kind, response.band,
        response.reference, (*names, *probes, EXCITATION), signals, bool(displacement), record.turning(), absent,
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
    """
    records = tuple(map(prepared, dataset.to_identify() if isinstance(dataset, Dataset) else dataset))
    if not (driven := tuple(record for record in without_run_out(records) if record.kind != "spin")):
        raise RecordError("no record to identify is driven by its base or a force: turning alone tells no structure")
    return driven


def prepare_turning(dataset: Dataset) -> tuple[PreparedRecord, ...]:
    """Return the records to identify in which the shaft turned, driven or alone, with all channels, without run-out.

    Parameters
    ----------
    dataset : Dataset
        Records of a rig in space.
    """
    records = without_run_out([prepared(record) for record in dataset.identify])
    channels = max((len(record.channels) for record in records), default=0)
    return tuple(r for r in records if r.turning is not None and len(r.channels) == channels)


def without_run_out(records: Sequence[PreparedRecord]) -> tuple[PreparedRecord, ...]:
    """Return records whose probes no longer show the run-out that a slow record shows, if there is one.

    Parameters
    ----------
    records : sequence of PreparedRecord
        Of one rig; those that turn are changed.
    """
    require_one_mark(records)
    steady = sorted((r for r in records if _turns_steadily(r)), key=lambda r: abs(r.turning.mean_speed))  # type: ignore[union-attr]
    speeds = [abs(r.turning.mean_speed) for r in steady if r.turning]
    slow = [r for r, speed in zip(steady, speeds) if r.kind == "spin" and speed < SLOW * speeds[-1]]
    if not slow:
        return tuple(records)
    assert slow[0].turning is not None and slow[0].displacement is not None
    surface, speed = run_out(slow[0].turning.angle, slow[0].displacement), abs(slow[0].turning.mean_speed)
    return tuple(_without_run_out(record, surface, speed) for record in records)


def require_one_mark(records: Sequence[PreparedRecord]) -> None:
    """Refuse records whose shafts' angles have no common mark: unbalance and run-out would be at another in each.

    Parameters
    ----------
    records : sequence of PreparedRecord
        Of one rig.

    Raises
    ------
    RecordError
        Names a record whose keyphasor has several pulses in a turn, among others in which the shaft turns.
    """
    pulses = [(r.name, r.tested.spin.pulses) for r in records if r.turning is not None and r.tested.spin]
    name, count = next((each for each in pulses if each[1] > 1), ("", 1))
    if count > 1 and len(pulses) > 1:
        raise RecordError(
            f'record "{name}": which of its {count} pulses in a turn is which in the others is not known, and '
            "unbalance and run-out have no common angle: give it alone, or one pulse in a turn"
        )


def _turns_steadily(record: PreparedRecord) -> bool:
    spin = record.tested.spin
    return record.turning is not None and record.displacement is not None and not (spin and spin.rate)


def _without_run_out(record: PreparedRecord, surface: np.ndarray, speed: float) -> PreparedRecord:
    if record.turning is None or record.displacement is None:
        return record
    signals = record.signals.copy()
    signals[:, slice(-1 - surface.shape[1], -1)] -= run_out_at(record.turning.angle, surface).T
    return replace(record, signals=signals, slow_roll=speed)
