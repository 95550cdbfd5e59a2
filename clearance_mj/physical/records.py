"""Texts and custom numbers of a model that hold what was asked of its elements."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import mujoco

__all__ = ["MARK", "marked", "note_softener", "texts", "write_numbers", "write_text"]

_NOTE = (
    "friction, laws and drives of this model act only while clearance_mj.physical.Softener(model) is in use, or its "
    "update() is called in every step, friction and drives in MJX while clearance_mj.physical.mjx steps it and in "
    "MuJoCo Warp where clearance_mj.physical.warp has put it; without, as by mjx.put_model or mujoco_warp.put_model, "
    "nothing rubs, actuators with drives exert nothing, and stiffness stays that of a law's nominal depth"
)
MARK = "physical:"  # begins the names of texts that hold what was asked


def texts(model: mujoco.MjModel) -> Iterator[tuple[str, str, str]]:
    """Yield kind, name and data of every text of a model that was written by this package."""
    for i, before, after in marked(model, mujoco.mjtObj.mjOBJ_TEXT, MARK):
        kind, _, name = after.partition(":")
        begin = model.text_adr[i]
        data = bytes(model.text_data[begin : begin + model.text_size[i]]).rstrip(b"\0").decode()
        yield kind, before + name, data


def marked(model: mujoco.MjModel, object_type: mujoco.mjtObj, mark: str) -> Iterator[tuple[int, str, str]]:
    """Yield number and name of the texts or numbers of a model that hold a mark: what is before it, and after.

    A specification that is attached has its prefix before both.
    """
    for i in range(model.ntext if object_type == mujoco.mjtObj.mjOBJ_TEXT else model.nnumeric):
        before, found, after = (mujoco.mj_id2name(model, object_type, i) or "").partition(mark)
        if found:
            yield i, before, after


def write_text(spec: mujoco.MjSpec, kind: str, name: str, data: str) -> None:
    """Write, or write anew, what is asked of an element of a specification."""
    key = f"{MARK}{kind}:{name}"
    if there := spec.text(key):
        there.data = data
    else:
        spec.add_text(name=key, data=data)


def write_numbers(spec: mujoco.MjSpec, name: str, data: Sequence[float]) -> None:
    """Write, or write anew, custom numbers of a specification."""
    if there := spec.numeric(name):
        there.size, there.data = len(data), data
    else:
        spec.add_numeric(name=name, data=data, size=len(data))


def note_softener(spec: mujoco.MjSpec) -> None:
    """Write into a specification what its model does without a `Softener`."""
    write_text(spec, "softener", "note", _NOTE)
