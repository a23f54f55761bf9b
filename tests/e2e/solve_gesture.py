#!/usr/bin/env python3
"""Performs a label sequence from a gesture model, written from proto/README.md and model.proto alone:
an independent check of `posed synth`.
usage: solve_gesture.py PYTHON_SCHEMA_DIR MODEL "g 1 c" > OUT.csv   (one row of 45 angles per frame)"""
import math
import struct
import sys
import zlib

sys.path.insert(0, sys.argv[1])
from posed.v1 import model_pb2  # noqa: E402

FINGERS, STATES = 5, 5


def read_model(path):
    data = open(path, 'rb').read()
    magic, version, length, crc = struct.unpack_from('<8sIQI', data)
    payload = data[24:]
    assert magic == b'POSEDMDL' and version == 1 and len(payload) == length
    assert zlib.crc32(payload) == crc
    file = model_pb2.ModelFile()
    file.ParseFromString(payload)
    return file.gesture


def majority(classes):
    votes = [list(classes).count(k) for k in range(3)]
    return votes.index(max(votes))


def walk(tree, context, class_of):
    node = 0
    while tree.leaf[node] < 0:
        position, asked = divmod(tree.question[node], 3)
        node = tree.yes[node] if class_of(context[position]) == asked else tree.no[node]
    return tree.leaf[node]


def gaussians(model, text):
    """[frame] of (mean, variance), each [finger][window][channel of the finger]."""
    labels = [next(l for l in model.label if l.name == word) for word in text.split()]
    frames = []
    for i, label in enumerate(labels):
        context = (labels[max(i - 1, 0)], label, labels[min(i + 1, len(labels) - 1)])
        leaf = walk(model.duration, context, lambda l: majority(l.finger_class))
        for state in range(STATES):
            mean, variance = [], []
            for finger in range(FINGERS):
                tree = model.tree[5 * state + finger]
                row = walk(tree, context, lambda l: l.finger_class[finger])
                cut = lambda values: [values[27 * row + 9 * w:27 * row + 9 * w + 9] for w in range(3)]
                mean.append(cut(tree.mean))
                variance.append(cut(tree.variance))
            stay = max(1, math.floor(model.duration.mean[5 * leaf + state] + 0.5))
            frames += [(mean, variance)] * stay
    return frames


def solve(P, r):
    """Dense Gauss elimination; what is zero is skipped, which changes no number."""
    n = len(r)
    for i in range(n):
        for j in range(i + 1, n):
            if P[j][i] == 0.0:
                continue
            factor = P[j][i] / P[i][i]
            for k in range(i, min(n, i + 3)):
                P[j][k] -= factor * P[i][k]
            r[j] -= factor * r[i]
    x = [0.0] * n
    for i in reversed(range(n)):
        x[i] = (r[i] - sum(P[i][k] * x[k] for k in range(i + 1, min(n, i + 3)))) / P[i][i]
    return x


def trajectory(frames, finger, channel):
    n = len(frames)
    P = [[0.0] * n for _ in range(n)]
    r = [0.0] * n
    for t, (mean, variance) in enumerate(frames):
        for window, weights in enumerate(([(0, 1.0)], [(-1, -0.5), (1, 0.5)],
                                          [(-1, 1.0), (0, -2.0), (1, 1.0)])):
            if window > 0 and t in (0, n - 1):
                continue
            precision = 1.0 / variance[finger][window][channel]
            for a, wa in weights:
                r[t + a] += wa * precision * mean[finger][window][channel]
                for b, wb in weights:
                    P[t + a][t + b] += wa * wb * precision
    return solve(P, r)


def main():
    frames = gaussians(read_model(sys.argv[2]), sys.argv[3])
    columns = [trajectory(frames, f, c) for f in range(FINGERS) for c in range(9)]
    for row in zip(*columns):
        print(','.join('%.12g' % value for value in row))


if __name__ == '__main__':
    main()
