"""Quaternions (x, y, z, w) as tuples, without NumPy."""

IDENTITY = (0.0, 0.0, 0.0, 1.0)


def multiply(a, b):
    """First b, then a."""
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )


def inverse(q):
    """Of a unit quaternion."""
    x, y, z, w = q
    return (-x, -y, -z, w)


def rotate(q, v):
    """The vector v turned by q."""
    x, y, z, _ = multiply(multiply(q, (v[0], v[1], v[2], 0.0)), inverse(q))
    return (x, y, z)


def add(a, b):
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])
