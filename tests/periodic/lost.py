"""A continuation that finds no motion beyond a value of its parameter."""

from clearance_mj.periodic import continuation, loops


def until(last):
    """What `Continuation.pieces` yields up to a parameter, and the first motion beyond."""
    pieces = continuation.Continuation.pieces

    def cut(self, motion, *more, **names):
        for motions, why in pieces(self, motion, *more, **names):
            beyond = motions.parameter > last
            if beyond.any():
                count = int(beyond.argmax()) + 1
                yield continuation.Motions(*(each[:count] for each in motions)), loops.GOES_ON
                return
            yield motions, why

    return cut
