"""The skeleton of a stream: forward kinematics, fingertips, and VRM rotations."""
import math

from . import rotation


def _vectors(values, size):
    return [tuple(values[i:i + size]) for i in range(0, len(values), size)]


class Skeleton:
    """Joints in an order in which a parent precedes its children. Right-handed, Y up, metres.

    Raises ValueError when the lists of the message do not fit each other.
    """

    def __init__(self, message):
        joints = len(message.parent)
        sizes = (len(message.joint_name), len(message.humanoid_bone), len(message.offset_m) / 3,
                 len(message.T_world_joint_xyzw) / 4, len(message.end_site_m) / 3 or joints)
        if message.root_joint >= joints or any(size != joints for size in sizes) or any(
                not -1 <= parent < joint for joint, parent in enumerate(message.parent)):
            raise ValueError("a skeleton whose lists do not fit each other")
        self.message = message  # posed.v1.Skeleton
        self.id = message.id
        self.names = list(message.joint_name)
        self.parents = list(message.parent)  # -1: the top
        self.offsets_m = _vectors(message.offset_m, 3)  # from the parent, in its frame
        # The tip of a joint without children, in the joint's frame; None where there is none.
        self.end_sites_m = [
            None if math.isnan(tip[0]) else tip for tip in _vectors(message.end_site_m, 3)
        ] or [None] * len(self.names)
        self.bones = list(message.humanoid_bone)  # VRM names; "" where a joint is no such bone
        self.root = message.root_joint
        # Each joint's rotation in the world while the figure stands in the T-pose.
        self._T = _vectors(message.T_world_joint_xyzw, 4)

    def fits(self, message):
        """Whether a posed.v1.Frame is a pose of this skeleton."""
        return (message.skeleton_id == self.id and len(message.root_position_m) == 3
                and len(message.rotation_xyzw) == 4 * len(self.names)
                and len(message.validity) == len(self.names))

    def world(self, rotations, root_m):
        """World rotations and positions [m] of all joints.

        `rotations`: parent-relative quaternions, one a joint; `root_m`: where the root joint is.
        """
        turned, places = [], []
        for joint, parent in enumerate(self.parents):
            if parent < 0:
                turned.append(rotations[joint])
                places.append((0.0, 0.0, 0.0))
                continue
            turned.append(rotation.multiply(turned[parent], rotations[joint]))
            step = rotation.rotate(turned[parent], self.offsets_m[joint])
            places.append(rotation.add(places[parent], step))
        shift = tuple(r - p for r, p in zip(root_m, places[self.root]))
        return turned, [rotation.add(place, shift) for place in places]

    def tips_m(self, turned, places):
        """World positions of the end sites, by the names of their joints: fingertips, toes, the head's top."""
        return {
            self.names[joint]: rotation.add(places[joint], rotation.rotate(turned[joint], tip))
            for joint, tip in enumerate(self.end_sites_m)
            if tip is not None
        }

    def vrm_locals(self, rotations):
        """Rotations of the VRM bones relative to their parent bones; all are identity in the T-pose.

        A joint between two bones is part of the lower one.
        """
        turned, _ = self.world(rotations, (0.0, 0.0, 0.0))
        from_rest = [
            rotation.multiply(world, rotation.inverse(rest)) for world, rest in zip(turned, self._T)
        ]
        result = {}
        for joint, bone in enumerate(self.bones):
            if not bone:
                continue
            above = self.parents[joint]
            while above >= 0 and not self.bones[above]:
                above = self.parents[above]
            parent = from_rest[above] if above >= 0 else rotation.IDENTITY
            result[bone] = rotation.multiply(rotation.inverse(parent), from_rest[joint])
        return result
