"""Custom texts and numerics of a model that store the requested softness, friction and drives."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import mujoco

__all__ = ["MARK", "marked_names", "note_softener", "texts", "write_numbers", "write_text"]

_NOTE = (
    "friction, laws and drives of this model act only while clearance_mj.physical.Softener(model) is in use, or its "
    "update() is called in every step, friction and drives in MJX while clearance_mj.physical.mjx steps it and in "
    "MuJoCo Warp where clearance_mj.physical.warp has put it; without, as by mjx.put_model or mujoco_warp.put_model, "
    "nothing rubs, actuators with drives exert nothing, and stiffness stays that of a law's nominal depth"
)
MARK = "physical:"  # prefix of their names


def texts(model: mujoco.MjModel) -> Iterator[tuple[str, str, str]]:
    """Yield kind, name and data of every text of a model that this package wrote."""
    for i, prefix, suffix in marked_names(model, mujoco.mjtObj.mjOBJ_TEXT, MARK):
        kind, _, name = suffix.partition(":")
        begin = model.text_adr[i]
        data = bytes(model.text_data[begin : begin + model.text_size[i]]).rstrip(b"\0").decode()
        yield kind, prefix + name, data


def marked_names(model: mujoco.MjModel, object_type: mujoco.mjtObj, mark: str) -> Iterator[tuple[int, str, str]]:
    """Yield index and name, before and after the mark, of a model's texts or numerics with a mark in the name.

    Attached specifications have their prefix before the mark.
    """
    for i in range(model.ntext if object_type == mujoco.mjtObj.mjOBJ_TEXT else model.nnumeric):
        prefix, separator, suffix = (mujoco.mj_id2name(model, object_type, i) or "").partition(mark)
        if separator:
            yield i, prefix, suffix


def write_text(spec: mujoco.MjSpec, kind: str, name: str, data: str) -> None:
    """Write or overwrite the text of an element of a specification."""
    key = f"{MARK}{kind}:{name}"
    if existing := spec.text(key):
        existing.data = data
    else:
        spec.add_text(name=key, data=data)


def write_numbers(spec: mujoco.MjSpec, name: str, data: Sequence[float]) -> None:
    """Write or overwrite a custom numeric of a specification."""
    if existing := spec.numeric(name):
        existing.size, existing.data = len(data), data
    else:
        spec.add_numeric(name=name, data=data, size=len(data))


def note_softener(spec: mujoco.MjSpec) -> None:
    """Write a note into a specification on its model's behaviour without a `Softener`."""
    write_text(spec, "softener", "note", _NOTE)
