#!/usr/bin/env python3
"""Performs gestures on a hand: play.py STREAM LABEL... [--connect ENDPOINT]"""
import argparse

import posed

parser = argparse.ArgumentParser(description="Perform gestures on a hand, and go back to the live hand.")
parser.add_argument("stream")
parser.add_argument("label", nargs="*", help="none: stop playing")
parser.add_argument("--connect", default="tcp://127.0.0.1:5571", metavar="ENDPOINT")
parser.add_argument("--tempo", type=float, default=1.0)
parser.add_argument("--key", help="your NAME.key, where the daemon asks for keys")
parser.add_argument("--server-key", help="the daemon's NAME.pub")
options = parser.parse_args()

try:
    with posed.Control(options.connect, key=options.key, server_key=options.server_key) as control:
        if options.label:
            reply = control.play(options.stream, options.label, tempo=options.tempo)
            print(f"playing from frame {reply.sequence} on")
        else:
            control.stop_playing(options.stream)
            print("back to the live hand")
except posed.PosedError as error:
    raise SystemExit(f"play.py: {error}")
