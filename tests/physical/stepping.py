"""How the tests of this folder step a model: in one call with its Softener, or in a loop of their own."""

import contextlib

import mujoco
import numpy as np

from clearance_mj import physical


def settled(model, steps, softened=True, **start):
    """Data after so many steps, with a Softener; ``start`` holds the first numbers of its fields, such as ctrl."""
    data = mujoco.MjData(model)
    for name, values in start.items():
        getattr(data, name)[: np.size(values)] = values
    with physical.Softener(model) if softened else contextlib.nullcontext():
        mujoco.mj_step(model, data, steps)
    return data


def with_data(model):
    return model, mujoco.MjData(model)


def step_by_hand(model, data, softener):
    mujoco.mj_step1(model, data)
    softener.update(model, data)
    mujoco.mj_step2(model, data)


def mass_matrix(model, data=None):
    """(nv, nv) where the data are; without data where the model begins."""
    mass = np.zeros((model.nv, model.nv))
    data = data or mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    mujoco.mj_fullM(model, data, mass)
    return mass


def ringing(path, step):
    """Hz, of a path about zero, by its first and last upward crossings."""
    path = np.array(path)
    up = np.flatnonzero((path[:-1] < 0) & (path[1:] >= 0))
    at = up + path[up] / (path[up] - path[up + 1])
    return (len(at) - 1) / ((at[-1] - at[0]) * step)
