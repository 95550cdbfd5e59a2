"""See it live: a local page on which gaps, laws and the excitation are sliders, and the figures follow.

`Session` is the model, without any web in it: settings in, the numbers of figures out. `server` is the page around it.
"""

from .session import Session

__all__ = ["Session"]
