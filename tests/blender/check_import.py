"""Compares what Blender imports with the clip itself.

    blender --background --factory-startup --python-exit-code 1 --python check_import.py -- CLIP.bvh
        METRES_PER_UNIT FILE...

The truth is the forward kinematics of CLIP.bvh, computed here with numpy. Each FILE (.glb, or a .bvh in the same
unit as CLIP) is imported, and the head of each bone is compared with its joint in every frame. A .bvh may also be a
take: a part of CLIP, which is looked for by its rotations. The largest distance is printed; above 1 mm the check fails.
"""
import builtins
import sys

import bpy
import numpy as np
from mathutils import Matrix

LIMIT_M = 0.001

# Blender 3.4 opens a BVH in mode "rU", which Python 3.11 refuses.
python_open = builtins.open
builtins.open = lambda file, mode="r", *more, **named: python_open(file, mode.replace("U", ""), *more, **named)


def rotation(axis, degrees):
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return {"X": np.array([[1, 0, 0], [0, c, -s], [0, s, c]]),
            "Y": np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]),
            "Z": np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])}[axis]


def read_bvh(path):
    """Joints as (name, parent, offset, channels), the frames [frame x channel], seconds per frame."""
    with python_open(path) as file:
        hierarchy, motion = file.read().split("MOTION")
    joints, stack, words, end_site = [], [], hierarchy.split(), False
    for i, word in enumerate(words):
        if word in ("ROOT", "JOINT"):
            joints.append([words[i + 1], stack[-1] if stack else -1, None, []])
        elif word == "End":
            end_site = True
        elif word == "{":
            stack.append(len(joints) - 1)
        elif word == "}":
            stack.pop()
            end_site = False
        elif word == "OFFSET" and not end_site:
            joints[-1][2] = np.array([float(x) for x in words[i + 1:i + 4]])
        elif word == "CHANNELS":
            joints[-1][3] = words[i + 2:i + 2 + int(words[i + 1])]
    lines = motion.strip().splitlines()
    return joints, np.array([[float(x) for x in line.split()] for line in lines[2:]]), float(lines[1].split(":")[1])


def positions(joints, row):
    """World positions of the joints in one frame, in the unit of the file."""
    world, used = [], 0
    for _, parent, offset, channels in joints:
        place, turn = offset.copy(), np.eye(3)
        for channel in channels:
            value = row[used]
            used += 1
            if channel.endswith("position"):
                place["XYZ".index(channel[0])] = value
            else:
                turn = turn @ rotation(channel[0], value)
        if parent >= 0:
            place, turn = world[parent][0] + world[parent][1] @ place, world[parent][1] @ turn
        world.append((place, turn))
    return [place for place, _ in world]


def part_of(joints, frames, path):
    """The frames of the clip that a .bvh has, wherever it begins; all of them for another file."""
    if not path.endswith(".bvh"):
        return frames
    taken = read_bvh(path)[1]
    turns = [channel.endswith("rotation") for *_, channels in joints for channel in channels]
    begins = range(len(frames) - len(taken) + 1)
    begin = min(begins, key=lambda b: np.abs((frames[b:b + len(taken)] - taken)[:, turns]).max())
    return frames[begin:begin + len(taken)]


def compare(path, joints, frames, step_s, metres_per_unit):
    """The largest distance [m] of a bone's head from its joint, over all frames and joints."""
    bpy.ops.wm.read_homefile(use_empty=True)
    scene = bpy.context.scene
    # glTF has keys at times, and the importer puts them at this rate; a BVH has frames, from 1.
    scene.render.fps = 1000
    unit, first, step = 1.0, 0, step_s * scene.render.fps
    if path.endswith(".glb"):
        # Debian's Blender 3.4 opens meshes only so: its usual shading needs an older numpy.
        bpy.ops.import_scene.gltf(filepath=path, import_shading="SMOOTH")
    else:
        unit, first, step = metres_per_unit, 1, 1
        bpy.ops.import_anim.bvh(filepath=path, axis_forward="-Z", axis_up="Y")
    armature = next(o for o in bpy.data.objects if o.type == "ARMATURE")
    # Both importers turn Y up to Blender's Z up.
    to_posed = Matrix.Rotation(-np.pi / 2, 4, "X") @ armature.matrix_world
    worst, where = 0.0, None
    for i, row in enumerate(frames):
        whole, part = divmod(first + i * step, 1)
        scene.frame_set(int(whole), subframe=part)
        for (name, *_), truth in zip(joints, positions(joints, row)):
            head = np.array(to_posed @ armature.pose.bones[name].head) * unit
            distance = np.linalg.norm(head - truth * metres_per_unit)
            if not distance <= worst:
                worst, where = distance, (name, i)
    if where is None:
        raise SystemExit(f"{path}: nothing was compared")
    print(f"{path}: {len(frames)} frames, {len(joints)} joints, at most {worst * 1000:.4f} mm off {where}")
    return worst


def main():
    clip, metres_per_unit, *files = sys.argv[sys.argv.index("--") + 1:]
    joints, frames, step_s = read_bvh(clip)
    worst = [compare(path, joints, part_of(joints, frames, path), step_s, float(metres_per_unit)) for path in files]
    if not worst or not max(worst) < LIMIT_M:
        raise SystemExit("Blender shows another motion than the clip's")


main()
