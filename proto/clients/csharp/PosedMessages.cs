// The few fields of posed's protobuf messages (proto/wire/posed/v1/posed.proto) that an avatar needs,
// read by hand, so that Unity needs no native library and no package.
using System;
using System.Collections.Generic;
using System.Text;

namespace Posed {
    // Right-handed, Y up, metres; rotations are x, y, z, w, relative to the parent joint.
    public sealed class PosedSkeleton {
        public uint Id;
        public List<string> Names = new List<string>();
        public List<string> Bones = new List<string>(); // VRM names; "" where a joint is no such bone
        public List<int> Parents = new List<int>(); // -1: the top; a parent precedes its children
        public List<float> Offsets = new List<float>(); // 3 a joint
        public List<float> RestRotations = new List<float>(); // 4 a joint, in the world, in T-pose
    }

    public sealed class PosedFrame {
        public ulong Sequence;
        public uint SkeletonId;
        public int Quality; // 0 measured, 1 predicted, 2 held, 3 stale
        public string Timecode = ""; // "hh:mm:ss:ff" or "hh:mm:ss.mmm"; "" where the source has none
        public List<float> RootPosition = new List<float>(); // 3
        public List<float> Rotations = new List<float>(); // 4 a joint
        public byte[] Validity = new byte[0]; // 1 a joint
    }

    // Reads one message; a damaged one throws FormatException.
    public sealed class ProtoReader {
        private readonly byte[] bytes;
        private readonly int end;
        private int at, field, kind; // of the field that Next() found: its number, how it is encoded

        private ProtoReader(byte[] bytes, int begin, int end) {
            this.bytes = bytes;
            this.end = end;
            at = begin;
        }

        public static PosedFrame ReadFrame(byte[] bytes) {
            var frame = new PosedFrame();
            var reader = new ProtoReader(bytes, 0, bytes.Length);
            while (reader.Next()) {
                switch (reader.field) {
                    case 2: frame.Sequence = reader.Number(); break;
                    case 7: frame.SkeletonId = (uint)reader.Number(); break;
                    case 8: reader.Floats(frame.RootPosition); break;
                    case 9: reader.Floats(frame.Rotations); break;
                    case 10: frame.Validity = reader.Bytes(); break;
                    case 12: frame.Quality = (int)reader.Number(); break;
                    case 22: frame.Timecode = reader.Text(); break;
                    default: reader.Skip(); break;
                }
            }
            if (frame.RootPosition.Count != 3 || frame.Rotations.Count != 4 * frame.Validity.Length) {
                throw new FormatException("a pose with the wrong number of values");
            }
            return frame;
        }

        public static PosedSkeleton ReadSkeleton(byte[] bytes) {
            var skeleton = new PosedSkeleton();
            var reader = new ProtoReader(bytes, 0, bytes.Length);
            while (reader.Next()) {
                switch (reader.field) {
                    case 2: skeleton.Id = (uint)reader.Number(); break;
                    case 4: skeleton.Names.Add(reader.Text()); break;
                    case 5: reader.SignedNumbers(skeleton.Parents); break;
                    case 6: reader.Floats(skeleton.Offsets); break;
                    case 7: skeleton.Bones.Add(reader.Text()); break;
                    case 8: reader.Floats(skeleton.RestRotations); break;
                    default: reader.Skip(); break;
                }
            }
            int joints = skeleton.Names.Count;
            bool whole = joints > 0 && skeleton.Bones.Count == joints && skeleton.Parents.Count == joints
                && skeleton.Offsets.Count == 3 * joints && skeleton.RestRotations.Count == 4 * joints;
            for (int joint = 0; whole && joint < joints; ++joint) {
                whole = skeleton.Parents[joint] >= -1 && skeleton.Parents[joint] < joint;
            }
            if (!whole) throw new FormatException("a skeleton whose lists do not fit each other");
            return skeleton;
        }

        // Goes to the next field; false at the end.
        private bool Next() {
            if (at == end) return false;
            ulong tag = Varint();
            if (tag >> 3 == 0 || tag > uint.MaxValue) throw new FormatException("a field without number");
            field = (int)(tag >> 3);
            kind = (int)(tag & 7);
            return true;
        }

        private ulong Varint() {
            ulong value = 0;
            for (int shift = 0; shift < 64; shift += 7) {
                byte next = bytes[Take(1)];
                value |= (ulong)(next & 0x7F) << shift;
                if (next < 0x80) return value;
            }
            throw new FormatException("a number of more than ten bytes");
        }

        // The place of the next `size` bytes.
        private int Take(ulong size) {
            if (size > (ulong)(end - at)) throw new FormatException("the message ends inside a field");
            int place = at;
            at += (int)size;
            return place;
        }

        private ulong Number() {
            if (kind == 0) return Varint();
            if (kind == 5) return BitConverter.ToUInt32(bytes, Take(4));
            if (kind == 1) return BitConverter.ToUInt64(bytes, Take(8));
            throw new FormatException("a number is encoded as text");
        }

        private ProtoReader Inside() {
            if (kind != 2) throw new FormatException("a list is encoded as a number");
            int size = (int)Math.Min(Varint(), int.MaxValue);
            int begin = Take((ulong)size);
            return new ProtoReader(bytes, begin, begin + size);
        }

        private string Text() => Encoding.UTF8.GetString(Bytes());

        private byte[] Bytes() {
            ProtoReader inside = Inside();
            var copy = new byte[inside.end - inside.at];
            Array.Copy(bytes, inside.at, copy, 0, copy.Length);
            return copy;
        }

        private void Floats(List<float> values) {
            ProtoReader inside = Inside();
            while (inside.at < inside.end) values.Add(BitConverter.ToSingle(bytes, inside.Take(4)));
        }

        private void SignedNumbers(List<int> values) {
            ProtoReader inside = Inside();
            while (inside.at < inside.end) {
                ulong coded = inside.Varint(); // zigzag
                values.Add((int)(coded >> 1) ^ -(int)(coded & 1));
            }
        }

        private void Skip() {
            if (kind == 2) Inside();
            else Number();
        }
    }
}
