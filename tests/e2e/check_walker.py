"""Judges a walk's feet by its own forward kinematics: check_walker.py WALK.bvh ...

Prints a line for each clip and ends with 3 where a person would see that the walker is not real: feet that
hover or sink, a standing foot that slides, a knee that bends the other way. Lengths are scaled to a
person of 170 cm; the floor is the 5th percentile of the lowest points of the feet.
"""

import math
import sys


def times(a, b):
    return [[sum(a[i][k] * b[k][j] for k in range(3)) for j in range(3)] for i in range(3)]


def turn(axis, degrees):
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    return {
        "X": [[1, 0, 0], [0, c, -s], [0, s, c]],
        "Y": [[c, 0, s], [0, 1, 0], [-s, 0, c]],
        "Z": [[c, -s, 0], [s, c, 0], [0, 0, 1]],
    }[axis]


def apply(m, v):
    return [sum(m[i][k] * v[k] for k in range(3)) for i in range(3)]


def read(path):
    """Joints (name, parent, offset, channels), seconds a frame, and the rows of values."""
    words = open(path).read().split()
    joints, parents, at = [], [], 0
    while words[at] != "MOTION":
        word = words[at]
        if word in ("ROOT", "JOINT", "End"):
            name = words[at + 1] if word != "End" else "End " + joints[parents[-1]][0]
            joints.append([name, parents[-1] if parents else None, None, []])
        elif word == "{":
            parents.append(len(joints) - 1)
        elif word == "}":
            parents.pop()
        elif word == "OFFSET":
            joints[-1][2] = [float(w) for w in words[at + 1 : at + 4]]
        elif word == "CHANNELS":
            joints[-1][3] = words[at + 2 : at + 2 + int(words[at + 1])]
        at += 1
    count = sum(len(j[3]) for j in joints)
    values = [float(w) for w in words[at + 6 :]]
    rows = [values[i : i + count] for i in range(0, len(values), count)]
    return joints, float(words[at + 5]), rows


def positions(joints, row):
    place, at, world = {}, 0, []
    for name, parent, offset, channels in joints:
        spot, rotation = list(offset), [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
        for channel in channels:
            if channel.endswith("position"):
                spot["XYZ".index(channel[0])] = row[at]
            else:
                rotation = times(rotation, turn(channel[0], row[at]))
            at += 1
        if parent is not None:
            base, outer = world[parent]
            spot = [b + s for b, s in zip(base, apply(outer, spot))]
            rotation = times(outer, rotation)
        world.append((spot, rotation))
        place[name] = spot
    return place


def knee_degrees(place, side):
    """How far the knee is bent; below 0 when it lies behind the line from hip to ankle."""
    hip, knee, ankle = (place[side + b] for b in ("UpperLeg", "LowerLeg", "Foot"))
    thigh = [k - h for h, k in zip(hip, knee)]
    shin = [a - k for k, a in zip(knee, ankle)]
    cosine = sum(t * s for t, s in zip(thigh, shin)) / math.hypot(*thigh) / math.hypot(*shin)
    ahead = [place[side + "Toes"][i] - ankle[i] for i in (0, 2)]
    bulge = [knee[i] - (hip[i] + ankle[i]) / 2 for i in (0, 2)]
    sign = 1 if sum(a * b for a, b in zip(ahead, bulge)) >= 0 else -1
    return sign * math.degrees(math.acos(max(-1, min(1, cosine))))


def judge(path):
    joints, step_s, rows = read(path)
    frames = [positions(joints, row) for row in rows]
    feet = [s + b for s in ("Left", "Right") for b in ("Foot", "Toes")]
    feet += ["End LeftToes", "End RightToes"]
    upright = positions(joints, [0] * len(rows[0]))  # T-pose, whatever the style crouches
    cm = 170 / (upright["End Head"][1] - min(upright[n][1] for n in feet))
    lowest = sorted(min(f[n][1] for n in feet) * cm for f in frames)
    floor = lowest[len(lowest) // 20]
    near = sum(abs(low - floor) <= 1 for low in lowest) / len(lowest)
    slowest = sorted(
        min(math.dist(a[n], b[n]) for n in feet) * cm / step_s for a, b in zip(frames, frames[1:])
    )
    slide, most = slowest[len(slowest) // 2], slowest[len(slowest) * 95 // 100]
    knees = min(knee_degrees(f, side) for f in frames for side in ("Left", "Right"))
    print(
        f"{path}: within 1 cm of the floor in {100 * near:.0f} % of frames, standing foot"
        f" {slide:.1f} cm/s (95 %: {most:.1f}), knees from {knees:.0f} deg"
    )
    return near >= 0.95 and slide <= 3 and most <= 5 and knees >= 0


if __name__ == "__main__":
    verdicts = [judge(path) for path in sys.argv[1:]]
    sys.exit(0 if verdicts and all(verdicts) else 3)
