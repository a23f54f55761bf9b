// FBX is read as the motion that is in it, whatever a program makes of joints, and what is damaged
// is refused with a sentence. Blender's own files are tested by ./run blender.
#include <catch2/catch.hpp>

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <random>

#include "models/motion/kinematics.hpp"
#include "models/motion/synthetic_walker.hpp"
#include "proto/clip/fbx.hpp"
#include "proto/fbx/glb_of_fbx.hpp"
#include "tests/support/fbx_text.hpp"
#include "tests/support/file_text.hpp"
#include "tests/support/has.hpp"
#include "tests/support/same_motion.hpp"
#include "tests/support/seeds.hpp"
#include "tests/support/shared.hpp"

namespace posed::motion {
namespace {

clip::Clip walk_of(double seconds) { return make_walker({.seconds = seconds}).value(); }

Result<clip::Clip> read_fbx(std::string bytes) {
  clip::add_format(clip::fbx_format());
  return clip::parse_clip({.name = "walk.fbx", .bytes = std::move(bytes)});
}

std::string refusal(std::string bytes) {
  const auto clip = read_fbx(std::move(bytes));
  REQUIRE_FALSE(clip);
  return clip.error().text();
}

}  // namespace

TEST_CASE("an FBX is read as its motion, whatever unit, axes and turns of joints it has") {
  test::FbxText text;
  const int kind = GENERATE(0, 1, 2, 3, 4, 5);
  INFO("kind " << kind);
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, -1).normalized()));
  if (kind == 1) text.centimetres_a_unit = 2.54, text.z_up = true;
  if (kind >= 2) text.pre = turn;
  if (kind >= 3) text.post = turn * turn;
  if (kind >= 4) text.pivot = Eigen::Vector3d(1.0, -2.0, 3.0);
  if (kind == 5) text.time_mode = 0;
  const clip::Clip walk = walk_of(0.5);
  const auto read = read_fbx(text.of(walk));
  if (!read) FAIL(read.error().text());
  CHECK(read->skeleton->joints.size() == walk.skeleton->joints.size());
  test::check_same_motion(walk, *read);
}

TEST_CASE("a figure of Mixamo is recognised as a person, and its empty animation is passed over") {
  test::FbxText text;
  text.prefix = "mixamorig:";
  text.empty_stack = true;
  const clip::Clip walk = walk_of(0.5);
  const auto read = read_fbx(text.of(walk));
  if (!read) FAIL(read.error().text());
  CHECK(read->warnings.empty());
  test::check_same_motion(walk, *read, text.prefix);
  for (const Joint& joint : walk.skeleton->joints) {
    INFO(joint.name);
    const int k = read->skeleton->joint_index(text.prefix + joint.name);
    CHECK(read->skeleton->joints[static_cast<std::size_t>(k)].bone == joint.bone);
  }
}

// tests/blender/write_fbx.py wrote it of arm.bvh's .glb, in a frame in which the figure does not
// rest: it rests where the mesh is bound to it.
TEST_CASE("an FBX of Blender is the same clip, at rest and in motion") {
  const auto walk = clip::read_clip(test::golden("fbx/arm.bvh"));
  const auto read = read_fbx(test::file_text(test::golden("fbx/arm.fbx")));
  REQUIRE(walk);
  if (!read) FAIL(read.error().text());
  test::check_same_motion(*walk, *read);
  for (const Joint& joint : walk->skeleton->joints) {
    const int k = read->skeleton->joint_index(joint.name);
    const Joint& same = read->skeleton->joints[static_cast<std::size_t>(k)];
    CHECK((same.offset_m - joint.offset_m).norm() < 1e-4);
  }
}

TEST_CASE("an FBX with a key every third frame has the file's frames, and a sentence") {
  test::FbxText text;
  text.key_every = 3;
  const clip::Clip walk = walk_of(0.95);
  const auto read = read_fbx(text.of(walk));
  if (!read) FAIL(read.error().text());
  CHECK(read->frame_rate_hz == Approx(30.0));
  REQUIRE(read->frames() == (walk.frames() - 1) / 3 * 3 + 1);
  REQUIRE(read->warnings.size() == 1);
  CHECK(test::has(read->warnings[0], "has keys frames apart"));
  const auto truth = world_pose(*walk.skeleton, walk.frame(6));
  const auto got = world_pose(*read->skeleton, read->frame(6));
  for (std::size_t j = 0; j < truth.position_m.size(); ++j) {
    const int k = read->skeleton->joint_index(walk.skeleton->joints[j].name);
    CHECK((got.position_m[static_cast<std::size_t>(k)] - truth.position_m[j]).norm() < 1e-4);
  }
}

