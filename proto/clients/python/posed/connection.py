"""ZeroMQ sockets with the daemon's keys."""
import zmq

_MAX_PART = 1 << 20  # bytes; a daemon sends no longer one


class PosedError(RuntimeError):
    """What the daemon refused, or why it cannot be reached: one sentence for people."""


def read_key(path):
    """The key in a file that `posed keygen` wrote (NAME.pub or NAME.key)."""
    with open(path, encoding="ascii") as file:
        key = file.read().strip()
    if len(key) != 40:
        raise PosedError(f"{path}: this is not a key: expected the 40 characters that `posed keygen` writes")
    return key.encode()


def open_socket(context, kind, endpoint, key, server_key):
    """Connects. `key` is the path of one's own NAME.key, `server_key` that of the daemon's NAME.pub."""
    if (key is None) != (server_key is None):
        raise PosedError("name both keys: your own NAME.key and the daemon's NAME.pub")
    socket = context.socket(kind)
    socket.setsockopt(zmq.LINGER, 0)
    socket.setsockopt(zmq.MAXMSGSIZE, _MAX_PART)
    # A daemon that loses its power or its network says nothing: TCP finds that out in five seconds.
    socket.setsockopt(zmq.TCP_KEEPALIVE, 1)
    socket.setsockopt(zmq.TCP_KEEPALIVE_IDLE, 2)
    socket.setsockopt(zmq.TCP_KEEPALIVE_INTVL, 1)
    socket.setsockopt(zmq.TCP_KEEPALIVE_CNT, 3)
    if key is not None:
        secret = read_key(key)
        socket.setsockopt(zmq.CURVE_SECRETKEY, secret)
        socket.setsockopt(zmq.CURVE_PUBLICKEY, zmq.curve_public(secret))
        socket.setsockopt(zmq.CURVE_SERVERKEY, read_key(server_key))
    socket.connect(endpoint)
    return socket
