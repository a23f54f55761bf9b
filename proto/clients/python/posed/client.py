"""Receives what the daemon publishes."""
import time

import zmq
from google.protobuf.message import DecodeError

from .connection import PosedError, open_socket
from .skeleton import Skeleton
from .v1 import posed_pb2

DEFAULT_ENDPOINT = "tcp://127.0.0.1:5570"
_MESSAGES = {
    "pose": posed_pb2.Frame,
    "skeleton": posed_pb2.Skeleton,
    "sensor": posed_pb2.Sample,
    "event": posed_pb2.Event,
    "stats": posed_pb2.Stats,
}
_MAX_STREAMS = 2048  # that are kept; as many come through one connection of posed
_SILENCE_S = 5.0  # stats come every second, whatever the streams do


class Frame:
    """One pose, with the skeleton that it belongs to."""

    def __init__(self, message, skeleton, age_s):
        self.message = message  # posed.v1.Frame, with everything else that the wire carries
        self.skeleton = skeleton
        # Since the daemon received the measurement; None until the daemon's clock is known, at most
        # a second. Between two machines it is as exact as their clocks agree.
        self.age_s = age_s
        self.stream = message.stream
        self.sequence = message.sequence
        self.timecode = message.timecode  # "hh:mm:ss:ff" or "hh:mm:ss.mmm"; "" where there is none
        self.root_m = tuple(message.root_position_m)
        values = message.rotation_xyzw
        self.rotations = [tuple(values[i:i + 4]) for i in range(0, len(values), 4)]
        self.valid = [byte != 0 for byte in message.validity]

    def positions_m(self):
        """World positions of the joints by name."""
        _, places = self.skeleton.world(self.rotations, self.root_m)
        return dict(zip(self.skeleton.names, places))

    def tips_m(self):
        """World positions of the end sites (fingertips, ...) by the names of their joints."""
        return self.skeleton.tips_m(*self.skeleton.world(self.rotations, self.root_m))

    def vrm_locals(self):
        """Rotations of the VRM bones, x y z w, as a VRM avatar takes them (right-handed)."""
        return self.skeleton.vrm_locals(self.rotations)


class Client:
    """Subscribes to streams. Not for several threads at once.

    streams: their names. Nothing: all of them, with those that come later.
    topics: what else to receive by messages(): "sensor", "event".
    key, server_key: paths of your own NAME.key and of the daemon's NAME.pub, where it asks for keys.
    queue: messages that may wait here; beyond it, newer ones are lost. Keep it short.
    """

    def __init__(self, endpoint=DEFAULT_ENDPOINT, streams=None, *, topics=(), key=None,
                 server_key=None, queue=16):
        self._context = zmq.Context()
        self._address = (endpoint, key, server_key)
        self._queue = queue
        self._names = set(streams or ())
        self._topics = [f"{topic}/{name}" for name in streams or [""]
                        for topic in ("pose", "skeleton", *topics)] + ["stats"]
        self._connect()
        self.skeletons = {}  # Skeleton by stream
        self.stats = None  # the last posed.v1.Stats
        self._to_utc_ns = {}

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def close(self):
        self._socket.close()
        self._context.term()

    def _connect(self):
        self._socket = open_socket(self._context, zmq.SUB, *self._address)
        self._socket.setsockopt(zmq.RCVHWM, self._queue)
        for topic in self._topics:
            self._socket.subscribe(topic)
        self._silent_s = 0.0  # waited in vain since the last message

    def messages(self, timeout_s=None):
        """Everything as (topic, message): ("pose/walker", posed_pb2.Frame) and so on.

        Raises PosedError when nothing comes for `timeout_s`.
        """
        last_s = time.monotonic()
        while True:
            now_s = time.monotonic()
            if timeout_s is not None and now_s - last_s >= timeout_s:
                raise PosedError(f"nothing came for {timeout_s} s; is the daemon running, and is the "
                                 "stream's name right?")
            wait_s = _SILENCE_S if timeout_s is None else min(_SILENCE_S, last_s + timeout_s - now_s)
            read = None
            if self._socket.poll(int(wait_s * 1000) + 1) > 0:
                read = self._read(self._socket.recv_multipart())
            elif self._silent_s + wait_s < _SILENCE_S:
                self._silent_s += wait_s
            else:
                # libzmq gives up when somebody else had the daemon's port meanwhile.
                self._socket.close()
                self._connect()
            if read is not None:
                self._silent_s = 0.0
                yield read
                last_s = time.monotonic()

    def _read(self, parts):
        """The topic and the message; None for what is unwanted, or makes no sense."""
        try:
            topic, body = parts
            topic = topic.decode()
            kind, _, stream = topic.partition("/")
            # A subscription is a prefix: "walker" also brings "walker-raw".
            if stream and self._names and stream not in self._names:
                return None
            message = _MESSAGES[kind].FromString(body)
            if kind == "skeleton":
                self.skeletons[stream] = Skeleton(message)
        except (ValueError, KeyError, DecodeError):
            return None
        if len(self.skeletons) > _MAX_STREAMS:
            del self.skeletons[next(iter(self.skeletons))]
        if kind == "stats":
            self.stats = message
            # A relay tells the clock of each stream's machine.
            self._to_utc_ns = {one.stream: one.monotonic_to_utc_ns for one in message.stream
                               if one.HasField("monotonic_to_utc_ns")}
        return topic, message

    def frames(self, timeout_s=None):
        """The poses, as Frames; without those that came before their skeleton.

        Raises PosedError when no pose comes for `timeout_s`.
        """
        last_s = time.monotonic()
        for topic, message in self.messages(timeout_s):
            skeleton = self.skeletons.get(message.stream) if topic.startswith("pose/") else None
            if skeleton is not None and skeleton.fits(message):
                yield Frame(message, skeleton, self._age_s(message))
                last_s = time.monotonic()
            elif timeout_s is not None and time.monotonic() - last_s > timeout_s:
                # stats come every second, whatever the streams do
                raise PosedError(f"no pose came for {timeout_s} s; is the stream's name right?")

    def _age_s(self, message):
        if self.stats is None:
            return None
        to_utc_ns = self._to_utc_ns.get(message.stream, self.stats.monotonic_to_utc_ns)
        utc_ns = message.arrival_ns + to_utc_ns
        return (time.time_ns() - utc_ns) / 1e9
