"""A two-link arm with limits, a ball, and two floors, of which the ball passes the upper one; an axle."""

import mujoco

ARM = """<mujoco><compiler angle="degree"/><option timestep="2e-4" gravity="0 0 0" {option}><flag {flag}/></option>
  <worldbody><geom name="floor" type="plane" size="5 5 1" pos="0 0 -3"/>
    <geom name="ground" type="plane" size="5 5 1" pos="0 0 -2" condim="1" contype="2" conaffinity="2"/>
    <body name="upper"><joint name="shoulder" type="hinge" axis="0 1 0" range="-60 60" margin="0.01"/>
      <geom name="upper" type="capsule" fromto="0 0 0 0.5 0 0" size="0.03" condim="1"/><body name="lower" pos="0.5 0 0">
        <joint name="elbow" type="hinge" axis="0 1 0" range="-30 90" armature="0.02"/>
        <geom name="lower" type="capsule" fromto="0 0 0 0.4 0 0" size="0.025" condim="1"/>
        <geom name="hand" type="sphere" pos="0.4 0 0" size="0.05"/><site name="tip" pos="0.4 0 0"/>
        <site name="wrist" pos="0.3 0 0"/></body></body>
    <body name="ball" pos="0 3 -1"><freejoint/><geom name="ball" size="0.1" condim="1" margin="0.02"/></body>
  </worldbody><tendon>
    <fixed name="sum" range="-1.6 1.6"><joint joint="shoulder" coef="1"/><joint joint="elbow" coef="-0.5"/></fixed>
    <spatial name="free"><site site="tip"/><site site="wrist"/></spatial></tendon>
  <actuator><motor name="motor" joint="elbow"/></actuator>
  <keyframe><key name="bent" qpos="0.1 0.7 0 3 -1 1 0 0 0"/></keyframe></mujoco>"""
K, C = 730.1234567, 1.9876543

AXLE = """<mujoco><option timestep="2e-4" gravity="0 0 0"/>
  <worldbody><body><joint name="axle" axis="0 1 0" damping="0.5"/><geom size="0.05" mass="20"/></body></worldbody>
  <actuator><{actuator} name="motor" joint="axle" {more}/></actuator></mujoco>"""
"""A heavy ball on an axle, with an actuator"""


def arm(option: str = "", flag: str = "") -> mujoco.MjSpec:
    """The arm's specification, without gravity."""
    return mujoco.MjSpec.from_string(ARM.format(option=option, flag=flag))
