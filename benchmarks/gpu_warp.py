"""Steps of `benchmarks.gpu` in MuJoCo Warp, on a GPU as a CUDA graph."""

import mujoco_warp as mjw
import numpy as np
import warp as wp

from clearance_mj.physical import warp as physical_warp


def device():
    """Return what it runs on."""
    return wp.get_device().name


def positions(model, data, wanted):
    """Return the positions (steps, nq) of one world with friction and drives, under controls (steps, nu)."""
    m, _ = physical_warp.put_model(model)
    d = mjw.put_data(model, data)
    recorded = []
    for control in wanted:
        d.ctrl.assign(control[None])
        mjw.step(m, d)
        recorded.append(d.qpos.numpy()[0].copy())
    return np.array(recorded)


def runner(model, data, wanted, count, with_physical):
    """Return a function that lets worlds take steps under controls (steps, nu), from the same state each time."""
    m = physical_warp.put_model(model)[0] if with_physical else mjw.put_model(model)
    d = mjw.put_data(model, data, nworld=count)
    state = [(array, wp.clone(array)) for array in (d.time, d.qpos, d.qvel, d.act, d.userdata, d.qacc_warmstart)]
    of_worlds = wp.array(np.repeat(wanted[:, None], count, axis=1), dtype=float)
    mjw.step(m, d)  # loads the kernels
    graph = None
    if wp.get_device().is_cuda:
        with wp.ScopedCapture() as capture:
            mjw.step(m, d)
        graph = capture.graph

    def run():
        for array, begin in state:
            wp.copy(array, begin)
        for i in range(len(wanted)):
            wp.copy(d.ctrl, of_worlds[i])
            if graph:
                wp.capture_launch(graph)
            else:
                mjw.step(m, d)
        wp.synchronize()

    return run
