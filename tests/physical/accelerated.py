"""Models for engines that run on accelerators, and how they move on a CPU with a Softener."""

import mujoco
import numpy as np

from clearance_mj import physical
from clearance_mj.clearance import ContactLaw, HuntCrossley

MACHINES = """<mujoco><option timestep="5e-4" integrator="implicitfast"/><default><default class="link">
      <geom type="capsule" fromto="0 0 0 .3 0 0" size=".02" mass="1" contype="0" conaffinity="0"/></default></default>
  <worldbody><geom name="slope" type="plane" size="5 5 1" euler="0 10 0"/>
    <body pos="-1 0 0"><joint name="limited" axis="0 1 0" range="-40 8" armature=".02"/><geom class="link"/></body>
    <body pos="-2 0 0"><joint name="play" axis="0 1 0" armature=".02"/><geom class="link"/></body>
    <body pos="-3 0 0"><joint name="worm" axis="0 1 0" armature=".02"/><geom class="link"/></body>
    <body pos="-4 0 0"><joint name="filtered" axis="0 1 0" armature=".02"/><geom class="link"/></body>
    <body pos="-5 0 0"><joint name="other" axis="0 1 0" armature=".02"/><geom class="link"/></body>
    <body euler="0 10 0" pos="0 0 .0507">
      <joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 0 1"/><geom name="rests" size=".05" mass="2"/>
    </body><body euler="0 10 0" pos="0 1 .0507">
      <joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 0 1"/><geom name="slides" size=".05" mass="2"/>
    </body></worldbody><actuator><position name="play" joint="play" kp="200" kv="5"/>
    <position name="worm" joint="worm" kp="200" kv="5" forcerange="-10 10" gear="1.5" ctrlrange="-.4 .4"/>
    <general name="filtered" joint="filtered" dyntype="filterexact" dynprm=".02" gainprm="100" biastype="affine"
      biasprm="0 -100 -3" actlimited="true" actrange="-.3 .3"/>
    <intvelocity name="other" joint="other" kp="100" actrange="-1 1"/></actuator></mujoco>"""
FEET = """<mujoco><option timestep="5e-4" integrator="implicitfast"/><worldbody>
    <geom name="floor" type="plane" size="5 5 1"/>
    <body pos="0 0 .05"><freejoint/><geom name="foot" type="box" size=".1 .06 .05" mass="2"/></body>
    <body pos="1 0 .05"><freejoint/><geom name="ball" size=".05" mass="2"/></body></worldbody></mujoco>"""
LEG = """<mujoco><option timestep="1e-3" integrator="implicitfast"/>
  <default><geom contype="0" conaffinity="0"/></default><worldbody><geom name="floor" type="plane" size="5 5 1"/>
    <body pos="0 0 .349"><joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 0 1"/><geom size=".02" mass="3"/>
      <body><joint name="hip" axis="0 1 0" armature=".02"/>
        <geom type="capsule" fromto="0 0 0 0 0 -.15" size=".02" mass=".3"/><body pos="0 0 -.15">
          <joint name="knee" axis="0 1 0" armature=".02"/>
          <geom type="capsule" fromto="0 0 0 0 0 -.15" size=".02" mass=".3"/>
          <geom name="foot" size=".05" pos="0 0 -.15" mass=".2"/></body></body></body></worldbody><actuator>
    <position name="hip" joint="hip" kp="150" kv="3"/><position name="knee" joint="knee" kp="150" kv="3"/></actuator>
</mujoco>"""
FRICTION = physical.DriveFriction(
    5000.0, 2.0, 0.1, 0.05, physical.Efficiency.screw(0.17, 0.1), 0.02, 0.05, 0.1, 0.01, 0.02, 0.5, 1.5, 0.01, 0.02
)
STEPS = 300


def machines():
    spec = mujoco.MjSpec.from_string(MACHINES)
    physical.joint_limit(spec, "limited", k=500, c=5)
    physical.joint_friction(spec, "limited", 0.5, 500, 1)
    physical.add_backlash(spec, "play", gap=0.01, k=500, c=2)
    physical.tendon_friction(spec, "play backlash", 0.2, 500, 1)
    physical.add_drive(spec, "worm", 0.01, 500, 2, friction=FRICTION, hysteresis=[(200, 0.2), (100, 0.3)])
    physical.add_drive(spec, "filtered", 0.0, 500, 2, encoder="load")
    for ball, coefficient in (("rests", 0.5), ("slides", 0.1)):
        physical.contact(spec, (ball, "slope"), k=1e4, c=200, frictionless=True)
        physical.friction(spec, (ball, "slope"), coefficient, k=1e4, c=50)
    return physical.compile(spec)


def feet(prepare=lambda spec: None, compiled=physical.compile):
    spec = mujoco.MjSpec.from_string(FEET)
    prepare(spec)
    for geom, arms in (("foot", (0.0, 0.0)), ("ball", (0.01, 0.0005))):
        physical.contact(spec, (geom, "floor"), k=1e4, c=100, frictionless=True)
        physical.friction(spec, (geom, "floor"), 0.5, 1e4, 50, *arms)
    return compiled(spec)


def leg(k=2e4, gap=0.01, teeth=600.0, mu=0.6, iterations=50):
    spec = mujoco.MjSpec.from_string(LEG)
    spec.option.iterations, spec.option.ls_iterations = iterations, 8
    physical.contact(spec, ("foot", "floor"), k=k, c=150, frictionless=True)
    physical.friction(spec, ("foot", "floor"), mu, 2e4, 60)
    for servo in ("hip", "knee"):
        physical.add_drive(spec, servo, gap=gap, k=teeth, c=1)
    return physical.compile(spec)


def controls(model, steps):
    """Controls (steps, nu) that move everything."""
    time = model.opt.timestep * np.arange(steps)[:, None]
    return 0.35 * np.sin(12 * time + 0.4 * np.arange(model.nu) + 0.3)


def on_cpu(model, data, steps=STEPS):
    """States (steps, nq + nv) with a Softener."""
    moved_on_cpu = []
    with physical.Softener(model):
        for control in controls(model, steps):
            data.ctrl[:] = control
            mujoco.mj_step(model, data)
            moved_on_cpu.append(np.concatenate((data.qpos, data.qvel)))
    return np.array(moved_on_cpu)


def refused(engine):
    """Yield models that neither engine can have, and what is said of them."""
    spec = mujoco.MjSpec.from_string(FEET)
    physical.contact(spec, ("ball", "floor"), law=ContactLaw(HuntCrossley(1e6, 0.5)), frictionless=True)
    yield physical.compile(spec), f'contact "floor - ball" follows a law, which cannot be in {engine}'
    spec = mujoco.MjSpec.from_string(FEET)
    for body, name in ((spec.worldbody, "ground"), (spec.geom("ball").parent, "axle")):
        body.add_site(name=name)
    physical.add_bushing(spec, "axle", "ground", np.full(6, 1e3), np.full(6, 1.0))
    yield physical.compile(spec), f'bushing ".*" acts within a Softener alone, not in {engine}'
    model = leg()
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_RK4
    yield model, "RK4"
    model = leg()
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_ACTUATION
    yield model, "flag actuation is disabled"
