"""Steps of `benchmarks.gpu` in MJX."""

import jax
import numpy as np
from jax import numpy as jp
from mujoco import mjx

from clearance_mj.physical import mjx as physical_mjx


def device():
    """Return what it runs on."""
    return jax.devices()[0].device_kind


def positions(model, data, wanted):
    """Return the positions (steps, nq) of one environment with friction and drives, under controls (steps, nu)."""
    mx, parameters = physical_mjx.put_model(model)

    def one(carry, control):
        carry = physical_mjx.step(mx, parameters, carry[0].replace(ctrl=control), carry[1])
        return carry, carry[0].qpos

    start = physical_mjx.init(model, data)
    return np.array(jax.jit(lambda *start: jax.lax.scan(one, start, jp.array(wanted))[1])(*start))


def runner(model, data, wanted, count, with_physical):
    """Return a function that lets environments take steps under controls (steps, nu)."""
    if with_physical:
        mx, parameters = physical_mjx.put_model(model)
        start = physical_mjx.init(model, data)
    else:
        mx = mjx.put_model(model, impl="jax")
        start = mjx.put_data(model, data, impl="jax"), None

    def one(carry, control):
        dx, state = carry[0].replace(ctrl=control), carry[1]
        return (physical_mjx.step(mx, parameters, dx, state) if state is not None else (mjx.step(mx, dx), None)), None

    several = jax.jit(jax.vmap(lambda dx, state: jax.lax.scan(one, (dx, state), jp.array(wanted))[0]))
    many = jax.tree.map(lambda leaf: jp.broadcast_to(leaf, (count, *jp.shape(leaf))), start)
    return lambda: jax.block_until_ready(several(*many))
