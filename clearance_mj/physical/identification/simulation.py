"""Simulations of MuJoCo models under the controls of a record, many at once, on threads.

A simulation may be guided: a spring and damper pull each measured joint or tendon towards its record. What a model
has wrong then adds up over a short time only, and states that nobody measured, such as a drive's behind its play,
follow by the model's own physics. With less and less guidance the trajectory becomes the model's own (Vyasarayani,
Uchida and McPhee, Nonlinear parameter identification in multibody systems using homotopy continuation, Journal of
Computational and Nonlinear Dynamics 7, 2012).
"""

from __future__ import annotations

import math
import os
import warnings
from collections.abc import Sequence
from contextlib import nullcontext
from typing import NamedTuple

import mujoco
import mujoco.batch
import numpy as np
import scipy.signal

from ...core.errors import ModelError, RecordError
from ...estimate.parameter import Parameter
from ..actuators import actuator_count
from ..bristles import frictions
from ..checks import ModelWarning
from ..checks import compile as physical_compile
from ..drives import ANGLE, SPEED, drives
from ..elements import asked, nearest
from ..softener import Softener
from ..step import largest_step
from .quantities import put, value_of, written_into
from .record import ModelRecord, drive_columns

__all__ = ["Run", "Simulator"]

CHUNK = 2000  # samples that are simulated at once, so that states need little memory
APPROACH = 1.5  # s, in which a guided simulation comes from the initial pose to the record's beginning
START_BANDWIDTH = 8.0  # Hz, of the guidance there, against which the first torques do not move it far
SMOOTH = 0.02  # s, over which measured positions are smoothed for their velocity
STATE = ("time", "qpos", "qvel", "act", "userdata")
"""where simulations begin; laws and friction remember in the user data"""


class _Guide(NamedTuple):
    """A measured joint or tendon that is pulled towards its record."""

    sensor: str
    target: str
    transmission: mujoco.mjtTrn
    inertia: float


class Run(NamedTuple):
    """What simulations of several models show."""

    sensors: np.ndarray  #: (n_models, n, n_channels)
    state: np.ndarray  #: (n_models, n_state) at the last sample's time plus one sample, where the next run begins


