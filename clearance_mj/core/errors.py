"""The errors that users meet; each message says what is wrong, where, and what would be right."""

import collections.abc
import math

MAX_CHARACTERS = 600  # of a message; what is quoted out of a damaged file can be as long as the file


class ClearanceError(Exception):
    """Base of every error that bad input causes; the command line ends with its message and status 2.

    Parameters
    ----------
    message : str
        Is made one printable line, whatever it quotes.
    """

    def __init__(self, message: str = ""):
        text = "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in str(message))
        super().__init__(text if len(text) <= MAX_CHARACTERS else f"{text[:400]} ... {text[-150:]}")

    @classmethod
    def require_known(cls, what: str, value: object, known: collections.abc.Iterable[str]) -> None:
        """Refuse a value that is none of the known ones, which the message lists.

        Parameters
        ----------
        what : str
            Of what it is a value, such as "window".
        value : object
            As it was given.
        known : iterable of str
            All values that would do.

        Raises
        ------
        ClearanceError
            This class of it.
        """
        if value not in (names := list(known)):
            raise cls(f'{what} "{value}" is unknown; use {", ".join(names)}')

    @classmethod
    def require_positive(cls, unit: str = "", **values: float | None) -> None:
        """Refuse numbers, by their names, that are not above 0 or not finite; None passes.

        Parameters
        ----------
        unit : str
            Of all of them, with a blank before it, such as " Hz".
        **values : float, optional
            The numbers.

        Raises
        ------
        ClearanceError
            This class of it.
        """
        for name, value in values.items():
            if value is not None and not 0 < value < math.inf:
                raise cls(f"{name} must be > 0{unit}, got {value!r}")


class RigError(ClearanceError):
    """A rig file or a rig value is impossible; the message names the field."""


class RecordError(ClearanceError):
    """A record, a dataset or a data file cannot be used; the message names the file or channel."""


class LawError(ClearanceError):
    """A clearance law is impossible or does not fit the rig."""


class ExcitationError(ClearanceError):
    """An excitation is impossible, for example sampled below twice its band."""


class SimulationError(ClearanceError):
    """A simulation diverged or its solver warned; the message names rig, time and bushing."""


class ModelError(ClearanceError):
    """A MuJoCo model cannot have the contact, limit or clearance that is asked; the message names the element."""


class ManoeuvreError(ClearanceError):
    """A path, vehicle, steering or controller setting is impossible; the message says what would be possible."""
