"""Records: the channels measured on a rig in one test, and its excitation."""

from __future__ import annotations

import dataclasses
import functools
import re
from collections.abc import Sequence
from dataclasses import field
from pathlib import Path
from typing import Annotated, Any, Literal, overload

import numpy as np
from pydantic import AfterValidator, Field, SkipValidation

from ..core.checks import naming
from ..core.errors import RecordError
from ..core.overview import HasOverview, Overview
from ..core.validation import NotNegative, Positive, Text, Whole, checked
from ..rig import Rig, Spin
from ..rig.instruments import KEYPHASOR, Direction, Sensor
from ..signals.excitation import Excitation
from ..signals.keyphasor import ShaftTurning, turning_of_pulses
from ..signals.response import Response
from .channels import UNKNOWN, Channel, ChannelHeader, place_of
from .columns import channel_name
from .uff import read_uff

__all__ = ["RECORD_HEAD", "Band", "FileChannels", "Kind", "Record", "RecordName", "Role"]

_QUANTITIES = {"base": "acceleration", "force": "force"}
RECORD_HEAD = ("record", "role", "level RMS", "duration", "rate", "band", "excitation")
STEADY = 0.02  # of the stated speed: largest deviation and change of the measured one
RAMP = 0.2  # of the fastest speed of a ramp: largest deviation, for no machine follows one exactly
SENSOR = "a sensor of the rig"
LEAVE_OUT = '; leave it out of this record alone with left_out = ["{}"] in dataset.toml, or convert --leave-out {}'
_OTHER_SIGN = str.maketrans("+-", "-+")
_RATE_TOLERANCE = 1e-5  # A universal file writes six digits of the time step.


def _record_name(name: str) -> str:
    if not re.fullmatch(_NAME, name):
        raise ValueError("must be letters, digits, '.', '_' and '-', at most 64")
    return name


def _rising(band: tuple[float, float]) -> tuple[float, float]:
    if not band[0] < band[1]:
        raise ValueError(f"{band[0]:g} to {band[1]:g} must be two increasing frequencies in Hz")
    return band


_NAME = "[A-Za-z0-9][A-Za-z0-9._-]{0,63}"
RecordName = Annotated[Text, Field(json_schema_extra={"pattern": f"^{_NAME}$"}), AfterValidator(_record_name)]
Role = Literal["identify", "validate", "sine", "orbit"]
Kind = Literal["base", "force", "spin"]
Band = Annotated[tuple[NotNegative, NotNegative], AfterValidator(_rising)]


