// The Python client's examples with the real daemon: forward kinematics, keys, gestures, recording.
#include <catch2/catch.hpp>

#include <array>
#include <cstdio>
#include <map>
#include <memory>
#include <sstream>

#include "models/gesture/model_file.hpp"
#include "models/motion/kinematics.hpp"
#include "tests/e2e/served.hpp"
#include "tests/support/shared.hpp"
#include "tests/unit/models/gesture/toy_gesture.hpp"

namespace posed::test {
namespace {

// What Debian's own python3 prints for `script` of the client's examples.
std::string example(const std::string& script, const std::string& arguments) {
  const auto build = posed_binary().parent_path() / "python";
  const auto path = source_dir() / "proto/clients/python/examples" / script;
  const std::string command = "PYTHONPATH='" + build.string() + "' timeout 60 /usr/bin/python3 '" +
                              path.string() + "' " + arguments + " 2>&1";
  const std::unique_ptr<FILE, int (*)(FILE*)> client(popen(command.c_str(), "r"), pclose);
  REQUIRE(client);
  std::string said;
  for (char line[512]; std::fgets(line, sizeof line, client.get()) != nullptr;) said += line;
  return said;
}

using Places = std::map<std::string, Eigen::Vector3d>;

// "  NAME x y z" and "  tip of NAME x y z".
Places printed_places(const std::string& text) {
  Places places;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with("  ")) continue;
    std::istringstream words(line);
    std::vector<std::string> all;
    for (std::string word; words >> word;) all.push_back(word);
    REQUIRE(all.size() >= 4);
    std::string name = all[0];
    for (std::size_t i = 1; i + 3 < all.size(); ++i) name += " " + all[i];
    const std::size_t at = all.size() - 3;
    places[name] = {std::stod(all[at]), std::stod(all[at + 1]), std::stod(all[at + 2])};
  }
  return places;
}

// The joints and tips of one frame of the clip.
Places places_of(const clip::Clip& clip, int frame) {
  Places places;
  const motion::WorldPose pose = motion::world_pose(*clip.skeleton, clip.frame(frame));
  for (std::size_t j = 0; j < clip.skeleton->joints.size(); ++j) {
    const Joint& joint = clip.skeleton->joints[j];
    places[joint.name] = pose.position_m[j];
    if (!joint.end_site_m) continue;
    places["tip of " + joint.name] = pose.position_m[j] + pose.rotation[j] * *joint.end_site_m;
  }
  return places;
}

double distance_m(const Places& a, const Places& b) {
  double most_m = 0.0;
  for (const auto& [name, place] : a) most_m = std::max(most_m, (place - b.at(name)).norm());
  return most_m;
}

}  // namespace

TEST_CASE("the Python client's joints and fingertips are those of the clip that plays") {
  Served served;
  served.start();
  const std::string said = example("watch.py", "walker-raw --count 1 --connect " + served.publish);
  INFO(said);
  const Places shown = printed_places(said);
  const clip::Clip clip = clip::read_clip(served.folder.path() / "walk.bvh").value();
  REQUIRE(shown.size() == places_of(clip, 0).size());
  CHECK(shown.contains("tip of Head"));
  double nearest_m = 1.0;
  for (int i = 0; i < clip.frames(); ++i) {
    nearest_m = std::min(nearest_m, distance_m(places_of(clip, i), shown));
  }
  CHECK(nearest_m < 2e-6);  // six decimals are printed
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

}  // namespace posed::test
