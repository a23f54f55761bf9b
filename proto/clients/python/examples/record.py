#!/usr/bin/env python3
"""Records a stream as NumPy arrays: record.py STREAM OUT.npz --seconds 10"""
import argparse

import numpy

import posed

parser = argparse.ArgumentParser(description="Record a stream as NumPy arrays.")
parser.add_argument("stream")
parser.add_argument("out", metavar="OUT.npz")
parser.add_argument("--seconds", type=float, default=10.0)
parser.add_argument("--connect", default="tcp://127.0.0.1:5570", metavar="ENDPOINT")
parser.add_argument("--key", help="your NAME.key, where the daemon asks for keys")
parser.add_argument("--server-key", help="the daemon's NAME.pub")
options = parser.parse_args()

frames = []
try:
    with posed.Client(options.connect, [options.stream], key=options.key,
                      server_key=options.server_key, queue=1000) as client:
        for frame in client.frames(timeout_s=10):
            if frames and frame.skeleton.id != frames[0].skeleton.id:
                raise SystemExit("record.py: the skeleton changed; record again")
            frames.append(frame)
            first_ns = frames[0].message.arrival_ns
            if frame.message.arrival_ns - first_ns >= options.seconds * 1e9:
                break
except posed.PosedError as error:
    raise SystemExit(f"record.py: {error}")
except KeyboardInterrupt:
    pass
if not frames:
    raise SystemExit("record.py: no frame came")

skeleton = frames[0].skeleton
none = (float("nan"),) * 3
numpy.savez(
    options.out,
    time_s=numpy.array([frame.message.arrival_ns - first_ns for frame in frames]) / 1e9,
    sequence=numpy.array([frame.sequence for frame in frames]),
    root_m=numpy.array([frame.root_m for frame in frames]),
    rotation_xyzw=numpy.array([frame.rotations for frame in frames]),
    valid=numpy.array([frame.valid for frame in frames]),
    quality=numpy.array([frame.message.quality for frame in frames]),
    position_m=numpy.array([list(frame.positions_m().values()) for frame in frames]),
    joint_name=numpy.array(skeleton.names),
    parent=numpy.array(skeleton.parents),
    offset_m=numpy.array(skeleton.offsets_m),
    end_site_m=numpy.array([tip or none for tip in skeleton.end_sites_m]),
)
print(f"{options.out}: {len(frames)} frames, {len(skeleton.names)} joints")
