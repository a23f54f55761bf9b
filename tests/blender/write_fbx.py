"""Blender writes a .glb as FBX.

    blender --background --factory-startup --python-exit-code 1 --python write_fbx.py -- IN.glb OUT.fbx
"""
import sys

import bpy

FRAME_RATE = 30

glb, fbx = sys.argv[sys.argv.index("--") + 1:]
bpy.ops.wm.read_homefile(use_empty=True)
scene = bpy.context.scene
scene.render.fps = FRAME_RATE
bpy.ops.import_scene.gltf(filepath=glb, import_shading="SMOOTH")  # as check_import.py
scene.frame_start, scene.frame_end = (round(frame) for frame in bpy.data.actions[0].frame_range)
# Every frame as it is, in one animation.
bpy.ops.export_scene.fbx(filepath=fbx, bake_anim_simplify_factor=0.0, bake_anim_use_nla_strips=False,
                         bake_anim_use_all_actions=False)