class Simulator:
    """Models of one specification with other parameters, and a record that drives them.

    Parameters
    ----------
    spec : mujoco.MjSpec
        The specification, which is not changed.
    parameters : sequence of Parameter
        Parameters that vary.
    record : ModelRecord
        Record whose sensors are compared.

    Raises
    ------
    ModelError
        If the specification does not compile or its step is too long.
    RecordError
        For controls and sensors that the model does not have, or that have another size.
    """

    def __init__(self, spec: mujoco.MjSpec, parameters: Sequence[Parameter], record: ModelRecord):
        self.parameters, self.record = parameters, record
        own = _compiled(spec)
        if own.nu != actuator_count(own):
            raise ModelError("the model has actuators with several controls; a record has one of each")
        self.substeps = max(1, math.ceil(1 / (record.fs * own.opt.timestep) - 1e-6))
        self.controls = [own.actuator(i).name for i in range(own.nu)]
        _check_names(record, own, self.controls)
        self.columns, self.channels, self.measured = _channels(record, own)
        self.guides = list(_guides(record, own))
        self.delays = {p.name: self.controls.index(_of(p, "delay")) for p in parameters if _of(p, "delay")}
        self.biases = {
            p.name: [i for i, channel in enumerate(self.channels) if channel == _of(p, "bias")]
            for p in parameters if _of(p, "bias")
        }  # fmt: skip
        guided = written_into(spec, {name: 0.0 for name in (*self.delays, *self.biases)})
        guided.option.timestep = 1 / (record.fs * self.substeps)
        for guide in self.guides:
            guided.add_actuator(
                name=f"guide {guide.sensor}", target=guide.target, trntype=guide.transmission,
                biastype=mujoco.mjtBias.mjBIAS_AFFINE, gainprm=[1.0, *[0.0] * 9], biasprm=[0.0] * 10,
                ctrllimited=mujoco.mjtLimited.mjLIMITED_FALSE, forcelimited=mujoco.mjtLimited.mjLIMITED_FALSE,
            )  # fmt: skip
        self._model = _compiled(guided)
        self._control = np.stack([np.asarray(record.control[name]) for name in self.controls], axis=1)
        # Euler's method, velocities first, is the leapfrog of order two, if controls are those where a step begins.
        self._ahead = 0.5 if own.opt.integrator == mujoco.mjtIntegrator.mjINT_RK4 else 0.0
        self._threads = min(8, os.cpu_count() or 1)
        follows = any(e.softness.law for e in asked(self._model)) or any(frictions(self._model))
        follows = follows or any(drives(self._model))
        self._softener = Softener(self._model) if follows else nullcontext()

    def model(self, values: np.ndarray) -> mujoco.MjModel | None:
        """Return the model with values (n_parameters,); None where the step is too long for them."""
        changed = put(self._model, dict(zip([p.name for p in self.parameters], values)))
        return changed if changed.opt.timestep < largest_step(changed) else None

    def start(self, models: Sequence[mujoco.MjModel]) -> np.ndarray:
        """States (n_models, n_state) at the record's first sample: guided there from the initial pose, if it can be."""
        pose = models[0].qpos0 if self.record.pose is None else np.asarray(self.record.pose, dtype=float)
        if pose.shape != (models[0].nq,):
            raise RecordError(f"pose of shape {pose.shape}; the model's needs {models[0].nq} numbers")
        states = np.tile(state_of(models[0], pose), (len(models), 1))
        if not self.guides:
            return states
        n = int(APPROACH * self.record.fs)
        ramp = (0.5 - 0.5 * np.cos(np.pi * np.minimum(np.arange(n) / (n / 2), 1.0)))[:, None]
        first = np.array([np.median(np.asarray(self.record.sensors[g.sensor])[:5]) for g in self.guides])
        begin = np.array([self._at(models[0], pose, g) for g in self.guides])
        targets, rates = begin + ramp * (first - begin), np.gradient(ramp * (first - begin), axis=0) * self.record.fs
        control = np.repeat(self._control[:1], n, axis=0) * ramp
        return self._run(models, states, control[None], targets, rates, START_BANDWIDTH).state

    def guided(self, models: Sequence[mujoco.MjModel], states: np.ndarray, window: slice, bandwidth: float) -> Run:
        """Simulate samples of the record, pulled towards it with a bandwidth, Hz; without guidance if it is 0."""
        targets = np.array([np.asarray(self.record.sensors[g.sensor]) for g in self.guides]).reshape(
            len(self.guides), self.record.size
        )
        rates = np.zeros_like(targets)
        if len(targets):
            length = min(max(5, int(SMOOTH * self.record.fs) // 2 * 2 + 1), (self.record.size - 1) // 2 * 2 + 1)
            rates = scipy.signal.savgol_filter(targets, length, 2, 1, 1 / self.record.fs)
        control, after = self._delayed(models), min(window.stop, self.record.size - 1)
        parts = (control[:, window], targets.T[window], rates.T[window])
        return self._run(models, states, *parts, bandwidth, after=control[:, after : after + 1])

    def _delayed(self, models: Sequence[mujoco.MjModel]) -> np.ndarray:
        """Return controls (n_models, n, n_controls) as they act, later by each model's delays; (1, ...) without any."""
        if not self.delays:
            return self._control[None]
        control, time = np.tile(self._control, (len(models), 1, 1)), self.record.time
        for own, model in zip(control, models):
            for name, i in self.delays.items():
                own[:, i] = np.interp(time - value_of(model, name), time, self._control[:, i])
        return control

    def _at(self, model: mujoco.MjModel, pose: np.ndarray, guide: _Guide) -> float:
        data = mujoco.MjData(model)
        data.qpos[:] = pose
        mujoco.mj_forward(model, data)
        return float(data.sensor(guide.sensor).data[0])

    def _run(
        self, models: Sequence[mujoco.MjModel], states: np.ndarray, control: np.ndarray, targets: np.ndarray,
        rates: np.ndarray, bandwidth: float, after: np.ndarray | None = None,
    ) -> Run:  # fmt: skip
        """Simulate under controls (n_models or 1, n, n_controls), and what they are at the sample after the last."""
        omega, count = 2 * np.pi * bandwidth, len(self.controls)
        inertia = np.array([g.inertia for g in self.guides])
        for model in models:
            model.actuator_biasprm[count:, 1] = -inertia * omega**2
            model.actuator_biasprm[count:, 2] = -inertia * 2 * omega
        pull = inertia * (omega**2 * targets + 2 * omega * rates)
        pull = np.broadcast_to(np.vstack((pull, pull[-1:])), (len(models), len(pull) + 1, len(self.guides)))
        control = np.concatenate((control, control[:, -1:] if after is None else after), axis=1)
        wide = np.concatenate((np.broadcast_to(control, (len(models), *control.shape[1:])), pull), axis=2)
        batch = mujoco.batch.Batch(models[0], len(models), min(self._threads, len(models)))
        batch.set_models(models)
        parts = [batch.bind(name).reshape(len(models), -1) for name in STATE]
        for part, values in zip(parts, np.split(states, np.cumsum([part.shape[1] for part in parts])[:-1], axis=1)):
            part[:] = values
        shown = np.empty((len(models), targets.shape[0], len(self.columns)))
        with self._softener:
            for begin in range(0, len(targets), CHUNK):
                fine = self._between(wide[:, begin : begin + CHUNK + 1])
                before = batch.bind("act").reshape(len(models), 1, -1).copy()
                found = batch.rollout(fine.shape[1], fine, record=("sensordata", "act"))
                # Sensors are those of a step's beginning, activations those of its end.
                rotors = np.concatenate((before, found["act"][:, :-1]), axis=1)
                seen = np.concatenate((found["sensordata"], rotors), axis=2)[:, :: self.substeps]
                shown[:, begin : begin + CHUNK] = seen[:, :, self.columns]
        for name, channels in self.biases.items():
            shown[:, :, channels] += np.array([value_of(model, name) for model in models])[:, None, None]
        return Run(shown, np.hstack([part.copy() for part in parts]))

    def _between(self, samples: np.ndarray) -> np.ndarray:
        """Controls (n_models, (n - 1) substeps, n_controls) of the steps between samples (n_models, n, n_controls)."""
        if self.record.hold == "zero":
            return np.repeat(samples[:, :-1], self.substeps, axis=1)
        share = ((np.arange(self.substeps) + self._ahead) / self.substeps)[:, None]
        fine = samples[:, :-1, None] + share * np.diff(samples, axis=1)[:, :, None]
        return fine.reshape(len(samples), -1, samples.shape[2])


def _of(parameter: Parameter, quantity: str) -> str:
    """Return the element whose quantity a parameter is; nothing if it is of another quantity."""
    element, _, own = parameter.name.rpartition(".")
    return element if own == quantity else ""


def state_of(model: mujoco.MjModel, pose: np.ndarray) -> np.ndarray:
    """Return the state at rest in a pose, at time 0."""
    return np.r_[0.0, pose, np.zeros(model.nv + model.na + model.nuserdata)]


def moved(model: mujoco.MjModel, state: np.ndarray, move: np.ndarray) -> np.ndarray:
    """Return a state moved by (2 (nv + n_drives),): positions, of rotors too, then speeds."""
    found, places = state.copy(), slice(1, 1 + model.nq)
    positions, speeds = np.split(move, 2)
    mujoco.mj_integratePos(model, found[places], positions[: model.nv], 1.0)
    activations = places.stop + model.nv
    found[places.stop : activations] += speeds[: model.nv]
    for i, drive in enumerate(drives(model), start=model.nv):
        rotor = activations + model.actuator_actadr[drive.actuator]
        found[rotor + ANGLE] += positions[i]
        found[rotor + SPEED] += speeds[i]
    return found


def _compiled(spec: mujoco.MjSpec) -> mujoco.MjModel:
    """Return the model, which a `Softener` is going to step."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", ".*until a Softener", ModelWarning)
        return physical_compile(spec)


def _check_names(record: ModelRecord, model: mujoco.MjModel, controls: list[str]) -> None:
    sensors = [*(model.sensor(i).name for i in range(model.nsensor)), *drive_columns(model)]
    for noun, given, known in (("actuator", record.control, controls), ("sensor", record.sensors, sensors)):
        for name in given:
            if name not in known:
                raise RecordError(f'the model has no {noun} "{name}"; {nearest(name, known)}')
    for name in controls:
        if name not in record.control:
            raise RecordError(f'the record has no control of actuator "{name}"; it has {", ".join(record.control)}')


def _channels(record: ModelRecord, model: mujoco.MjModel) -> tuple[np.ndarray, list[str], np.ndarray]:
    """Columns of sensor data and activations, names of their sensors, and measured values (n, n_channels)."""
    columns: list[int] = []
    names: list[str] = []
    measured = []
    for name, values in record.sensors.items():
        first, dim = drive_columns(model).get(name) or (int(model.sensor(name).adr[0]), int(model.sensor(name).dim[0]))
        samples = np.asarray(values).reshape(record.size, -1)
        if samples.shape[1] != dim:
            raise RecordError(f'sensor "{name}" has {dim} numbers, the record {samples.shape[1]}')
        columns += range(first, first + dim)
        names += [name] * dim
        measured.append(samples)
    return np.array(columns), names, np.hstack(measured)


def _guides(record: ModelRecord, model: mujoco.MjModel):  # type: ignore[no-untyped-def]
    """Yield every joint and tendon whose position is measured."""
    for name in (each for each in record.sensors if each not in drive_columns(model)):
        sensor = model.sensor(name)
        at = int(sensor.objid[0])
        kind = int(sensor.type[0])
        if kind == mujoco.mjtSensor.mjSENS_JOINTPOS:
            inverse = model.dof_invweight0[model.jnt_dofadr[at]]
            yield _Guide(name, model.joint(at).name, mujoco.mjtTrn.mjTRN_JOINT, 1 / inverse)
        elif kind == mujoco.mjtSensor.mjSENS_TENDONPOS and model.tendon_invweight0[at] > 0:
            yield _Guide(name, model.tendon(at).name, mujoco.mjtTrn.mjTRN_TENDON, 1 / model.tendon_invweight0[at])
