"""Client of posed, the pose daemon.

    import posed
    with posed.Client(streams=["walker"]) as client:
        for frame in client.frames():
            print(frame.stream, frame.age_s, frame.positions_m()["head"])
"""
from .client import Client, Frame
from .control import Control
from .connection import PosedError
from .skeleton import Skeleton

__all__ = ["Client", "Control", "Frame", "PosedError", "Skeleton"]
