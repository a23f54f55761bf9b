// The Python client's examples with the real daemon: forward kinematics, keys, gestures, recording.
#include <catch2/catch.hpp>

#include <csignal>
#include <cstdio>
#include <filesystem>
#include <memory>

#include "models/gesture/model_file.hpp"
#include "tests/e2e/printed_places.hpp"
#include "tests/e2e/served.hpp"
#include "tests/support/shared.hpp"
#include "tests/unit/models/gesture/toy_gesture.hpp"

namespace posed::test {
namespace {

// What Debian's own python3 prints for a script that uses the client.
std::string run_python(const std::filesystem::path& script, const std::string& arguments) {
  const auto build = posed_binary().parent_path() / "python";
  const std::string command = "PYTHONPATH='" + build.string() + "' timeout 60 /usr/bin/python3 '" +
                              script.string() + "' " + arguments + " 2>&1";
  const std::unique_ptr<FILE, int (*)(FILE*)> client(popen(command.c_str(), "r"), pclose);
  REQUIRE(client);
  std::string said;
  for (char line[512]; std::fgets(line, sizeof line, client.get()) != nullptr;) said += line;
  return said;
}

std::string example(const std::string& script, const std::string& arguments) {
  return run_python(source_dir() / "proto/clients/python/examples" / script, arguments);
}

}  // namespace

TEST_CASE("the Python client's joints and fingertips are those of the clip that plays") {
  Served served;
  served.start();
  const std::string said = example("watch.py", "walker-raw --count 1 --connect " + served.publish);
  INFO(said);
  const Places shown = printed_places(said);
  CHECK(shown.contains("tip of Head"));
  CHECK(nearest_m(shown, served.folder.path() / "walk.bvh", true) < 2e-6);  // six decimals
}

TEST_CASE("the Python client reads the timecode") {
  Process emulator(
      {"emulate", "posed", "--set", "stream=walker", "--publish", "tcp://127.0.0.1:*"});
  const auto ready = emulator.line();
  REQUIRE(ready);
  const std::string said =
      example("watch.py", "walker --count 1 --connect " +
                              std::string(nlohmann::json::parse(*ready).at("port")));
  INFO(said);
  CHECK(has(said, ", 01:00:"));
}

TEST_CASE("the Python client records, has keys, and says what the daemon refuses") {
  Served served;
  for (const char* name : {"stage", "me"}) {
    REQUIRE(posed({"keygen", name, "--out", served.folder.path().string()}).code == 0);
  }
  served.write_config(
      "[security]\nserver_key = \"stage.key\"\n[[security.client]]\nname = \"me\"\n"
      "public_key = \"me.pub\"\nrights = [\"subscribe\", \"control\"]\n");
  served.start();
  const std::string keys =
      " --key " + served.path("me.key") + " --server-key " + served.path("stage.pub");
  const std::string out = served.path("walk.npz");
  const std::string recorded =
      example("record.py", "walker " + out + " --seconds 0.5 --connect " + served.publish + keys);
  CHECK(has(recorded, out + ": "));
  CHECK(has(recorded, ", 5 joints"));
  const std::string nobody =
      example("watch.py", "wanderer --timeout 1 --connect " + served.publish + keys);
  CHECK(has(nobody, " came for 1.0 s"));  // no pose, or nothing at all
  const std::string refused = example("play.py", "walker g --connect " + served.control + keys);
  CHECK(has(refused, "play.py: "));
  CHECK(has(refused, "walker"));
}

TEST_CASE("the Python client performs gestures on a hand") {
  Stage stage;
  REQUIRE(gesture::save_model(toy_gesture_model(), stage.folder.path() / "toy.gesture"));
  stage.folder.write("posed.toml", std::string(Stage::kEndpoints) +
                                       "[[stream]]\nname = \"hand\"\ndriver = \"labels\"\n"
                                       "[stream.labels]\nrate_hz = 60.0\n"
                                       "[stream.generate]\nmodel = \"toy.gesture\"\n");
  stage.launch("run");
  CHECK(has(example("play.py", "hand p --connect " + stage.control), "playing from frame "));
  CHECK(has(example("play.py", "hand --connect " + stage.control), "back to the live hand"));
}

TEST_CASE("the Python client marks takes of a recording") {
  Served served;
  const auto script = served.folder.write("takes.py", R"(
import sys
import posed

with posed.Control(sys.argv[1]) as control:
    try:
        control.end_take()
    except posed.PosedError as error:
        print("refused:", error)
    first = control.take("walk").take
    print("began", first.number, first.name, control.status().take.name)
    second = control.take().take
    print("began", second.number, repr(second.name), second.start_ns > first.start_ns)
    print("ended", control.end_take().take.number, control.status().HasField("take"))
)");
  served.record();
  const std::string said = run_python(script, served.control);
  INFO(said);
  CHECK(has(said, "refused: "));
  CHECK(has(said, "began 1 walk walk\nbegan 2 '' True\nended 2 False\n"));
  served.daemon->send(SIGTERM);
  CHECK(served.daemon->exit_code() == 0);
  const auto takes = posed({"convert", served.path("take.plog"), "--takes", "--json"});
  INFO(takes.err);
  const auto marked = nlohmann::json::parse(takes.out);
  REQUIRE(marked.size() == 2);
  CHECK(marked[0].at("name") == "walk");
  CHECK(marked[1].at("ended") == true);
}

TEST_CASE("the Python and the C++ client pass over what no daemon sends") {
  const TempFolder folder;
  const auto script = folder.write("hostile.py", R"(
import itertools
import subprocess
import sys
import threading
import time
import zmq
import posed
from posed.v1 import control_pb2, posed_pb2

skeleton = dict(stream="walker", id=7, joint_name=["hips"], parent=[-1], offset_m=[0, 0, 0],
                humanoid_bone=["hips"], T_world_joint_xyzw=[0, 0, 0, 1])
frame = dict(stream="walker", skeleton_id=7, root_position_m=[1, 2, 3], rotation_xyzw=[0, 0, 0, 1],
             validity=b"\x01")
def messages(topic, kind, sound, *changes):
    return [[topic, kind(**{**sound, **change}).SerializeToString()] for change in changes]
skeletons = messages(b"skeleton/walker", posed_pb2.Skeleton, skeleton, {"parent": [0]},
                     {"parent": [-1, 0]}, {"offset_m": []}, {"joint_name": ["hips"] * 9},
                     {"root_joint": 1}, {"parent": [-7]}, {})
frames = messages(b"pose/walker", posed_pb2.Frame, frame, {"rotation_xyzw": [0, 0, 1]},
                  {"root_position_m": []}, {"skeleton_id": 8}, {})
junk = [[b"pose/walker"], [b"skeleton/walker", b"\xff"], [b"pose/walker", b"\xff", b"3"],
        [b"statsx", b""], [b"stats", b"\xff"], [b"pose/walker\xff", b""]]

context = zmq.Context()
publisher = context.socket(zmq.PUB)
endpoint = f"tcp://127.0.0.1:{publisher.bind_to_random_port('tcp://127.0.0.1')}"
talks = skeletons + frames + junk
over = False
def publish():
    while not over:
        for message in talks:
            publisher.send_multipart(message)
        time.sleep(0.01)
thread = threading.Thread(target=publish)
thread.start()
try:
    with posed.Client(endpoint, ["walker"]) as client:
        for frame in itertools.islice(client.frames(10), 3):
            print("python", frame.positions_m())
        watch = [sys.argv[1], endpoint, "walker", "3"]
        print(subprocess.run(watch, capture_output=True, text=True))
        talks = skeletons[:-1] + frames[:-1] + junk
        try:
            for _ in client.frames(1):
                pass
        except posed.PosedError as error:
            print(error)
        talks = [[b"pose/walker", bytes(2 << 20)]]
        time.sleep(0.5)
        talks = skeletons + frames
        for frame in itertools.islice(client.frames(20), 1):
            print("back", frame.positions_m())
finally:
    over = True
    thread.join()

router = context.socket(zmq.ROUTER)
port = router.bind_to_random_port("tcp://127.0.0.1")
sound = control_pb2.ControlReply(ok=True).SerializeToString()
def answer():
    for parts in ([b"\xff"], [sound, sound], [sound]):
        router.send_multipart([*router.recv_multipart()[:2], *parts])
threading.Thread(target=answer).start()
with posed.Control(f"tcp://127.0.0.1:{port}") as control:
    for _ in range(3):
        try:
            print("answered", control.end_take().ok)
        except posed.PosedError as error:
            print(error)
)");
  const std::string said =
      run_python(script, (posed_binary().parent_path() / "posed_client_watch").string());
  INFO(said);
  const std::string python = "python {'hips': (1.0, 2.0, 3.0)}\n";
  CHECK(has(said, python + python + python));
  CHECK(has(said, "returncode=0"));
  CHECK(has(said, " came for 1 s"));
  CHECK(has(said, "back {'hips'"));
  CHECK(has(said,
            "daemon\n"
            "tcp"));
  CHECK(has(said, "daemon\nanswered True\n"));
}

}  // namespace posed::test
