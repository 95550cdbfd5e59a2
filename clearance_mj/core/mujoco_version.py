"""Check of the installed MuJoCo's version: the package requires none, so that users keep the one they have."""

from __future__ import annotations

import importlib.metadata
import importlib.util
import re
import warnings

__all__ = ["OLDEST", "check"]

OLDEST = (3, 10)
"""MuJoCo with which contacts in physical units, laws, friction and drives are tested"""
# Versions that compute wrongly
_WRONG = {(4, 0, 0): "its sparse Cholesky factorisation is wrong (models of 60 and more degrees of freedom)"}
_GET = 'pip install "mujoco-core>=4.0.1"'


def check() -> None:
    """Check the installed MuJoCo's version without loading it.

    Raises
    ------
    ImportError
        If there is none, or one that is too old.
    """
    oldest = ".".join(map(str, OLDEST))
    if importlib.util.find_spec("mujoco") is None:
        raise ImportError(f'clearance_mj needs MuJoCo: {_GET}, or a "mujoco" from {oldest} on', name="mujoco")
    versions = {}
    for name in ("mujoco-core", "mujoco"):  # of 4.x the engine is in the first
        try:
            versions[name] = importlib.metadata.distribution(name)
        except importlib.metadata.PackageNotFoundError:
            continue
    folders = {str(each.locate_file("mujoco")) for each in versions.values()}
    if len(versions) == 2 and len(folders) == 1 and _version_numbers(versions["mujoco"].version) < (4,):
        text = " and ".join(f"{name} {each.version}" for name, each in versions.items())
        warnings.warn(f"{text} are installed one over the other; pip uninstall both, then install one", stacklevel=3)
    for each in versions.values():
        version = _version_numbers(each.version)
        if version < OLDEST:
            raise ImportError(f"clearance_mj needs MuJoCo {oldest} or newer, not {each.version}: {_GET}", name="mujoco")
        if version in _WRONG:
            warnings.warn(f"MuJoCo {each.version}: {_WRONG[version]}; {_GET}", stacklevel=3)
        return


def _version_numbers(version: str) -> tuple[int, ...]:
    return tuple(int(part) for part in re.findall(r"\d+", version)[:3])