TEST_CASE("an FBX without an animation is one frame, with a sentence") {
  test::FbxText text;
  text.animated = false;
  const auto read = read_fbx(text.of(walk_of(0.5)));
  if (!read) FAIL(read.error().text());
  CHECK(read->frames() == 1);
  REQUIRE(read->warnings.size() == 1);
  CHECK(test::has(read->warnings[0], "has no animation"));
}

TEST_CASE("what is no FBX, or a damaged one, is refused with a sentence") {
  CHECK(test::has(refusal("no FBX at all"), "walk.fbx: is no FBX that can be read"));
  test::FbxText timeless;
  timeless.time_mode = 14;
  CHECK(test::has(refusal(timeless.of(walk_of(0.2))), "names no frame rate"));
  CHECK(test::has(refusal(""), "walk.fbx: is no FBX that can be read"));
  CHECK(test::has(refusal("Kaydara FBX Binary  "), "walk.fbx: is no FBX that can be read"));
}

TEST_CASE("the process that reads FBX can compute a little, but open nothing and start nothing") {
  const pid_t child = ::fork();
  REQUIRE(child >= 0);
  if (child == 0) {
    const bool confined = fbx::confine(1'000'000).has_value();
    const bool opens =
        ::open("/etc/passwd", O_RDONLY) >= 0 || ::socket(AF_INET, SOCK_STREAM, 0) >= 0;
    const bool starts = ::fork() >= 0 || ::kill(::getppid(), 0) == 0;
    const bool computes = std::string(1'000'000, 'x').back() == 'x';
    void* const gigabyte =
        ::mmap(nullptr, 1U << 30U, PROT_READ, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
#if defined(__SANITIZE_ADDRESS__)  // reserves terabytes, so memory has no limit there
    const bool bounded = true;
#else
    const bool bounded = gigabyte == MAP_FAILED;
#endif
    ::_exit(confined && !opens && !starts && computes && bounded ? 42 : 1);
  }
  int status = 0;
  REQUIRE(::waitpid(child, &status, 0) == child);
  CHECK((WIFEXITED(status) && WEXITSTATUS(status) == 42));
}

// POSED_FBX_FILES says how many; ./run nightly: ten thousand.
TEST_CASE("mutated FBX files are read or refused with one sentence") {
  const auto files = static_cast<int>(test::number_of("POSED_FBX_FILES", 30));
  const std::string text = test::FbxText().of(walk_of(0.2));
  const std::string binary = test::file_text(test::golden("fbx/arm.fbx"));
  std::mt19937 dice(1);
  const auto any = [&dice](std::size_t count) { return dice() % count; };
  int refused = 0;
  for (int file = 0; file < files; ++file) {
    INFO("file " << file);
    std::string bytes = file % 2 == 0 ? text : binary;
    for (std::size_t change = 0, changes = 1 + any(8); change < changes; ++change) {
      const std::size_t at = any(bytes.size());
      switch (any(5)) {
        case 0:
          bytes[at] = static_cast<char>(any(256));
          break;
        case 1:
          bytes.erase(at, any(200));
          break;
        case 2:
          bytes.insert(at, bytes.substr(any(bytes.size()), any(2000)));
          break;
        case 3:
          bytes.insert(at, std::to_string(dice() * 1000003ULL));
          break;
        default:
          if (any(8) == 0) bytes.resize(at + 1);
      }
    }
    const auto clip = read_fbx(std::move(bytes));
    if (clip) {
      CHECK(clip->channels.allFinite());
      continue;
    }
    ++refused;
    CHECK(clip.error().text().starts_with("walk.fbx: "));
    CHECK(clip.error().text().size() > 20);
  }
  CHECK(refused < files);
}

}  // namespace posed::motion
