#include <catch2/catch.hpp>

#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "proto/clip/clip.hpp"
#include "proto/clip/device_clip.hpp"
#include "proto/clip/format.hpp"
#include "proto/frame/degree.hpp"
#include "proto/frame/rotation.hpp"
#include "tests/support/replaced.hpp"
#include "tests/support/shared.hpp"
#include "tests/support/temp_folder.hpp"

namespace posed::clip {
namespace {

using test::replaced;

const std::string kAsf =
    "# comment\n"
    ":version 1.10\n"
    ":units\n"
    "  mass 1.0\n"
    "  length 0.45\n"
    "  angle deg\n"
    ":documentation\n"
    "   any words, \"dof: of any kind\n"
    ":root\n"
    "   order TX TY TZ RX RY RZ\n"
    "   axis XYZ\n"
    "   position 0 0 0\n"
    "   orientation 0 0 0\n"
    ":bonedata\n"
    "  begin\n"
    "     id 1\n"
    "     name thigh\n"
    "     direction 0 -1 0\n"
    "     length 8\n"
    "     axis 0 0 20  XYZ\n"
    "    dof rx rz\n"
    "    limits (-160.0 20.0)\n"
    "           (-inf 70.0)\n"
    "  end\n"
    "  begin\n"
    "     id 2\n"
    "     name shin\n"
    "     direction 0, -1, 0\n"
    "     length 7\n"
    "     axis 0 0 0 XYZ\n"
    "  end\n"
    ":hierarchy\n"
    "  begin\n"
    "    root thigh\n"
    "    thigh shin\n"
    "  end\n";
const std::string kAmc =
    "#!OML:ASF x.asf\n"
    ":FULLY-SPECIFIED\n"
    ":DEGREES\n"
    "1\n"
    "root 1 17 -26 10 20 30\n"
    "thigh 40 50\n"
    "2\n"
    "thigh 41 -1.5e1\n"
    "root 1 17 -25 10 20 30\n";

Result<Clip> parse_amc(const std::string& amc, const std::string& asf) {
  return parse_clip({.name = "x.amc", .bytes = amc, .skeleton_name = "x.asf", .skeleton = asf});
}

void check_error(const std::string& asf, const std::string& amc, const std::string& expected) {
  const auto clip = parse_amc(amc, asf);
  REQUIRE_FALSE(clip.has_value());
  INFO(clip.error().text());
  CHECK(clip.error().text().starts_with(expected));
}
void check_amc(const std::string& from, const std::string& to, const std::string& expected) {
  check_error(kAsf, replaced(kAmc, from, to), expected);
}
void check_asf(const std::string& from, const std::string& to, const std::string& expected) {
  check_error(replaced(kAsf, from, to), kAmc, expected);
}

}  // namespace

TEST_CASE("an AMC and its ASF give joints at bone starts and L = C M C^-1") {
  const auto clip = parse_amc(kAmc, kAsf);
  if (!clip) FAIL(clip.error().text());
  const Skeleton& skeleton = *clip->skeleton;
  REQUIRE(skeleton.joints.size() == 3);
  CHECK(skeleton.joints[1].offset_m.norm() == 0.0);
  CHECK(skeleton.joints[2].offset_m.y() == Approx(-8 * 0.0254 / 0.45));
  CHECK(skeleton.joints[2].end_site_m->y() == Approx(-7 * 0.0254 / 0.45));
  CHECK(clip->frames() == 2);
  CHECK(clip->frame_rate_hz == 120.0);
  const Frame frame = clip->frame(0);
  CHECK(frame.root_position_m[2] == Approx(-26 * 0.0254 / 0.45));
  const auto turn = [](Axis axis, double degrees) {
    return axis_rotation(axis, degrees * kDegree);
  };
  const Eigen::Quaterniond root = turn(Axis::kZ, 30) * turn(Axis::kY, 20) * turn(Axis::kX, 10);
  CHECK(angle_between_rad(to_eigen_double(frame.rotation_xyzw[0]), root) < 1e-6);
  const Eigen::Quaterniond c = turn(Axis::kZ, 20);
  const Eigen::Quaterniond thigh = c * turn(Axis::kZ, 50) * turn(Axis::kX, 40) * c.conjugate();
  CHECK(angle_between_rad(to_eigen_double(frame.rotation_xyzw[1]), thigh) < 1e-6);
  CHECK(skeleton.channels[6].axis == Axis::kZ);  // outermost first
  CHECK(skeleton.channels[6].max == Approx(70 * kDegree));
  CHECK(std::isinf(skeleton.channels[6].min));
}

TEST_CASE("radians and other line ends are understood") {
  std::string amc = replaced(kAmc, ":DEGREES", ":RADIANS");
  std::string crlf;
  for (const char c : amc) crlf += c == '\n' ? std::string("\r\n") : std::string(1, c);
  const auto clip = parse_amc(crlf, kAsf);
  if (!clip) FAIL(clip.error().text());
  CHECK(clip->channels(0, 5) == 10.0);
}

TEST_CASE("an AMC in other axes and another unit is the same motion, also as a stream") {
  const auto truth = parse_amc(kAmc, kAsf);
  const test::TempFolder folder;
  std::ofstream(folder.path() / "walk_2.asf") << kAsf;
  std::ofstream(folder.path() / "walk_2_b.amc") << kAmc;
  const ReadOptions options{.metres_per_unit = 0.01, .up = UpAxis::kPlusZ};
  const auto clip = read_clip(folder.path() / "walk_2_b.amc", options);
  REQUIRE(truth);
  if (!clip) FAIL(clip.error().text());
  const Eigen::Quaterniond turn(up_turn(UpAxis::kPlusZ));
  const double size = 0.01 / (0.0254 / 0.45);
  const Frame was = truth->frame(1), now = clip->frame(1);
  const auto root_of = [](const Frame& frame) {
    return Eigen::Vector3d(Eigen::Vector3f(frame.root_position_m.data()).cast<double>());
  };
  CHECK((root_of(now) - turn * (size * root_of(was))).norm() < 1e-6);
  for (std::size_t j = 0; j < truth->skeleton->joints.size(); ++j) {
    const Joint& joint = truth->skeleton->joints[j];
    CHECK((clip->skeleton->joints[j].offset_m - turn * (size * joint.offset_m)).norm() < 1e-9);
    const auto q = turn * to_eigen_double(was.rotation_xyzw[j]) * turn.conjugate();
    CHECK(angle_between_rad(to_eigen_double(now.rotation_xyzw[j]), q) < 1e-6);
  }
  const auto stream = open_device_clip(folder.path() / "walk_2_b.amc", options);
  if (!stream) FAIL(stream.error().text());
  const auto again = parse_description(stream->description, "the log");
  REQUIRE(again);
  CHECK(again->skeleton->id == clip->skeleton->id);
  std::vector<double> values(again->parser.channels());
  REQUIRE(again->parser.parse(stream->frames[1], values).ok());
  CHECK(std::equal(values.begin(), values.end(), clip->channels.row(1).data()));
}

TEST_CASE("an AMC that would give a wrong pose is refused with its line") {
  check_error(kAsf, "", "x.amc: has no frames");
  check_error(kAsf, "hello\n", "x.amc:1: 'hello' stands before the first frame");
  check_amc("thigh 40 50\n", "", "x.amc:4: frame 1: bone 'thigh' is missing");
  check_amc("thigh 40 50", "thigh 40", "x.amc:6: frame 1: bone 'thigh' has 1 value where");
  check_amc("thigh 40 50", "thigh 40 50 60", "x.amc:6: frame 1: bone 'thigh' has 3 values or more");
  check_amc("thigh 40 50", "foot 40 50", "x.amc:6: frame 1: the skeleton has no bone 'foot'");
  check_amc("thigh 41", "foot 41", "x.amc:8: frame 2: the skeleton has no bone 'foot'");
  check_amc("thigh 40 50", "thigh 40 nan", "x.amc:6: frame 1: 'nan' is not a number");
  check_amc("thigh 40 50", "thigh 40 50\nthigh 1 2",
            "x.amc:7: frame 1: bone 'thigh' appears twice");
  check_amc("\n2\n", "\n3\n", "x.amc:7: frame 3 follows frame 1");
  check_amc("\n2\n", "\n1\n", "x.amc:7: frame 1 follows frame 1");
  check_amc("\n2\n", "\n99999999999999999999\n", "x.amc:7: frame 2: '99999999999999999999' stands");
  check_error(kAsf, kAmc.substr(0, kAmc.size() - 9), "x.amc:9: frame 2: bone 'root' has 3 values");
}

TEST_CASE("an ASF that would give a wrong pose is refused with its line") {
  check_error("", kAmc, "x.asf: does not begin with a ':' section");
  check_error("HIERARCHY\n", kAmc, "x.asf:1: does not begin with a ':' section");
  check_asf("length 0.45", "length 0", "x.asf:5: length should be more than 0");
  check_asf("angle deg", "angle grad", "x.asf:6: angle is in deg or rad, not 'grad'");
  check_asf("order TX TY TZ RX RY RZ", "", "x.asf: the :root has no order");
  check_asf("axis XYZ", "axis XYY", "x.asf:11: the order of an axis");
  check_asf("direction 0 -1 0", "direction 0 -1 x",
            "x.asf:18: direction of bone 'thigh': 'x' is not");
  check_asf("direction 0 -1 0", "direction 0 -2 0", "x.asf:24: the direction of bone 'thigh'");
  check_asf("dof rx rz", "dof rx rx", "x.asf:21: 'rx' twice");
  check_asf("dof rx rz", "dof rx l", "x.asf:21: bone 'thigh' has the dof 'l'");
  check_asf("dof rx rz", "dof rx rz ry", "x.asf:24: bone 'thigh' has 3 dof but 2 limits");
  check_asf("name shin", "name thigh", "x.asf:31: a second bone is named 'thigh'");
  check_asf("name shin", "name root", "x.asf:31: a second bone is named 'root'");
  check_asf("thigh shin", "thigh foot", "x.asf:35: the hierarchy names 'foot'");
  check_asf("thigh shin", "shin thigh", "x.asf:35: bone 'thigh' has two parents");
  check_asf("    thigh shin\n", "", "x.asf: bone 'shin' does not hang on the root");
  check_asf("    root thigh\n    thigh shin\n", "    thigh shin\n    shin thigh\n",
            "x.asf: bone 'thigh' does not hang on the root");
  check_error(kAsf.substr(0, kAsf.find(":hierarchy")), kAmc, "x.asf:31: has no :hierarchy");
  check_error(kAsf.substr(0, kAsf.size() - 6), kAmc, "x.asf:35: the file ends inside :hierarchy");
}

TEST_CASE("an AMC written as BVH is the same motion") {
  const auto amc = parse_amc(kAmc, kAsf);
  REQUIRE(amc.has_value());
  const auto path =
      std::filesystem::temp_directory_path() / ("posed_amc_" + std::to_string(::getpid()) + ".bvh");
  REQUIRE(write_bvh(*amc, path).has_value());
  const auto bvh = read_clip(path, {.metres_per_unit = 0.01});
  std::filesystem::remove(path);
  if (!bvh) FAIL(bvh.error().text());
  for (int i = 0; i < 2; ++i) {
    const Frame a = amc->frame(i);
    const Frame b = bvh->frame(i);
    for (std::size_t j = 0; j < 3; ++j) {
      CHECK(a.root_position_m[j] == Approx(b.root_position_m[j]));
      CHECK(angle_between_rad(to_eigen_double(a.rotation_xyzw[j]),
                              to_eigen_double(b.rotation_xyzw[j])) < 1e-6);
    }
  }
}

TEST_CASE("a text clip decodes frame by frame to what the clip reader gives") {
  for (const std::string name : {"data/cmu/07_01.amc", "data/cmu/07_01.bvh",
                                 "data/styles/dataset-2_walk_feminine_001.bvh"}) {
    const auto path = test::shared(name);
    if (!path) {
      SKIP_WITHOUT_SHARED();
    }
    const auto clip = read_clip(*path);
    REQUIRE(clip.has_value());
    const auto text = open_device_clip(*path);
    if (!text) FAIL(text.error().text());
    REQUIRE(static_cast<int>(text->frames.size()) == clip->frames());
    const auto again = parse_description(text->description, "the log");
    if (!again) FAIL(again.error().text());
    CHECK(again->skeleton->id == clip->skeleton->id);
    CHECK(again->frame_rate_hz == clip->frame_rate_hz);
    std::vector<double> values(again->parser.channels());
    for (int i = 0; i < clip->frames(); i += 50) {
      REQUIRE(again->parser.parse(text->frames[i], values).ok());
      CHECK(std::equal(values.begin(), values.end(), clip->channels.row(i).data()));
    }
  }
}

}  // namespace posed::clip
