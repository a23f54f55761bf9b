// Subscribes to a stream of posed: ZeroMQ's protocol ZMTP 3.0 (rfc.zeromq.org/spec/23) without keys,
// over one TCP connection. It reconnects by itself, and keeps only the newest pose.
using System;
using System.IO;
using System.Net.Sockets;
using System.Text;
using System.Threading;

namespace Posed {
    public sealed class PosedSubscriber : IDisposable {
        private const int LongestMessage = 1 << 20;
        private const int RetryMs = 1000;
        private const int SilenceMs = 5000; // stats come every second, whatever the streams do

        private readonly string host, stream;
        private readonly int port;
        private readonly object gate = new object();
        private readonly Thread thread;
        private readonly ManualResetEvent stop = new ManualResetEvent(false);
        private TcpClient connection;
        private PosedFrame newest;
        private PosedSkeleton skeleton;

        // Why there is no connection, for people; "" while there is one.
        public string Problem { get; private set; }

        public PosedSubscriber(string host, int port, string stream) {
            this.host = host;
            this.port = port;
            this.stream = stream;
            Problem = "not connected yet";
            thread = new Thread(Run) { IsBackground = true, Name = "posed" };
            thread.Start();
        }

        // The newest pose, once, with its skeleton; false while there is no newer one. Any thread.
        public bool TryTake(out PosedFrame frame, out PosedSkeleton itsSkeleton) {
            lock (gate) {
                frame = newest;
                itsSkeleton = skeleton;
                if (frame == null || skeleton == null || skeleton.Id != frame.SkeletonId
                    || skeleton.Names.Count != frame.Validity.Length) return false;
                newest = null;
                return true;
            }
        }

        public void Dispose() {
            stop.Set();
            lock (gate) connection?.Close();
            thread.Join(RetryMs);
        }

        private void Run() {
            do {
                try {
                    Receive();
                } catch (Exception error) { // whatever it is, it is tried again
                    Problem = error.Message;
                }
            } while (!stop.WaitOne(RetryMs));
        }

        private void Receive() {
            using (var client = new TcpClient(host, port)) {
                client.NoDelay = true;
                client.ReceiveTimeout = SilenceMs;
                lock (gate) connection = client;
                Stream wire = client.GetStream();
                Greet(wire);
                Subscribe(wire, "pose/" + stream);
                Subscribe(wire, "skeleton/" + stream);
                Subscribe(wire, "stats");
                Problem = "";
                while (!stop.WaitOne(0)) {
                    bool more;
                    byte[] topic = ReadFrame(wire, out more);
                    if (!more) continue; // every message of posed has two parts
                    byte[] body = ReadFrame(wire, out more);
                    Take(Encoding.UTF8.GetString(topic), body);
                }
            }
        }

        private void Take(string topic, byte[] body) {
            // A subscription is a prefix: "walker" also brings "walker-raw".
            lock (gate) {
                if (topic == "pose/" + stream) newest = ProtoReader.ReadFrame(body);
                if (topic == "skeleton/" + stream) skeleton = ProtoReader.ReadSkeleton(body);
            }
        }

        // Greeting: signature, version 3.0, mechanism NULL; then READY with the kind of socket.
        private static void Greet(Stream wire) {
            var greeting = new byte[64];
            greeting[0] = 0xFF;
            greeting[9] = 0x7F;
            greeting[10] = 3;
            Encoding.ASCII.GetBytes("NULL", 0, 4, greeting, 12);
            wire.Write(greeting, 0, greeting.Length);
            byte[] theirs = ReadBytes(wire, greeting.Length);
            if (theirs[0] != 0xFF || theirs[10] < 3) throw new IOException("no ZeroMQ of version 4 or later answers");
            if (Encoding.ASCII.GetString(theirs, 12, 5) != "NULL\0") {
                throw new IOException("the daemon wants a key; this client has none: use a daemon or relay on loopback");
            }
            Send(wire, 0x04, Encoding.ASCII.GetBytes("\x05READY\x0BSocket-Type\0\0\0\x03SUB"));
            bool more;
            ReadFrame(wire, out more); // their READY
        }

        private static void Subscribe(Stream wire, string topic) {
            Send(wire, 0x00, Encoding.UTF8.GetBytes("\x01" + topic));
        }

        private static void Send(Stream wire, byte flags, byte[] body) {
            if (body.Length > 255) throw new IOException("the stream's name is too long");
            var frame = new byte[2 + body.Length];
            frame[0] = flags;
            frame[1] = (byte)body.Length;
            Array.Copy(body, 0, frame, 2, body.Length);
            wire.Write(frame, 0, frame.Length);
        }

        // Flags (1: more parts follow, 2: eight bytes of length), length, content.
        private static byte[] ReadFrame(Stream wire, out bool more) {
            int flags = ReadBytes(wire, 1)[0];
            ulong size = 0;
            foreach (byte part in ReadBytes(wire, (flags & 2) != 0 ? 8 : 1)) size = size << 8 | part;
            if (size > LongestMessage) throw new IOException("a message of " + size + " bytes cannot be a pose");
            more = (flags & 1) != 0;
            return ReadBytes(wire, (int)size);
        }

        private static byte[] ReadBytes(Stream wire, int count) {
            byte[] bytes = new BinaryReader(wire).ReadBytes(count); // reads on until they are there
            if (bytes.Length < count) throw new IOException("the daemon has closed the connection");
            return bytes;
        }
    }
}
