#!/usr/bin/env python3
"""Prints where a stream's joints are: watch.py STREAM [--connect ENDPOINT] [--count N]"""
import argparse

import posed

parser = argparse.ArgumentParser(description="Print where a stream's joints and fingertips are.")
parser.add_argument("stream")
parser.add_argument("--connect", default="tcp://127.0.0.1:5570", metavar="ENDPOINT")
parser.add_argument("--count", type=int, default=0, help="frames to print; 0: until Ctrl-C")
parser.add_argument("--key", help="your NAME.key, where the daemon asks for keys")
parser.add_argument("--server-key", help="the daemon's NAME.pub")
parser.add_argument("--timeout", type=float, default=10, metavar="SECONDS", help="without a pose; default 10")
options = parser.parse_args()


def text(point):
    return " ".join(f"{value:.6f}" for value in point)


try:
    with posed.Client(options.connect, [options.stream], key=options.key,
                      server_key=options.server_key) as client:
        for number, frame in enumerate(client.frames(options.timeout), start=1):
            age = "" if frame.age_s is None else f", {frame.age_s * 1000:.1f} ms old"
            timecode = frame.timecode and f", {frame.timecode}"
            print(f"{frame.stream} {frame.sequence}{age}{timecode}")
            for name, place in frame.positions_m().items():
                print(f"  {name} {text(place)}")
            for name, place in frame.tips_m().items():
                print(f"  tip of {name} {text(place)}")
            if number == options.count:
                break
except posed.PosedError as error:
    raise SystemExit(f"watch.py: {error}")
except KeyboardInterrupt:
    pass