@checked(RecordError, eq=False)
class Record(HasOverview):
    """One test: the channels measured on a rig, and how it was excited.

    Raises
    ------
    RecordError
        If the channels do not fit each other, the rig or the excitation; the message names the record.
    """

    name: RecordName
    """letters, digits, ".", "_", "-": it is also the name of its file"""
    role: Role
    """ "identify", "validate", "sine" or "orbit" """
    rig: Rig
    """what was measured"""
    fs: Positive
    """samples per second"""
    channels: SkipValidation[Sequence[Channel]]
    """time functions of one length and rate"""
    excitation_kind: Kind = "base"
    """ "base": acceleration of node 100; "force": force of node 200; "spin": the shaft's turning alone"""
    description: Text = ""
    """the excitation in words"""
    level: NotNegative | None = None
    """RMS of the excitation, m/s² or N"""
    seed: Whole | None = None
    """of the excitation, if it was random"""
    band: Band | None = None
    """of the excitation, Hz"""
    provenance: dict[str, Any] = field(default_factory=dict)
    """where it comes from; plain data"""
    direction: Direction | None = None
    """(x, y, z) along which the base moved or the force acted; None: that of the rig's shaker"""
    spin: Spin | None = None
    """how the shaft turned; None: as the rig file says"""
    left_out: tuple[Text, ...] = ()
    """sensors of the rig, such as "3:+Z", that were not recorded or cannot be used in this test"""

    def __post_init__(self) -> None:
        if not isinstance(self.channels, FileChannels):
            object.__setattr__(self, "channels", tuple(self.channels))
        with naming(f'record "{self.name}"'):
            if self.band and self.fs < 2 * self.band[1]:
                raise RecordError(f"fs {self.fs:g} Hz is below twice the band's upper end {self.band[1]:g} Hz")
            self._check_left_out()
            self._check_channels(self._headers)
            self._check_turning(self._headers)

    def _check_left_out(self) -> None:
        sensors = self.rig.sensor_labels
        if unknown := sorted(set(self.left_out) - set(sensors)):
            raise RecordError(f'left_out: "{unknown[0]}" is no sensor of the rig; it has {", ".join(sensors)}')
        if self.left_out and self.role != "identify":
            raise RecordError(
                "left_out is for records to identify: others are compared at all sensors; put this record into a "
                "dataset of its own, whose rig file lacks the sensor"
            )
        if sensors and not self._recorded_sensors:
            raise RecordError("left_out leaves no sensor")

    def _check_channels(self, headers: Sequence[Channel | ChannelHeader]) -> None:
        if not headers:
            raise RecordError("has no channels")
        first, seen = headers[0], dict[tuple[int, str, str], Channel | ChannelHeader]()
        for h in headers:
            if abs(h.fs / self.fs - 1) > _RATE_TOLERANCE:
                raise RecordError(f'channel "{h.name}" is sampled at {h.fs:g} Hz, the record at {self.fs:g} Hz')
            if h.size != first.size:
                raise RecordError(
                    f'channel "{h.name}" has {h.size} samples, channel "{first.name}" has {first.size}; '
                    "needs one length"
                )
            if abs(h.start - first.start) * self.fs > 0.01:
                raise RecordError(
                    f'channel "{h.name}" starts at {h.start:g} s, channel "{first.name}" at {first.start:g} s'
                )
            if not h.placed or h.quantity == UNKNOWN:
                continue
            if (other := seen.setdefault((h.node, h.direction.lstrip("+-"), h.quantity), h)) is not h:
                raise RecordError(
                    f'channels "{other.name}" and "{h.name}" both are {h.quantity} at node {h.node} along '
                    f"{h.direction.lstrip('+-')}"
                )
        kind, needed = self.excitation_kind, {}
        if kind != "spin":
            column = channel_name(*self._excitation_dof)
            needed[self._excitation_dof] = f'the excitation of a record of kind "{kind}" (column "{column}" of a table)'
        if self.role == "orbit" or (kind == "spin" and not self._has_all_sensors):
            needed |= {(label, "displacement"): "a probe of an orbit" for label in self.rig.probe_labels}
        else:
            needed |= {(s.label, s.quantity): SENSOR for s in self._recorded_sensors}
        for (label, quantity), purpose in needed.items():
            node, axis = _node_and_axis(label)
            if (node, axis, quantity) not in seen:
                leave_out = LEAVE_OUT.format(label, label) if purpose == SENSOR and self.role == "identify" else ""
                remedy = _mapping_hint(headers) or leave_out
                raise RecordError(f"has no {quantity} at node {node} along {axis}, {purpose}{remedy}")

    def _check_turning(self, headers: Sequence[Channel | ChannelHeader]) -> None:
        spin = self._test_spin
        if self.excitation_kind == "spin" and not spin:
            raise RecordError('is of kind "spin", and its shaft does not turn: give spin with a speed, rad/s')
        if spin and not any(h.label == KEYPHASOR for h in headers):
            raise RecordError(
                f"turns at {spin.speed:g} rad/s and has no keyphasor, a channel of once-per-turn pulses at "
                f"{KEYPHASOR}, without which the shaft's angle is not known"
            )

    __repr__ = HasOverview.__repr__

    def row(self) -> tuple[str, ...]:
        """Return name, role, level, duration, rate, band and excitation in words."""
        unit = "N" if self.excitation_kind == "force" else "m/s²"
        level = "" if self.level is None else f"{self.level:.4g} {unit}"
        band = f"{self.band[0]:g} to {self.band[1]:g} Hz" if self.band else ""
        rate, excitation = f"{self.fs:g} Hz", self.description or self.excitation_kind
        return self.name, self.role, level, f"{self.duration:.4g} s", rate, band, excitation

    def _overview(self) -> Overview:
        facts = dict(zip(RECORD_HEAD[1:], self.row()[1:]))
        facts["channels"] = str(len(self._headers))
        facts["left out"] = ", ".join(self.left_out)
        facts["from"] = ", ".join(f"{name}: {value}" for name, value in self.provenance.items())
        return Overview(f"Record “{self.name}” of rig “{self.rig.name}”", facts)

    @functools.cached_property
    def tested_rig(self) -> Rig:
        """The rig as tested: driven along the record's direction, with its shaft turning as the record says."""
        changed: dict[str, Any] = {}
        if self.direction is not None and self.direction != self.rig.shaker.direction:
            changed["shaker"] = dataclasses.replace(self.rig.shaker, direction=self.direction)
        if self.spin is not None and self.spin != self.rig.spin:
            changed["spin"] = self.spin
        return self.rig.replace(**changed) if changed else self.rig

    @property
    def _test_spin(self) -> Spin | None:
        """Rotation of the shaft in this test; None if it did not turn."""
        spin = self.spin or self.rig.spin
        return spin if spin and (spin.speed or spin.rate) else None

    @property
    def _excitation_dof(self) -> tuple[str, str]:
        """Degree of freedom and quantity of the excitation."""
        kind = "base" if self.excitation_kind == "spin" else self.excitation_kind
        return self.tested_rig.shaker.label(kind), _QUANTITIES[kind]

    @property
    def _recorded_sensors(self) -> list[Sensor]:
        """The rig's sensors that are not left out."""
        return [s for s in self.rig.sensors if s.label not in self.left_out]

    @property
    def _has_all_sensors(self) -> bool:
        """True if every sensor that is not left out was recorded, along either sense of its direction."""
        recorded = {(h.node, h.direction.lstrip("+-"), h.quantity) for h in self._headers}
        return all((*_node_and_axis(s.label), s.quantity) in recorded for s in self._recorded_sensors)

    @property
    def _headers(self) -> Sequence[Channel | ChannelHeader]:
        return self.channels.headers if isinstance(self.channels, FileChannels) else self.channels

    @property
    def opened(self) -> bool:
        """True if the samples have been read from their file; always so of a record made in memory."""
        return not isinstance(self.channels, FileChannels) or self.channels.opened

    @property
    def size(self) -> int:
        """Number of samples of each channel."""
        return self._headers[0].size

    @property
    def duration(self) -> float:
        """Duration in s."""
        return self.size / self.fs

    def excitation(self) -> Excitation:
        """Return the measured excitation, to simulate with."""
        description = {"generator": "record", "record": self.name, "excitation": self.description}
        description |= {k: v for k in ("level", "seed") if (v := getattr(self, k)) is not None}
        if self.excitation_kind == "spin":
            return Excitation(np.zeros(self.size), self.fs, "base", None, description)
        value = self._samples_by_dof()[self._excitation_dof]
        return Excitation(value, self.fs, self.excitation_kind, self.band, description)

    def turning(self) -> ShaftTurning | None:
        """Return the shaft's rotation by its keyphasor; None if it did not turn.

        Raises
        ------
        RecordError
            If the pulses do not determine it, or contradict the record's ``spin``.
        """
        return self._turning

    @functools.cached_property
    def _turning(self) -> ShaftTurning | None:
        if (spin := self._test_spin) is None:
            return None
        pulses = next(c.value for c in self.channels if c.label == KEYPHASOR)
        with naming(f'record "{self.name}"'):
            sense, stated = -1.0 if spin.speed + spin.rate < 0 else 1.0, None if spin.inertia else spin.angle_at
            turning = turning_of_pulses(pulses, self.fs, sense, spin.pulses, stated)
            self._check_speed(spin, turning)
        return turning

    @staticmethod
    def _check_speed(spin: Spin, turning: ShaftTurning) -> None:
        if spin.inertia:
            return
        if spin.rate:
            time = (turning.marks[1:] + turning.marks[:-1]) / 2
            stated, measured = np.abs(spin.speed_at(time)), np.abs(turning.of_turns)
            worst = int(np.argmax(np.abs(measured - stated)))
            if abs(measured[worst] - stated[worst]) > RAMP * stated.max():
                raise RecordError(
                    f"is said to turn at {stated[worst]:.4g} rad/s at {time[worst]:.4g} s, and its keyphasor shows "
                    f"{measured[worst]:.4g} rad/s: give spin another speed or rate"
                )
            return
        slowest, fastest = (float(end) for end in np.sort(np.abs(turning.of_turns))[[0, -1]])
        if fastest - slowest > STEADY * abs(turning.mean_speed):
            raise RecordError(
                f"is said to turn at {spin.speed:.4g} rad/s, and its keyphasor shows {slowest:.4g} to {fastest:.4g} "
                "rad/s: give spin a rate, or a part of it at one speed"
            )
        if abs(turning.mean_speed / spin.speed - 1) > STEADY:
            raise RecordError(
                f"is said to turn at {spin.speed:.4g} rad/s, and its keyphasor shows {turning.mean_speed:.4g} rad/s"
            )

    def response(self) -> Response:
        """Return the response that the rig's sensors measured.

        Returns
        -------
        Response
            ``channels`` (n_sensors, n_t) in the order of the rig's sensors, without those left out;
            ``displacement`` (n_rows, n_t) if every clearance has its probes, displacement channels at
            `Rig.probe_labels`. A channel of the other sign is reversed.
        """
        measured = self._samples_by_dof()
        probed = [(label, "displacement") for label in self.rig.probe_labels]
        has_probes = bool(probed) and not self.missing_probes
        by_spin, turning = self.excitation_kind == "spin", self.turning()
        sensors = self._recorded_sensors if self._has_all_sensors else []
        return Response(
            fs=self.fs, excitation=np.zeros(self.size) if by_spin else measured[self._excitation_dof],
            channels=np.array([measured[s.label, s.quantity] for s in sensors]).reshape(-1, self.size),
            displacement=np.stack([measured[probe] for probe in probed]) if has_probes else None,
            kind="base" if by_spin else self.excitation_kind, band=self.band, reference=self._excitation_dof[0],
            responses=tuple(s.label for s in sensors), quantities=tuple(s.quantity for s in sensors),
            provenance={"record": self.name, "rig": self.rig.name, **self.provenance},
            spin=None if turning is None else turning.speed,
        )  # fmt: skip

    @property
    def missing_probes(self) -> tuple[tuple[int, str], ...]:
        """Rows of clearances without a displacement probe: the index and the degree of freedom of each."""
        probed = {(h.node, h.direction.lstrip("+-")) for h in self._headers if h.quantity == "displacement"}
        return tuple(pair for pair in enumerate(self.rig.probe_labels) if _node_and_axis(pair[1]) not in probed)

    def _samples_by_dof(self) -> dict[tuple[str, str], np.ndarray]:
        """Return (n_t,) samples by degree of freedom, in either sign, and quantity."""
        samples = {(c.label, c.quantity): c.value for c in self.channels}
        return {(dof.translate(_OTHER_SIGN), quantity): -v for (dof, quantity), v in samples.items()} | samples


