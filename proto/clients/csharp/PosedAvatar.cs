// Moves a Humanoid avatar by a stream of posed. Add it to the object with the Animator; at the start
// the avatar must stand in its T-pose.
using System;
using System.Collections.Generic;
using UnityEngine;

namespace Posed {
    public sealed class PosedAvatar : MonoBehaviour {
        // From the hips to the ankle; every Humanoid has these bones.
        private static readonly HumanBodyBones[] Leg = {
            HumanBodyBones.Hips, HumanBodyBones.LeftUpperLeg, HumanBodyBones.LeftLowerLeg, HumanBodyBones.LeftFoot };

        public string host = "127.0.0.1";
        public int port = 5570;
        public string stream = "walker";
        public bool moveThroughRoom = true;

        private PosedSubscriber subscriber;
        private Transform[] bones; // by HumanBodyBones; null where the avatar has none
        private Quaternion[] rest; // of the bones in T-pose, relative to this object
        private float leg; // its length
        private uint boundTo;
        private int[] boneOfJoint; // -1: the avatar has no such bone
        private float scale;

        public void Start() {
            var animator = GetComponent<Animator>();
            bones = new Transform[(int)HumanBodyBones.LastBone];
            rest = new Quaternion[bones.Length];
            Quaternion toObject = Quaternion.Inverse(transform.rotation);
            for (int i = 0; i < bones.Length; ++i) {
                bones[i] = animator.GetBoneTransform((HumanBodyBones)i);
                if (bones[i] != null) rest[i] = toObject * bones[i].rotation;
            }
            for (int i = 1; i < Leg.Length; ++i) {
                leg += (bones[(int)Leg[i]].position - bones[(int)Leg[i - 1]].position).magnitude;
            }
            subscriber = new PosedSubscriber(host, port, stream);
        }

        public void OnDestroy() => subscriber?.Dispose();

        public void Update() {
            PosedFrame frame;
            PosedSkeleton skeleton;
            if (subscriber != null && subscriber.TryTake(out frame, out skeleton)) Apply(frame, skeleton);
        }

        // A bone's turn in the room relative to its T-pose is the same in every skeleton.
        public void Apply(PosedFrame frame, PosedSkeleton skeleton) {
            if (boneOfJoint == null || boundTo != skeleton.Id) Bind(skeleton);
            var turned = new Quaternion[skeleton.Names.Count]; // in the room, in Unity's axes
            for (int joint = 0; joint < turned.Length; ++joint) {
                int parent = skeleton.Parents[joint];
                Quaternion local = ToUnity(frame.Rotations, joint);
                turned[joint] = parent < 0 ? local : turned[parent] * local;
                int bone = boneOfJoint[joint];
                if (bone < 0 || frame.Validity[joint] == 0) continue;
                Quaternion turn = turned[joint] * Quaternion.Inverse(ToUnity(skeleton.RestRotations, joint));
                bones[bone].rotation = transform.rotation * turn * rest[bone];
            }
            if (!moveThroughRoom) return;
            var place = new Vector3(-frame.RootPosition[0], frame.RootPosition[1], frame.RootPosition[2]);
            bones[(int)HumanBodyBones.Hips].position = transform.position + transform.rotation * (place * scale);
        }

        private void Bind(PosedSkeleton skeleton) {
            boundTo = skeleton.Id;
            boneOfJoint = new int[skeleton.Names.Count];
            for (int joint = 0; joint < boneOfJoint.Length; ++joint) {
                int bone = BoneNamed(skeleton.Bones[joint]);
                boneOfJoint[joint] = bone >= 0 && bones[bone] != null ? bone : -1;
            }
            float theirs = LegOf(skeleton);
            scale = theirs > 0.1f ? leg / theirs : 1f;
        }

        // VRM's names are Unity's with a small first letter, but for the thumbs and the little fingers' "Little".
        internal static int BoneNamed(string vrm) {
            if (vrm.Length == 0) return -1;
            string name = char.ToUpperInvariant(vrm[0]) + vrm.Substring(1);
            bool thumb = name.Contains("Thumb");
            if (thumb) name = name.Replace("Proximal", "Intermediate").Replace("Metacarpal", "Proximal");
            HumanBodyBones bone;
            return Enum.TryParse(name, out bone) && bone < HumanBodyBones.LastBone ? (int)bone : -1;
        }

        // The length of the same leg of the stream's person; 0 where it has no such bones.
        private static float LegOf(PosedSkeleton skeleton) {
            int hips = skeleton.Bones.IndexOf("hips"), joint = skeleton.Bones.IndexOf("leftFoot");
            List<float> offset = skeleton.Offsets;
            float length = 0f;
            for (; joint >= 0 && joint != hips; joint = skeleton.Parents[joint]) {
                length += new Vector3(offset[3 * joint], offset[3 * joint + 1], offset[3 * joint + 2]).magnitude;
            }
            return length;
        }

        // posed is right-handed and Unity left-handed; both have Y up and people who face +Z, so X changes sign.
        private static Quaternion ToUnity(List<float> values, int index) {
            int at = 4 * index;
            return new Quaternion(values[at], -values[at + 1], -values[at + 2], values[at + 3]);
        }
    }
}
