#!/usr/bin/env python3
"""Feeds posed's landmarks source: landmarks.py [HOST:PORT], a right hand that opens and closes.

Put your tracker's points in the place of `points` (drivers/landmarks/README.md)."""
import json
import math
import socket
import sys
import time

host, port = (sys.argv[1] if len(sys.argv) > 1 else "127.0.0.1:7420").rsplit(":", 1)
KNUCKLES = [(0.024, 0.092), (0.003, 0.095), (-0.017, 0.089), (-0.036, 0.082)]  # right, up [m]


def points(closed):
    """Wrist, thumb, index, middle, ring, little: x right, y down, z away from the camera [m]."""
    all_points = [(0, 0, 0), (0.02, -0.024, 0), (0.05, -0.05, 0), (0.07, -0.075, 0), (0.08, -0.1, 0)]
    for x, up in KNUCKLES:
        z, angle = 0.0, 0.0
        all_points.append((x, -up, z))
        for length in (0.044, 0.027, 0.023):
            angle += 1.3 * closed
            up, z = up + length * math.cos(angle), z - length * math.sin(angle)
            all_points.append((x, -up, z))
    return [number for point in all_points for number in point]


out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
while True:
    hand = {"side": "right", "score": 0.9, "points": points(0.5 - 0.5 * math.cos(2 * time.monotonic()))}
    message = {"posed": "landmarks", "version": 1, "time_ns": time.monotonic_ns(), "hands": [hand]}
    out.sendto(json.dumps(message).encode(), (host, int(port)))
    time.sleep(1 / 30)