def _mapping_hint(headers: Sequence[Channel | ChannelHeader]) -> str:
    """Return how to give channels their places, where some have none; "" otherwise."""
    if not (raw := [h.name for h in headers if not h.placed or h.quantity == UNKNOWN]):
        return ""
    others = f" and {len(raw) - 1} more" if raw[1:] else ""
    return (
        f'; its file does not say where or what "{raw[0]}"{others} measured: make a map with clearance-mj map FILE '
        f'--rig RIG, or give each, such as --column "{raw[0]}=acc:1 [g]"'
    )


def _node_and_axis(label: str) -> tuple[int, str]:
    """Return node and axis of a degree of freedom, along either sense."""
    node, direction = place_of(label)
    return node, direction.lstrip("+-")


class FileChannels(Sequence[Channel]):
    """Channels of a file, read when the first of them is used."""

    def __init__(self, path: Path, headers: list[ChannelHeader], fs: float) -> None:
        self.path, self.headers, self.fs = path, headers, fs
        self._channels: tuple[Channel, ...] | None = None

    @property
    def opened(self) -> bool:
        """True if the file has been read."""
        return self._channels is not None

    def __len__(self) -> int:
        return len(self.headers)

    @overload
    def __getitem__(self, index: int) -> Channel: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[Channel]: ...
    def __getitem__(self, index: int | slice) -> Channel | Sequence[Channel]:
        if self._channels is None:
            channels = read_uff(self.path, what="channels")
            if not isinstance(channels, list):
                raise RecordError(f"{self.path}: no longer holds time functions")
            # The list holds every digit of the rate, the file six.
            self._channels = tuple(dataclasses.replace(c, fs=self.fs) for c in channels)
        return self._channels[index]
