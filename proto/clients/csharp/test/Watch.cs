// Watch.exe HOST PORT STREAM: moves an avatar of stubs by one frame and prints its bones in Unity's
// axes, "Hips x y z w" each, the frame's timecode, and where the hips are.
using System;
using System.Globalization;
using System.Threading;
using Posed;
using UnityEngine;

public static class Watch
{
    public static int Main(string[] arguments)
    {
        CultureInfo.DefaultThreadCurrentCulture = CultureInfo.InvariantCulture;
        Thread.CurrentThread.CurrentCulture = CultureInfo.InvariantCulture;
        var avatar = new PosedAvatar
        {
            host = arguments[0],
            port = int.Parse(arguments[1]),
            stream = arguments[2],
            animator = new Animator()
        };
        for (int i = 0; i < avatar.animator.bones.Length; ++i) avatar.animator.bones[i] = new Transform();
        // Hips 0.95 m above the floor, a leg of 0.9 m to the ankle.
        avatar.animator.bones[(int)HumanBodyBones.Hips].position = new Vector3(0f, 0.95f, 0f);
        avatar.animator.bones[(int)HumanBodyBones.LeftUpperLeg].position = new Vector3(0f, 0.85f, 0f);
        avatar.animator.bones[(int)HumanBodyBones.LeftLowerLeg].position = new Vector3(0f, 0.45f, 0f);
        avatar.animator.bones[(int)HumanBodyBones.LeftFoot].position = new Vector3(0f, 0.05f, 0f);
        avatar.Start();
        using (var subscriber = new PosedSubscriber(avatar.host, avatar.port, avatar.stream))
        {
            PosedFrame frame = null;
            PosedSkeleton skeleton = null;
            for (int waited = 0; !subscriber.TryTake(out frame, out skeleton); ++waited)
            {
                if (waited == 1000)
                {
                    Console.WriteLine("no pose came: " + subscriber.Problem);
                    return 1;
                }
                Thread.Sleep(10);
            }
            avatar.Apply(frame, skeleton);
            foreach (string bone in skeleton.Bones)
            {
                int place = PosedAvatar.BoneNamed(bone);
                if (place < 0) continue;
                Quaternion q = avatar.animator.bones[place].rotation;
                Console.WriteLine("{0} {1:R} {2:R} {3:R} {4:R}", bone, q.x, q.y, q.z, q.w);
            }
            Vector3 hips = avatar.animator.bones[(int)HumanBodyBones.Hips].position;
            Console.WriteLine("timecode " + frame.Timecode);
            Console.WriteLine("place {0:R} {1:R} {2:R}", hips.x, hips.y, hips.z);
        }
        avatar.OnDestroy();
        return 0;
    }
}
