#include <catch2/catch.hpp>

#include <unistd.h>
#include <cmath>
#include <filesystem>
#include <numbers>

#include "proto/clip/format.hpp"
#include "tests/support/replaced.hpp"
#include "tests/support/shared.hpp"

namespace posed::clip {
namespace {

using test::replaced;

const std::string kHeader =
    "HIERARCHY\n"
    "ROOT Hips\n"
    "{\n"
    "  OFFSET 0 0 0\n"
    "  CHANNELS 6 Xposition Yposition Zposition Zrotation Yrotation Xrotation\n"
    "  JOINT Left Arm:upper\n"
    "  {\n"
    "    OFFSET 0 80 0\n"
    "    CHANNELS 3 Zrotation Xrotation Yrotation\n"
    "    End Site\n"
    "    {\n"
    "      OFFSET 0 90 0\n"
    "    }\n"
    "  }\n"
    "}\n"
    "MOTION\n";
const std::string kTwoFrames =
    "Frames: 2\nFrame Time: .0083333\n"
    "0 100 0 0 0 0 90 0 0\n"
    "1 100 2e1 0 90 0 0 0 90";

Result<Clip> parse_bvh(const std::string& text) {
  return parse_clip({.name = "x.bvh", .bytes = text});
}

void check_error(const std::string& text, const std::string& expected) {
  const auto clip = parse_bvh(text);
  REQUIRE_FALSE(clip.has_value());
  INFO(clip.error().text());
  CHECK(clip.error().text().starts_with(expected));
}

}  // namespace

TEST_CASE("a BVH gives names, offsets, channels, rate and values") {
  const auto clip = parse_bvh(kHeader + kTwoFrames);
  REQUIRE(clip.has_value());
  REQUIRE(clip->skeleton->joints.size() == 2);
  CHECK(clip->skeleton->joints[1].name == "Left Arm:upper");
  CHECK(clip->skeleton->joints[1].offset_m.y() == Approx(0.8));
  CHECK(clip->skeleton->joints[1].end_site_m->y() == Approx(0.9));
  CHECK(clip->frame_rate_hz == 120.0);
  CHECK(clip->frames() == 2);
  CHECK(clip->channels(1, 2) == Approx(0.2));
  CHECK(clip->channels(1, 4) == Approx(std::numbers::pi / 2));
  const Frame frame = clip->frame(1);
  CHECK(frame.root_position_m[2] == Approx(0.2));
  CHECK(frame.rotation_xyzw[0][1] == Approx(std::sqrt(0.5)));
  CHECK(frame.angle_count == 6);
  CHECK(frame.valid.count() == 2);
  CHECK(frame.header.device_ns == 8333333);
}

TEST_CASE("a BVH is read leniently where the pose is not in doubt") {
  std::string text = "\xEF\xBB\xBF" + replaced(kHeader, "Left Arm:upper\n  {", "Left Arm:upper {");
  text += "\n\n  " + replaced(kTwoFrames, "Frames: 2", "Frames : 4000000000") + "  \n\n";
  std::string crlf;
  for (const char c : text)
    crlf += c == '\n' ? std::string("\r\n") : std::string(1, c == ' ' ? '\t' : c);
  crlf = replaced(crlf, "Left\tArm", "Left Arm");
  const auto clip = parse_bvh(crlf);
  if (!clip) FAIL(clip.error().text());
  CHECK(clip->frames() == 2);
  CHECK(clip->skeleton->joints[1].name == "Left Arm:upper");
  bool reported = false;
  for (const std::string& warning : clip->warnings)
    reported |= warning.find("'4000000000'") != std::string::npos;
  CHECK(reported);
}

TEST_CASE("a BVH that would give a wrong pose is refused with its line") {
  const std::string good = kHeader + kTwoFrames;
  check_error("", "x.bvh:1: does not begin with HIERARCHY");
  check_error("SQLite format 3", "x.bvh:1: does not begin with HIERARCHY");
  check_error(kHeader.substr(0, 60), "x.bvh:5:");
  check_error(kHeader.substr(0, kHeader.size() - 7), "x.bvh:16: has no MOTION");
  check_error(kHeader, "x.bvh:17: 'Frames: <count>'");
  check_error(kHeader + "Frames: 0\nFrame Time: 0.01\n", "x.bvh: has no frames");
  check_error(replaced(good, ".0083333", "0"), "x.bvh:18: Frame Time '0'");
  check_error(replaced(good, ".0083333", "-1"), "x.bvh:18: Frame Time '-1'");
  check_error(replaced(good, ".0083333", "11"), "x.bvh:18: Frame Time '11'");
  check_error(replaced(good, ".0083333", "nan"), "x.bvh:18: Frame Time 'nan'");
  check_error(replaced(good, "0 100 0 0", "0 nan 0 0"), "x.bvh:19: frame 1: 'nan' is not a number");
  check_error(replaced(good, "2e1", "inf"), "x.bvh:20: frame 2: 'inf' is not a number");
  check_error(replaced(good, "2e1", "2,1"), "x.bvh:20: frame 2: '2,1' is not a number");
  check_error(replaced(good, "2e1", "2e300"), "x.bvh:20: frame 2: '2e300' is not a number");
  check_error(replaced(good, "2e1 ", ""), "x.bvh:20: frame 2: the frame has 8 values");
  check_error(replaced(good, "2e1", "2 1"), "x.bvh:20: frame 2: the frame has 10 values or more");
  check_error(replaced(good, "Xposition", "Wposition"), "x.bvh:5: unknown channel 'Wposition'");
  check_error(replaced(good, "Xposition", "Yposition"), "x.bvh:5: channel 'Yposition' twice");
  check_error(replaced(good, "CHANNELS 6", "CHANNELS 5"),
              "x.bvh:5: joint 'Hips' lists more channels");
  check_error(replaced(good, "CHANNELS 6", "CHANNELS 7"), "x.bvh:5: CHANNELS of joint 'Hips'");
  check_error(replaced(good, "    OFFSET 0 80 0\n", ""),
              "x.bvh:13: joint 'Left Arm:upper' has no OFFSET");
  check_error(replaced(good, "OFFSET 0 80 0", "OFFSET 0 nan 0"),
              "x.bvh:8: OFFSET of joint 'Left Arm");
  check_error(replaced(good, "    CHANNELS 3 Zrotation Xrotation Yrotation\n", ""),
              "x.bvh:13: joint 'Left Arm:upper' has no CHANNELS");
  check_error(replaced(good, "  }\n}\nMOTION", "  }\nMOTION"),
              "x.bvh:15: the file ends, or its MOTION");
  check_error(replaced(good, "}\nMOTION", "}\n}\nMOTION"),
              "x.bvh:16: has a closing brace too many");
  check_error(replaced(good, "}\nMOTION", "}\nROOT b {}\nMOTION"), "x.bvh:16: has a second ROOT");
}

TEST_CASE("joints of one name are told apart by their parents") {
  const auto joint = [](const std::string& name, const std::string& inside) {
    return "JOINT " + name + "\n{\nOFFSET 0 8 0\nCHANNELS 3 Zrotation Xrotation Yrotation\n" +
           (inside.empty() ? "End Site\n{\nOFFSET 0 9 0\n}\n" : inside) + "}\n";
  };
  const auto parse = [&](const std::string& joints, int count) {
    std::string frames = "MOTION\nFrames: 1\nFrame Time: 0.01\n";
    for (int i = 0; i < 6 + 3 * count; ++i) frames += std::to_string(i) + " ";
    return parse_bvh(
        "HIERARCHY\nROOT Hips\n{\nOFFSET 0 0 0\nCHANNELS 6 Xposition Yposition Zposition "
        "Zrotation Xrotation Yrotation\n" +
        joints + "}\n" + frames);
  };
  const std::string thumb = joint("Thumb1", joint("Thumb2", ""));
  const auto clip = parse(joint("LeftHand", thumb) + joint("RightHand", thumb), 6);
  INFO((clip ? std::string() : clip.error().text()));
  REQUIRE(clip.has_value());
  std::string names;
  for (const Joint& one : clip->skeleton->joints) names += one.name + " ";
  CHECK(names == "Hips LeftHand Thumb1 Thumb2 RightHand RightHand/Thumb1 RightHand/Thumb1/Thumb2 ");
  const auto said = std::ranges::find_if(clip->warnings, [](const std::string& warning) {
    return warning.find("parent, too, as 'RightHand/Thumb1'") != warning.npos;
  });
  CHECK(said != clip->warnings.end());
  const auto legs = parse(joint("Leg", "") + joint("Leg", ""), 2);
  REQUIRE(legs.has_value());
  CHECK(legs->skeleton->joints[2].name == "Hips/Leg");
  const auto three = parse(joint("Leg", "") + joint("Leg", "") + joint("Leg", ""), 3);
  REQUIRE(three.has_value());
  CHECK(three->skeleton->joints[3].name == "Hips/Leg-2");
  // However deep: names stay short enough for messages to keep them whole.
  std::string deep;
  for (int i = 0; i < 60; ++i) deep = joint("Spine", deep);
  const auto chain = parse(deep, 60);
  REQUIRE(chain.has_value());
  for (const Joint& one : chain->skeleton->joints) CHECK(one.name.size() <= 128);
  const std::string stem(150, 'x');
  const auto alike = parse(joint(stem + "1", "") + joint(stem + "2", ""), 2);
  REQUIRE(alike.has_value());
  const std::string& second = alike->skeleton->joints[2].name;
  CHECK(second.size() <= 128);
  CHECK(second != alike->skeleton->joints[1].name);
}

TEST_CASE("joints nested too deep or too many are refused") {
  std::string deep = "HIERARCHY\nROOT j\n{\nOFFSET 0 0 0\nCHANNELS 1 Xrotation\n";
  for (int i = 0; i < 200; ++i) {
    deep += "JOINT j" + std::to_string(i) + "\n{\nOFFSET 0 0 0\nCHANNELS 1 Xrotation\n";
  }
  check_error(deep, "x.bvh:386: joints are nested deeper than 96");
  std::string wide = "HIERARCHY\nROOT j\n{\nOFFSET 0 0 0\nCHANNELS 1 Xrotation\n";
  for (int i = 0; i < 200; ++i) {
    wide += "JOINT j" + std::to_string(i) + "\n{\nOFFSET 0 0 0\nCHANNELS 1 Xrotation\n}\n";
  }
  wide += "}\nMOTION\nFrames: 1\nFrame Time: 0.1\n0";
  for (int i = 0; i < 200; ++i) wide += " 0";
  check_error(wide, "x.bvh: the skeleton has 201 joints; posed carries at most 96");
}

TEST_CASE("a written BVH reads back the same") {
  const auto first = parse_bvh(kHeader + kTwoFrames);
  REQUIRE(first.has_value());
  const auto path =
      std::filesystem::temp_directory_path() / ("posed_bvh_" + std::to_string(::getpid()) + ".bvh");
  REQUIRE(write_bvh(*first, path).has_value());
  const auto again = read_clip(path);
  std::filesystem::remove(path);
  REQUIRE(again.has_value());
  CHECK(again->skeleton->id == first->skeleton->id);
  CHECK(again->frame_rate_hz == first->frame_rate_hz);
  CHECK((again->channels - first->channels).cwiseAbs().maxCoeff() < 1e-10);
}

TEST_CASE("position channels of a joint replace its OFFSET, but nearly nothing is added to it") {
  const std::string header = replaced(kHeader, "CHANNELS 3 Zrotation Xrotation Yrotation",
                                      "CHANNELS 6 Xposition Yposition Zposition Zrotation "
                                      "Xrotation Yrotation");
  const auto arm_m = [&header](const std::string& position) {
    const auto clip =
        parse_bvh(header + "Frames: 1\nFrame Time: .03\n0 100 0 0 0 0 " + position + " 0 0 0\n");
    REQUIRE(clip.has_value());
    return clip->skeleton->joints[1].offset_m;
  };
  CHECK(arm_m("0 70 5").isApprox(Eigen::Vector3d(0, .7, .05)));
  CHECK(arm_m("0 0 0").isApprox(Eigen::Vector3d(0, .8, 0)));  // as Blender writes MakeHuman's
  CHECK(arm_m("0 0 1").isApprox(Eigen::Vector3d(0, .8, 0)));
}

TEST_CASE("the real recordings are read") {
  const auto cmu = test::shared("data/cmu/07_01.bvh");
  const auto bandai = test::shared("data/styles/dataset-2_walk_feminine_001.bvh");
  if (!cmu || !bandai) {
    SKIP_WITHOUT_SHARED();
  }
  const auto walk = read_clip(*cmu);
  REQUIRE(walk.has_value());
  CHECK(walk->frames() == 317);
  CHECK(walk->skeleton->joints.size() == 31);
  CHECK(walk->frame_rate_hz == 120.0);
  const auto acted = read_clip(*bandai);
  REQUIRE(acted.has_value());
  CHECK(acted->frame_rate_hz == 30.0);
  CHECK(acted->skeleton->joints[acted->skeleton->root_joint].name == "Hips");
  CHECK(acted->frame(0).root_position_m[1] == Approx(0.895634));
}

}  // namespace posed::clip
