// Moves a Humanoid avatar by a stream of posed. Add it to the object with the Animator; at the start
// the avatar must stand in its T-pose.
using System;
using System.Collections.Generic;
using UnityEngine;

namespace Posed
{
    public sealed class PosedAvatar : MonoBehaviour
    {
        public string host = "127.0.0.1";
        public int port = 5570;
        public string stream = "walker";
        public bool moveThroughRoom = true;

        private PosedSubscriber subscriber;
        private Transform[] bones; // by HumanBodyBones; null where the avatar has none
        private Quaternion[] rest; // of the bones in T-pose, relative to this object
        private Vector3 hipsRest; // place of the hips in T-pose, relative to this object
        private uint boundTo;
        private int[] boneOfJoint; // -1: the avatar has no such bone
        private float scale;

        public void Start()
        {
            var animator = GetComponent<Animator>();
            bones = new Transform[(int)HumanBodyBones.LastBone];
            rest = new Quaternion[bones.Length];
            Quaternion toObject = Quaternion.Inverse(transform.rotation);
            for (int i = 0; i < bones.Length; ++i)
            {
                bones[i] = animator.GetBoneTransform((HumanBodyBones)i);
                if (bones[i] != null) rest[i] = toObject * bones[i].rotation;
            }
            Transform hips = bones[(int)HumanBodyBones.Hips];
            if (hips != null) hipsRest = toObject * (hips.position - transform.position);
            subscriber = new PosedSubscriber(host, port, stream);
        }

        public void OnDestroy()
        {
            if (subscriber != null) subscriber.Dispose();
        }

        public void Update()
        {
            PosedFrame frame;
            PosedSkeleton skeleton;
            if (subscriber != null && subscriber.TryTake(out frame, out skeleton)) Apply(frame, skeleton);
        }

        // A bone's turn in the room relative to its T-pose is the same in every skeleton.
        public void Apply(PosedFrame frame, PosedSkeleton skeleton)
        {
            if (boneOfJoint == null || boundTo != skeleton.Id) Bind(skeleton);
            var turned = new Quaternion[skeleton.Names.Count]; // in the room, in Unity's axes
            for (int joint = 0; joint < turned.Length; ++joint)
            {
                int parent = skeleton.Parents[joint];
                Quaternion local = ToUnity(frame.Rotations, joint);
                turned[joint] = parent < 0 ? local : turned[parent] * local;
                int bone = boneOfJoint[joint];
                if (bone < 0 || frame.Validity[joint] == 0) continue;
                Quaternion turn = turned[joint] * Quaternion.Inverse(ToUnity(skeleton.RestRotations, joint));
                bones[bone].rotation = transform.rotation * turn * rest[bone];
            }
            Transform hips = bones[(int)HumanBodyBones.Hips];
            if (hips == null || !moveThroughRoom) return;
            var place = new Vector3(-frame.RootPosition[0], frame.RootPosition[1], frame.RootPosition[2]);
            hips.position = transform.position + transform.rotation * (place * scale);
        }

        private void Bind(PosedSkeleton skeleton)
        {
            boundTo = skeleton.Id;
            boneOfJoint = new int[skeleton.Names.Count];
            for (int joint = 0; joint < boneOfJoint.Length; ++joint)
            {
                int bone = BoneNamed(skeleton.Bones[joint]);
                boneOfJoint[joint] = bone >= 0 && bones[bone] != null ? bone : -1;
            }
            float height = HipsHeight(skeleton);
            scale = height > 0.1f && hipsRest.y > 0.1f ? hipsRest.y / height : 1f;
        }

        // VRM's names are Unity's with a small first letter, but for the thumbs and the little fingers' "Little".
        private static int BoneNamed(string vrm)
        {
            if (vrm.Length == 0) return -1;
            string name = char.ToUpperInvariant(vrm[0]) + vrm.Substring(1);
            bool thumb = name.IndexOf("Thumb", StringComparison.Ordinal) >= 0;
            if (thumb)
            {
                name = name.Replace("Proximal", "Intermediate").Replace("Metacarpal", "Proximal");
            }
            if (!Enum.IsDefined(typeof(HumanBodyBones), name) || name == "LastBone") return -1;
            return (int)(HumanBodyBones)Enum.Parse(typeof(HumanBodyBones), name);
        }

        // Of the hips above the lower of the feet, in T-pose: the lengths of a leg's bones.
        private static float HipsHeight(PosedSkeleton skeleton)
        {
            int joint = skeleton.Bones.IndexOf("leftFoot");
            int hips = skeleton.Bones.IndexOf("hips");
            float height = 0f;
            for (; joint >= 0 && joint != hips; joint = skeleton.Parents[joint])
            {
                int at = 3 * joint;
                height += (float)Math.Sqrt(skeleton.Offsets[at] * skeleton.Offsets[at]
                    + skeleton.Offsets[at + 1] * skeleton.Offsets[at + 1]
                    + skeleton.Offsets[at + 2] * skeleton.Offsets[at + 2]);
            }
            return height;
        }

        // posed is right-handed and Unity left-handed; both have Y up and people who face +Z, so X changes sign.
        private static Quaternion ToUnity(List<float> values, int index)
        {
            int at = 4 * index;
            return new Quaternion(values[at], -values[at + 1], -values[at + 2], values[at + 3]);
        }
    }
}
