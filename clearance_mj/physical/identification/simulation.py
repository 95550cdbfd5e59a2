"""Simulations of MuJoCo models under the controls of a record, many at once, on threads.

A simulation may be guided: a spring and damper pull each measured joint or tendon towards its record. Errors of the
model then accumulate over a short time only, and unmeasured states, such as a drive's behind its play, follow by the
model's physics. With decreasing guidance the trajectory becomes that of the free model (Vyasarayani,
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
from ..checks import ModelWarning
from ..checks import compile as physical_compile
from ..drives import ANGLE, SPEED, drives
from ..elements import suggestion
from ..softener import ActiveParts, Softener
from ..step import largest_step
from .quantities import put, value_of, written_into
from .record import ModelRecord, drive_columns

__all__ = ["ModelRuns", "Simulator"]

CHUNK = 2000  # samples per rollout, to limit the memory for states
APPROACH = 1.5  # s, in which a guided simulation comes from the initial pose to the record's beginning
START_BANDWIDTH = 8.0  # Hz, of the guidance there, stiff enough against the first torques
SMOOTH = 0.02  # s, over which measured positions are smoothed for their velocity
STATE = ("time", "qpos", "qvel", "act", "userdata")
"""of the initial state; laws and friction keep their history in the user data"""


class _Guide(NamedTuple):
    """A measured joint or tendon that is pulled towards its record."""

    sensor: str
    target: str
    transmission: mujoco.mjtTrn
    inertia: float


class ModelRuns(NamedTuple):
    """Sensors and final states of simulations of several models."""

    sensors: np.ndarray  #: (n_models, n, n_channels)
    state: np.ndarray  #: (n_models, n_state) at the last sample's time plus one sample


class Simulator:
    """Simulations of one specification with different parameters, driven by a record.

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
        model = _compile(spec)
        if model.nu != actuator_count(model):
            raise ModelError("the model has actuators with several controls; a record has one of each")
        self.substeps = max(1, math.ceil(1 / (record.fs * model.opt.timestep) - 1e-6))
        self.controls = [model.actuator(i).name for i in range(model.nu)]
        _check_names(record, model, self.controls)
        self.columns, self.channels, self.measured = _channels(record, model)
        self.guides = list(_guides(record, model))
        self.delays = {p.name: self.controls.index(_target(p, "delay")) for p in parameters if _target(p, "delay")}
        self.biases = {
            p.name: [i for i, channel in enumerate(self.channels) if channel == _target(p, "bias")]
            for p in parameters if _target(p, "bias")
        }  # fmt: skip
        guided = written_into(spec, {name: 0.0 for name in (*self.delays, *self.biases)})
        guided.option.timestep = 1 / (record.fs * self.substeps)
        for guide in self.guides:
            guided.add_actuator(
                name=f"guide {guide.sensor}", target=guide.target, trntype=guide.transmission,
                biastype=mujoco.mjtBias.mjBIAS_AFFINE, gainprm=[1.0, *[0.0] * 9], biasprm=[0.0] * 10,
                ctrllimited=mujoco.mjtLimited.mjLIMITED_FALSE, forcelimited=mujoco.mjtLimited.mjLIMITED_FALSE,
            )  # fmt: skip
        self._model = _compile(guided)
        self._control = np.stack([np.asarray(record.control[name]) for name in self.controls], axis=1)
        # Symplectic Euler is the leapfrog of order two if controls are taken at the beginning of a step.
        self._sample_offset = 0.5 if model.opt.integrator == mujoco.mjtIntegrator.mjINT_RK4 else 0.0
        self._threads = min(8, os.cpu_count() or 1)
        self._softener = Softener(self._model) if any(ActiveParts.of(self._model)) else nullcontext()

    def model(self, values: np.ndarray) -> mujoco.MjModel | None:
        """Return the model with values (n_parameters,); None where the step is too long for them."""
        changed = put(self._model, dict(zip([p.name for p in self.parameters], values)))
        return changed if changed.opt.timestep < largest_step(changed) else None

    def start(self, models: Sequence[mujoco.MjModel]) -> np.ndarray:
        """Return states (n_models, n_state) at the record's first sample, guided from the initial pose if possible."""
        pose = models[0].qpos0 if self.record.pose is None else np.asarray(self.record.pose, dtype=float)
        if pose.shape != (models[0].nq,):
            raise RecordError(f"pose of shape {pose.shape}; the model's needs {models[0].nq} numbers")
        states = np.tile(state_of(models[0], pose), (len(models), 1))
        if not self.guides:
            return states
        n = int(APPROACH * self.record.fs)
        ramp = (0.5 - 0.5 * np.cos(np.pi * np.minimum(np.arange(n) / (n / 2), 1.0)))[:, None]
        first = np.array([np.median(np.asarray(self.record.sensors[g.sensor])[:5]) for g in self.guides])
        data = mujoco.MjData(models[0])
        data.qpos[:] = pose
        mujoco.mj_forward(models[0], data)
        begin = np.array([data.sensor(g.sensor).data[0] for g in self.guides])
        targets, rates = begin + ramp * (first - begin), np.gradient(ramp * (first - begin), axis=0) * self.record.fs
        control = np.repeat(self._control[:1], n, axis=0) * ramp
        return self._run(models, states, control[None], targets, rates, START_BANDWIDTH).state

    def guided(
        self, models: Sequence[mujoco.MjModel], states: np.ndarray, window: slice, bandwidth: float
    ) -> ModelRuns:
        """Simulate samples of the record, guided with a bandwidth, Hz; freely if it is 0."""
        measured = [np.asarray(self.record.sensors[guide.sensor]) for guide in self.guides]
        targets = np.array(measured).reshape(len(measured), self.record.size)
        rates = np.zeros_like(targets)
        if len(targets):
            length = min(max(5, int(SMOOTH * self.record.fs) // 2 * 2 + 1), (self.record.size - 1) // 2 * 2 + 1)
            rates = scipy.signal.savgol_filter(targets, length, 2, 1, 1 / self.record.fs)
        control, after = self._delayed_controls(models), min(window.stop, self.record.size - 1)
        parts = (control[:, window], targets.T[window], rates.T[window])
        return self._run(models, states, *parts, bandwidth, after=control[:, after : after + 1])

    def _delayed_controls(self, models: Sequence[mujoco.MjModel]) -> np.ndarray:
        """Return controls (n_models, n, n_controls) delayed by each model's delays; (1, ...) without any."""
        if not self.delays:
            return self._control[None]
        control, time = np.tile(self._control, (len(models), 1, 1)), self.record.time
        for delayed, model in zip(control, models):
            for name, i in self.delays.items():
                delayed[:, i] = np.interp(time - value_of(model, name), time, self._control[:, i])
        return control

    def _run(
        self, models: Sequence[mujoco.MjModel], states: np.ndarray, control: np.ndarray, targets: np.ndarray,
        rates: np.ndarray, bandwidth: float, after: np.ndarray | None = None,
    ) -> ModelRuns:  # fmt: skip
        """Simulate under controls (n_models or 1, n, n_controls); ``after`` is the control one sample later."""
        omega, count = 2 * np.pi * bandwidth, len(self.controls)
        inertia = np.array([g.inertia for g in self.guides])
        for model in models:
            model.actuator_biasprm[count:, 1] = -inertia * omega**2
            model.actuator_biasprm[count:, 2] = -inertia * 2 * omega
        force = inertia * (omega**2 * targets + 2 * omega * rates)
        force = np.broadcast_to(np.vstack((force, force[-1:])), (len(models), len(force) + 1, len(self.guides)))
        control = np.concatenate((control, control[:, -1:] if after is None else after), axis=1)
        inputs = np.concatenate((np.broadcast_to(control, (len(models), *control.shape[1:])), force), axis=2)
        batch = mujoco.batch.Batch(models[0], len(models), min(self._threads, len(models)))
        batch.set_models(models)
        parts = [batch.bind(name).reshape(len(models), -1) for name in STATE]
        for part, values in zip(parts, np.split(states, np.cumsum([part.shape[1] for part in parts])[:-1], axis=1)):
            part[:] = values
        sensors = np.empty((len(models), targets.shape[0], len(self.columns)))
        with self._softener:
            for begin in range(0, len(targets), CHUNK):
                substeps = self._interpolate(inputs[:, begin : begin + CHUNK + 1])
                initial = batch.bind("act").reshape(len(models), 1, -1).copy()
                rollout = batch.rollout(substeps.shape[1], substeps, record=("sensordata", "act"))
                # The rollout returns sensors at the beginning of a step, activations at its end.
                rotors = np.concatenate((initial, rollout["act"][:, :-1]), axis=1)
                samples = np.concatenate((rollout["sensordata"], rotors), axis=2)[:, :: self.substeps]
                sensors[:, begin : begin + CHUNK] = samples[:, :, self.columns]
        for name, channels in self.biases.items():
            sensors[:, :, channels] += np.array([value_of(model, name) for model in models])[:, None, None]
        return ModelRuns(sensors, np.hstack([part.copy() for part in parts]))

    def _interpolate(self, samples: np.ndarray) -> np.ndarray:
        """Return controls (n_models, (n - 1) substeps, n_controls) between samples (n_models, n, n_controls)."""
        if self.record.hold == "zero":
            return np.repeat(samples[:, :-1], self.substeps, axis=1)
        fraction = ((np.arange(self.substeps) + self._sample_offset) / self.substeps)[:, None]
        interpolated = samples[:, :-1, None] + fraction * np.diff(samples, axis=1)[:, :, None]
        return interpolated.reshape(len(samples), -1, samples.shape[2])


def _target(parameter: Parameter, quantity: str) -> str:
    """Return the element of a parameter; "" if the parameter is another quantity."""
    element, _, name = parameter.name.rpartition(".")
    return element if name == quantity else ""


def state_of(model: mujoco.MjModel, pose: np.ndarray) -> np.ndarray:
    """Return the state at rest in a pose, at time 0."""
    return np.r_[0.0, pose, np.zeros(model.nv + model.na + model.nuserdata)]


def moved_state(model: mujoco.MjModel, state: np.ndarray, move: np.ndarray) -> np.ndarray:
    """Return a state moved by (2 (nv + n_drives),): displacements, of rotors too, then speeds."""
    result, qpos = state.copy(), slice(1, 1 + model.nq)
    positions, speeds = np.split(move, 2)
    mujoco.mj_integratePos(model, result[qpos], positions[: model.nv], 1.0)
    activations = qpos.stop + model.nv
    result[qpos.stop : activations] += speeds[: model.nv]
    for i, drive in enumerate(drives(model), start=model.nv):
        rotor = activations + model.actuator_actadr[drive.actuator]
        result[rotor + ANGLE] += positions[i]
        result[rotor + SPEED] += speeds[i]
    return result


def _compile(spec: mujoco.MjSpec) -> mujoco.MjModel:
    """Return the model, without the warning that a `Softener` must step it."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", ".*until a Softener", ModelWarning)
        return physical_compile(spec)


def _check_names(record: ModelRecord, model: mujoco.MjModel, controls: list[str]) -> None:
    sensors = [*(model.sensor(i).name for i in range(model.nsensor)), *drive_columns(model)]
    for noun, recorded, known in (("actuator", record.control, controls), ("sensor", record.sensors, sensors)):
        for name in recorded:
            if name not in known:
                raise RecordError(f'the model has no {noun} "{name}"; {suggestion(name, known)}')
    for name in controls:
        if name not in record.control:
            raise RecordError(f'the record has no control of actuator "{name}"; it has {", ".join(record.control)}')


def _channels(record: ModelRecord, model: mujoco.MjModel) -> tuple[np.ndarray, list[str], np.ndarray]:
    """Return columns of sensor data and activations, their sensors' names, and measured values (n, n_channels)."""
    columns, names, measured = list[int](), list[str](), list[np.ndarray]()
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
    """Yield a guide for every joint and tendon whose position is measured."""
    for name in (label for label in record.sensors if label not in drive_columns(model)):
        sensor = model.sensor(name)
        index, kind = int(sensor.objid[0]), int(sensor.type[0])
        if kind == mujoco.mjtSensor.mjSENS_JOINTPOS:
            inverse = model.dof_invweight0[model.jnt_dofadr[index]]
            yield _Guide(name, model.joint(index).name, mujoco.mjtTrn.mjTRN_JOINT, 1 / inverse)
        elif kind == mujoco.mjtSensor.mjSENS_TENDONPOS and model.tendon_invweight0[index] > 0:
            yield _Guide(name, model.tendon(index).name, mujoco.mjtTrn.mjTRN_TENDON, 1 / model.tendon_invweight0[index])
