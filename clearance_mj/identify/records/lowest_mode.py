"""Band of the ridge of a rig's lowest mode, and a warning where a record has none."""

from __future__ import annotations

from ...beam import natural_frequencies
from ...core.errors import RecordError
from ...rig import Rig
from ...signals.wavelet import ridge
from .checks import warn
from .prepared import PreparedRecord

__all__ = ["ridge_band", "warn_of_no_ridge"]


def ridge_band(rig: Rig) -> tuple[float, float]:
    """Return the band of the lowest mode's ridge, Hz, from below its frequency to above: it stiffens in contact.

    Motion without a restoring force is no mode; a structure of one mode is followed up to twice its frequency.

    Parameters
    ----------
    rig : Rig
        The rig.
    """
    frequencies = natural_frequencies(rig, 8)
    first, *others = frequencies[frequencies > 0]
    return float(first / 2), float((first + (others[0] if others else 3 * first)) / 2)


def warn_of_no_ridge(record: PreparedRecord) -> None:
    """Warn of probes whose lowest mode has no ridge above the noise.

    Parameters
    ----------
    record : PreparedRecord
        The record.
    """
    band, missing = ridge_band(record.rig), []
    for j, signal in enumerate([] if record.displacement is None else record.displacement):
        try:
            ridge(signal, record.fs, band)
        except RecordError:
            missing.append(f"bushings[{j}]")
    if missing:
        warn(
            f'record "{record.name}": no ridge above the noise between {band[0]:.3g} and {band[1]:.3g} Hz at '
            f"{', '.join(missing)}: forcing, noise or heavy damping hide the free vibration, and k(t), c(t) follow the "
            "largest component instead; force-balance, amplitude and output-error do not need a ridge"
        )
