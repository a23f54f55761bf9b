// Files whose zero pose stands along z: read with Y up, written back as they were.
#include <fstream>
#include <sstream>
#include <utility>

#include <catch2/catch.hpp>

#include "proto/clip/device_clip.hpp"
#include "tests/support/file_text.hpp"
#include "tests/support/temp_folder.hpp"
#include "tests/unit/proto/rig/maker.hpp"

namespace posed::clip {
namespace {

using test::ZeroPose;

// A walk with +Y up, in metres.
Clip walker() {
  const auto made = test::make(test::kSchemes[0], ZeroPose::kA, rig::Mat::Identity(), 1.0);
  auto skeleton = std::make_shared<Skeleton>();
  for (std::size_t j = 0; j < made.input.joints.size(); ++j) {
    const auto& from = made.input.joints[j];
    Joint& joint = skeleton->joints.emplace_back();
    joint.name = from.name;
    joint.parent = from.parent;
    joint.offset_m = from.offset;
    joint.end_site_m = from.end_site;
    for (const Axis axis : {Axis::kX, Axis::kY, Axis::kZ}) {
      const auto index = static_cast<std::uint16_t>(j);
      if (j == 0) {
        skeleton->channels.push_back({.joint = index, .axis = axis, .translation = true});
      }
    }
    for (const Axis axis : {Axis::kZ, Axis::kX, Axis::kY}) {
      skeleton->channels.push_back({.joint = static_cast<std::uint16_t>(j), .axis = axis});
    }
  }
  REQUIRE(skeleton->finish().has_value());
  const auto& poses = made.input.poses;
  Clip clip;
  clip.path = "walk";
  clip.skeleton = skeleton;
  clip.frame_rate_hz = 30.0;
  clip.channels.resize(poses.count, std::ssize(skeleton->channels));
  for (int i = 0; i < poses.count; ++i) {
    for (int j = 0; j < test::kMakerJoints; ++j) {
      const auto at = static_cast<std::size_t>(i) * test::kMakerJoints + j;
      const auto angles = channels_from_rotation(*skeleton, j, poses.rotation[at], {});
      for (int k = 0; k < 3; ++k) {
        clip.channels(i, 3 + 3 * j + k) = angles[k];
        if (j == 0) clip.channels(i, k) = poses.position[at][k];
      }
    }
  }
  return clip;
}

}  // namespace

TEST_CASE("a BVH with another axis up is turned to Y up and written back as it was") {
  for (const UpAxis up : {UpAxis::kPlusZ, UpAxis::kMinusY, UpAxis::kMinusZ, UpAxis::kPlusX}) {
    INFO(up_text(up));
    const test::TempFolder folder;
    const auto file = folder.path() / "walk.bvh";
    Clip walk = walker();
    walk.up = up;
    walk.metres_per_unit = 0.0254;
    REQUIRE(write_bvh(walk, file).has_value());
    const std::string bytes = test::file_text(file);
    const auto own = read_clip(file);
    if (!own) FAIL(own.error().text());
    CHECK(own->warnings == std::vector<std::string>{});
    // Another program's says neither unit nor axis.
    const std::size_t mark = bytes.find('\t', bytes.find("Frame Time"));
    std::ofstream(file, std::ios::binary)
        << bytes.substr(0, mark) << bytes.substr(bytes.find('\n', mark));
    const auto read = read_clip(file);
    if (!read) FAIL(read.error().text());
    REQUIRE_FALSE(read->warnings.empty());
    CHECK_THAT(read->warnings[0],
               Catch::Contains("inches") && Catch::Contains(std::string(up_text(up))));
    for (const auto* clip : {&*own, &*read}) {
      CHECK(up_text(clip->up) == up_text(up));
      CHECK(clip->metres_per_unit == 0.0254);
    }
    CHECK((read->channels - walk.channels).cwiseAbs().maxCoeff() < 1e-9);
    for (std::size_t j = 0; j < walk.skeleton->joints.size(); ++j) {
      const Joint& is = read->skeleton->joints[j];
      const Joint& was = walk.skeleton->joints[j];
      CHECK(is.bone == was.bone);
      CHECK((is.offset_m - was.offset_m).norm() < 1e-9);
      CHECK(angle_between_rad(is.T_world_joint, was.T_world_joint) < 1e-6);
    }
    REQUIRE(write_bvh(*read, file).has_value());
    CHECK(test::file_text(file) == bytes);
  }
}

TEST_CASE("the description of a Z-up clip decodes as the clip, from its first frame alone") {
  const test::TempFolder folder;
  const auto file = folder.path() / "walk.bvh";
  Clip walk = walker();
  walk.up = UpAxis::kPlusZ;
  REQUIRE(write_bvh(walk, file).has_value());
  const auto device = open_device_clip(file);
  const auto read = read_clip(file);
  REQUIRE(device.has_value());
  REQUIRE(read.has_value());
  const auto coding = parse_description(device->description, "log");
  if (!coding) FAIL(coding.error().text());
  CHECK(coding->skeleton->id == read->skeleton->id);
  std::vector<double> values(coding->parser.channels());
  REQUIRE(coding->parser.parse(device->frames[7], values).ok());
  for (std::size_t c = 0; c < values.size(); ++c) {
    CHECK(values[c] == read->channels(7, static_cast<Eigen::Index>(c)));
  }
  const std::string damaged =
      "posed-clip bvh rate_hz=30 metres_per_unit=1 root_joint=0 asf_bytes=0 skeleton_bytes=";
  CHECK_FALSE(parse_description(damaged + "1e9\n", "log").has_value());
  CHECK_FALSE(parse_description(damaged + "2\n{}" + test::file_text(file), "log").has_value());
}

TEST_CASE("of a figure with too many joints, those that are no bones are left out") {
  const test::TempFolder folder;
  const auto file = folder.path() / "walk.bvh";
  const Clip walk = walker();
  REQUIRE(write_bvh(walk, file).has_value());
  std::string text = test::file_text(file);
  std::string face;
  for (int i = 0; i < 100; ++i) {
    face += "JOINT face" + std::to_string(i) + "\n{\nOFFSET 1 2 3\nCHANNELS 1 Xrotation\n}\n";
  }
  // The face's values stand behind the neck's and the head's, before those of the arms.
  text.insert(text.find("End Site"), face);
  std::istringstream lines(std::exchange(text, {}));
  const std::size_t before_face = 3 + 3 * (static_cast<std::size_t>(Bone::kHead) + 1);
  bool moves = false;
  for (std::string line; std::getline(lines, line);) {
    std::size_t at = 0;
    for (std::size_t i = 0; moves && i < before_face; ++i) at = line.find(' ', at + 1);
    if (moves && !line.empty()) {
      for (int i = 0; i < 100; ++i) line.insert(at, " 7");
    }
    moves = moves || line.starts_with("Frame Time");
    text += line + '\n';
  }
  std::ofstream(file, std::ios::binary) << text;
  const auto read = read_clip(file);
  if (!read) FAIL(read.error().text());
  CHECK(read->skeleton->joints.size() == kMaxJoints);
  CHECK_THAT(read->warnings.back(), Catch::Contains("has 122 joints") && Catch::Contains("26"));
  const Frame was = walk.frame(9);
  const Frame is = read->frame(9);
  for (int b = 0; b < test::kMakerJoints; ++b) {
    const int j = read->skeleton->joint_of(static_cast<Bone>(b));
    REQUIRE(j >= 0);
    CHECK(
        (to_eigen(is.rotation_xyzw[j]).coeffs() - to_eigen(was.rotation_xyzw[b]).coeffs()).norm() <
        1e-5);
  }
  const auto device = open_device_clip(file);
  REQUIRE(device.has_value());
  const auto coding = parse_description(device->description, "log");
  REQUIRE(coding.has_value());
  CHECK(coding->skeleton->id == read->skeleton->id);
  std::vector<double> values(coding->parser.channels());
  CHECK(coding->parser.parse(device->frames[3], values).ok());
}

}  // namespace posed::clip
