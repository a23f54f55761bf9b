// `posed inspect` and `posed compare`: what a figure is taken for, and the profile that says so.
#include <catch2/catch.hpp>

#include <nlohmann/json.hpp>

#include "models/motion/synthetic_walker.hpp"
#include "proto/text/load_file.hpp"
#include "tests/e2e/served.hpp"
#include "tests/support/free_port.hpp"

namespace posed::test {
namespace {

using nlohmann::json;

TEST_CASE("inspect names the bones, and its profile gives the same figure back") {
  const Stage stage;
  const auto walk = motion::make_walker({.seconds = 1.0});
  REQUIRE(walk.has_value());
  REQUIRE(clip::write_bvh(*walk, stage.folder.path() / "walk.bvh"));
  const std::string clip = stage.path("walk.bvh");
  const std::string map = stage.path("map.toml");
  const auto shown = posed({"inspect", clip, "--write", map, "--json"});
  INFO(shown.err);
  REQUIRE(shown.code == 0);
  const json found = json::parse(shown.out);
  CHECK(found.at("person") == true);
  CHECK(found.at("up") == "+y");
  CHECK(found.at("metres_per_unit") == 0.01);
  REQUIRE(found.at("bones").size() >= 19);
  for (const json& bone : found.at("bones")) CHECK(bone.at("sure").get<double>() > 0.5);
  CHECK(has(posed({"inspect", clip}).out, "T-pose ... first frame ... leftUpperLeg"));

  // glTF has metres, although a BVH that is written of it has centimetres.
  REQUIRE(posed({"convert", clip, "--out", stage.path("walk.glb")}).code == 0);
  const auto gltf = posed({"inspect", stage.path("walk.glb"), "--json"});
  CHECK(json::parse(gltf.out).at("metres_per_unit") == 1.0);
  CHECK(has(posed({"inspect", stage.path("walk.glb")}).out, "lengths in metres"));

  const auto again = posed({"inspect", clip, "--profile", map, "--json"});
  REQUIRE(again.code == 0);
  const json mapped = json::parse(again.out);
  CHECK(mapped.at("bones").size() == found.at("bones").size());
  CHECK(mapped.at("bones")[3].at("why") == "the file or a profile says so");
  // A profile that does not fit is refused by the joint that is missing.
  std::string text = load_file(map, {.what = "profile", .max_bytes = 1 << 20}).value();
  const std::string hips = found.at("bones")[0].at("joint");
  text.replace(text.find(hips), hips.size(), "nobody");
  stage.folder.write("wrong.toml", text);
  const auto refused = posed({"inspect", clip, "--profile", stage.path("wrong.toml")});
  CHECK(refused.code != 0);
  CHECK(has(refused.err, "nobody"));
}

TEST_CASE("a running stream is inspected, and its source takes the corrected mapping") {
  Stage stage;
  const std::string port = "127.0.0.1:" + std::to_string(free_port());
  const std::string config = std::string(Stage::kEndpoints) +
                             "[[source]]\nname = \"room\"\ndriver = \"template_mocap\"\n"
                             "streams = \"all\"\nMAP[source.template_mocap]\nlisten = \"" +
                             port + "\"\n";
  const auto write_config = [&](const std::string& map) {
    std::string text = config;
    stage.folder.write("posed.toml", text.replace(text.find("MAP"), 3, map));
  };
  const auto inspect = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"inspect", "room-walker", "--connect", stage.publish, "--timeout",
                               "60", "--json"});
    auto shown = posed(std::move(more));
    INFO(shown.err);
    REQUIRE(shown.code == 0);
    return json::parse(shown.out);
  };
  const auto joint_of = [](const json& found, const std::string& bone) {
    for (const json& one : found.at("bones")) {
      if (one.at("bone") == bone) return one.at("joint").get<std::string>();
    }
    return std::string();
  };
  write_config("");
  stage.launch("run");
  const Process room({"emulate", "template_mocap", "--udp", port});
  const std::string map = stage.path("map.toml");
  const json found = inspect({"--write", map});
  CHECK(joint_of(found, "head") == "head");
  CHECK(joint_of(found, "leftUpperLeg") == "leftUpperLeg");
  CHECK(posed({"inspect", "room-walker", "--up", "+z", "--connect", stage.publish}).code == 2);
  stage.daemon->send(SIGTERM);
  REQUIRE(stage.daemon->exit_code() == 0);

  std::string text = load_file(map, {.what = "profile", .max_bytes = 1 << 20}).value();
  text.replace(text.find("\nhead = "), 5, "\nneck");
  stage.folder.write("mine.toml", text);
  write_config("skeleton = \"mine.toml\"\n");
  stage.record();
  const json mapped = inspect({});
  CHECK(joint_of(mapped, "head").empty());
  CHECK(joint_of(mapped, "neck") == "head");
  stage.await_frames("room-walker", 20);
  stage.daemon->send(SIGTERM);
  REQUIRE(stage.daemon->exit_code() == 0);
  // The waver has no legs.
  CHECK(has(stage.daemon->errors(), "mine.toml does not fit its body ... no joint"));
  stage.check_replay();
}

TEST_CASE("compare tells figures and persons apart") {
  const Stage stage;
  const auto write = [&](const std::string& name, std::uint32_t person) {
    const auto walk = motion::make_walker({.person = person, .seconds = 1.0});
    REQUIRE(walk.has_value());
    REQUIRE(clip::write_bvh(*walk, stage.folder.path() / name));
  };
  write("a.bvh", 1);
  write("b.bvh", 2);
  const auto same = posed({"compare", stage.path("a.bvh"), stage.path("a.bvh")});
  CHECK(same.code == 0);
  CHECK(has(same.err, "one figure"));
  const auto taller = posed({"compare", stage.path("a.bvh"), stage.path("b.bvh")});
  CHECK(taller.code == 0);
  CHECK(has(taller.err, "two persons"));
}

}  // namespace
}  // namespace posed::test
