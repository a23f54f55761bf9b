"""Changes a running daemon."""
import hashlib
import pathlib

import zmq
from google.protobuf.message import DecodeError

from .connection import PosedError, open_socket
from .v1 import control_pb2

DEFAULT_ENDPOINT = "tcp://127.0.0.1:5571"
_PART_BYTES = 32 * 1024


class Control:
    """Each method returns when the change is in effect, with the daemon's posed.v1.ControlReply,
    and raises PosedError with the daemon's sentence if it refused."""

    def __init__(self, endpoint=DEFAULT_ENDPOINT, *, key=None, server_key=None, timeout_s=5.0):
        self._endpoint, self._keys, self._timeout_s = endpoint, (key, server_key), timeout_s
        self._context = zmq.Context()
        self._socket = None

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def close(self):
        self._hang_up()
        self._context.term()

    def set(self, stream, name, value):
        """Sets a parameter of a stage: set("walker", "alpha", 0.5)."""
        request = control_pb2.ControlRequest()
        change = request.set_parameter
        change.stream, change.name = stream, name
        if isinstance(value, bool):
            change.flag = value
        elif isinstance(value, str):
            change.text = value
        else:
            change.number = value
        return self._ask(request)

    def play(self, stream, labels, tempo=1.0, loop=False):
        """Performs labels on a hand, after those that are still queued: play("hand", "g 1 c")."""
        words = labels.split() if isinstance(labels, str) else list(labels)
        return self._command(stream, "play", words, {"tempo": tempo, "loop": float(loop)})

    def stop_playing(self, stream):
        """Back to the live hand."""
        return self._command(stream, "stop-playing", [], {})

    def model(self, stream, path):
        """Gives a stream another style or gesture model: sends the file in pieces."""
        data = pathlib.Path(path).read_bytes()
        digest = hashlib.sha256(data).hexdigest()
        reply = None
        for offset in range(0, max(len(data), 1), _PART_BYTES):
            request = control_pb2.ControlRequest()
            part = request.model_part
            part.stream, part.sha256, part.total, part.offset = stream, digest, len(data), offset
            part.bytes = data[offset:offset + _PART_BYTES]
            part.name = pathlib.Path(path).name
            reply = self._ask(request)
        return reply

    def take(self, name=""):
        """Begins a take in the recording, which ends the one that runs; reply.take has its number."""
        return self._take(True, name)

    def end_take(self):
        """Ends the take that runs."""
        return self._take(False, "")

    def status(self):
        """The daemon's state: posed.v1.Stats."""
        request = control_pb2.ControlRequest()
        request.status.SetInParent()
        return self._ask(request).status

    def stop(self):
        """Ends the daemon cleanly."""
        request = control_pb2.ControlRequest()
        request.stop.SetInParent()
        return self._ask(request)

    def _command(self, stream, name, words, numbers):
        request = control_pb2.ControlRequest()
        command = request.stage_command
        command.stream, command.name = stream, name
        command.word.extend(words)
        for option, value in numbers.items():
            command.number[option] = value
        return self._ask(request)

    def _take(self, start, name):
        request = control_pb2.ControlRequest()
        request.take.start, request.take.name = start, name
        request.take.SetInParent()
        return self._ask(request)

    def _hang_up(self):
        if self._socket is not None:
            self._socket.close()
        self._socket = None

    def _ask(self, request):
        if self._socket is None:
            self._socket = open_socket(self._context, zmq.REQ, self._endpoint, *self._keys)
        self._socket.send(request.SerializeToString())
        if self._socket.poll(int(self._timeout_s * 1000)) == 0:
            self._hang_up()  # a late answer must not count for the next question
            raise PosedError(f"no answer from {self._endpoint} within {self._timeout_s} s; is the "
                             "daemon running, and may your key control it?")
        try:
            (body,) = self._socket.recv_multipart()
            reply = control_pb2.ControlReply.FromString(body)
        except (ValueError, DecodeError):
            self._hang_up()
            raise PosedError(f"{self._endpoint} does not answer like a posed daemon") from None
        if not reply.ok:
            raise PosedError(reply.error)
        return reply
