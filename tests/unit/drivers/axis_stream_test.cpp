// Axis streams as a whole: they give the frames of the BVH with the same numbers, avatars come and
// go, and the emulator makes every form of them.
#include <cmath>
#include <fstream>
#include <sstream>

#include "drivers/axis/decoder.hpp"
#include "proto/clip/bvh.hpp"
#include "proto/clip/clip.hpp"
#include "proto/clip/text.hpp"
#include "proto/frame/degree.hpp"
#include "tests/support/shared.hpp"
#include "tests/unit/drivers/axis_rig.hpp"
#include "tests/unit/drivers/device_fixtures.hpp"
#include "tests/unit/drivers/recorded_log.hpp"

namespace posed::drivers {
namespace {

using axis::AxisEmulator;
using axis::Content;
using axis::Form;
using axis::Message;
using test::axis_bytes;
using test::axis_message;
using test::axis_text_bytes;
using test::AxisBytes;
using test::AxisRig;

std::string text_of_file(const std::filesystem::path& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

// A BVH of the figure as the vendor writes it: positions for all bones, rotations in this order.
std::string axis_bvh(bool reference, std::uint8_t order, const std::vector<std::string>& lines) {
  const axis::AvatarEntry entry{.avatar = axis::make_avatar(0, "x"), .reference = reference};
  auto skeleton = std::make_shared<Skeleton>(*axis::skeleton_of(entry, order).value());
  skeleton->channels.clear();
  for (std::size_t j = 0; j < skeleton->joints.size(); ++j) {
    const auto joint = static_cast<std::uint16_t>(j);
    for (const Axis axis : {Axis::kX, Axis::kY, Axis::kZ}) {
      skeleton->channels.push_back({.joint = joint, .axis = axis, .translation = true});
    }
    for (const Axis axis : axis::order_axes(order)) {
      skeleton->channels.push_back({.joint = joint, .axis = axis});
    }
  }
  clip::Clip clip{.path = {},
                  .skeleton = skeleton,
                  .frame_rate_hz = 125.0,
                  .channels = clip::ChannelMatrix(0, std::ssize(skeleton->channels)),
                  .warnings = {}};
  const auto path = test::scratch_file("axis_head.bvh", "");
  REQUIRE(clip::write_bvh(clip, path));
  std::string text = text_of_file(path);
  for (const std::string& line : lines) text += line + "\n";
  return text;
}

// The lines of a BVH's motion.
std::vector<std::string> motion_lines(const std::filesystem::path& path) {
  std::istringstream file(text_of_file(path));
  std::vector<std::string> lines;
  bool motion = false;
  for (std::string line; std::getline(file, line);) {
    if (motion && !clip::trim(line).empty()) lines.push_back(line);
    motion = motion || line.starts_with("Frame Time");
  }
  return lines;
}

Message message_of(std::string line, Content content) {
  Message message = axis_message(0, "x", 0, content);
  std::string_view words = line;
  for (std::size_t i = 0; i < axis::value_count(content); ++i) {
    message.values[i] = clip::parse_number(clip::next_word(words)).value();
  }
  return message;
}

// The frames of the lines in a stream of this form; each line is sent twice, because the first
// message comes before its description is in use.
std::vector<Frame> streamed(const std::vector<std::string>& lines, Content content, Form form,
                            AxisRig& rig) {
  for (const std::string& line : lines) {
    const AxisBytes bytes = form == Form::kText ? axis_text_bytes("0 x " + line + " ||")
                                                : axis_bytes(message_of(line, content), form);
    if (rig.layouts.empty()) rig.feed(bytes);
    rig.feed(bytes);
  }
  return rig.sink.frames;
}

void check_same_pose(const Frame& got, const Frame& expected, double tolerance) {
  REQUIRE(got.joint_count == expected.joint_count);
  REQUIRE(got.angle_count == expected.angle_count);
  CHECK(got.valid == expected.valid);
  double worst = 0.0;
  const auto compare = [&](float a, float b) {
    worst = std::max(worst, std::abs(static_cast<double>(a) - static_cast<double>(b)));
  };
  for (std::size_t i = 0; i < 3; ++i) compare(got.root_position_m[i], expected.root_position_m[i]);
  for (std::size_t j = 0; j < got.joint_count; ++j) {
    for (std::size_t i = 0; i < 4; ++i) {
      compare(got.rotation_xyzw[j][i], expected.rotation_xyzw[j][i]);
    }
  }
  for (std::size_t c = 0; c < got.angle_count; ++c)
    compare(got.angle_rad[c], expected.angle_rad[c]);
  CHECK(worst <= tolerance);
}

// Compares a stream's figure with the hierarchy of a BVH. (A clip takes its offsets from the first
// frame, with the shifts that offset_from() removes.)
void check_figure(const Skeleton& figure, const std::filesystem::path& path) {
  Skeleton expected = clip::parse_bvh_header(text_of_file(path), path.string()).value().skeleton;
  for (Joint& joint : expected.joints) {
    joint.offset_m *= axis::kCentimetre_m;
    if (joint.end_site_m) *joint.end_site_m *= axis::kCentimetre_m;
  }
  REQUIRE(expected.finish());
  REQUIRE(figure.joints.size() == expected.joints.size());
  for (std::size_t j = 0; j < figure.joints.size(); ++j) {
    const Joint& got = figure.joints[j];
    const Joint& wanted = expected.joints[j];
    INFO(wanted.name);
    CHECK(got.name == wanted.name);
    CHECK(got.parent == wanted.parent);
    CHECK(got.bone == wanted.bone);
    CHECK(angle_between_rad(got.T_world_joint, wanted.T_world_joint) < 1.0 * kDegree);
    if (static_cast<int>(j) > figure.root_joint) {
      CHECK((got.offset_m - wanted.offset_m).norm() < 0.0045);
    }
  }
}

// Compares streams of a BVH's lines with the BVH, text bit for bit. `rounding` of f32 values.
void check_against_bvh(const std::filesystem::path& path, Content content, const std::string& order,
                       double rounding) {
  const auto clip = clip::read_clip(path, {.metres_per_unit = axis::kCentimetre_m});
  if (!clip) FAIL(clip.error().text());
  const auto lines = motion_lines(path);
  REQUIRE(static_cast<int>(lines.size()) == clip->frames());
  for (const Form form : {Form::kBinary, Form::kOldBinary, Form::kText}) {
    AxisRig rig({{"order", order}});
    const auto frames = streamed(lines, content, form, rig);
    REQUIRE(frames.size() == lines.size());
    for (std::size_t i = 0; i < frames.size(); ++i) {
      check_same_pose(frames[i], clip->frame(static_cast<int>(i)),
                      form == Form::kText ? 0.0 : rounding);
    }
    REQUIRE(rig.layouts.size() == 1);
    check_figure(*rig.layouts[0]->bodies[0].skeleton, path);
  }
}

}  // namespace

TEST_CASE("an Axis stream of a real recording's numbers gives the frames of its BVH") {
  const auto path = test::shared("data/streams/axis_neuron_test.bvh");
  if (!path) SKIP_WITHOUT_SHARED();
  check_against_bvh(*path, {.displacement = true, .reference = false}, "YXZ", 2e-7);
}

TEST_CASE("an Axis stream gives the frames of a BVH in every order, with and without reference") {
  for (std::uint8_t order = 0; order < axis::kOrderNames.size(); ++order) {
    for (const bool reference : {false, true}) {
      const Content content{.displacement = true, .reference = reference};
      std::vector<std::string> lines;
      for (int i = 0; i < 3; ++i) {
        Message message = axis_message(0, "x", 0, content);
        for (std::size_t v = 0; v < 6; ++v) message.values[v] = 3.25 * (i + 1) + double(v);
        message.values[axis::rotations_at(content, 7) + 1] = -40.5 * i;
        std::string line;
        for (std::size_t v = 0; v < axis::value_count(content); ++v) {
          line +=
              clip::number_text(static_cast<double>(static_cast<float>(message.values[v]))) + " ";
        }
        lines.push_back(line);
      }
      const auto path = test::scratch_file("axis.bvh", axis_bvh(reference, order, lines));
      check_against_bvh(path, content, std::string(axis::kOrderNames[order]), 0.0);
    }
  }
}

TEST_CASE("an Axis stream without displacement gives the same rotations and default proportions") {
  for (const bool reference : {false, true}) {
    AxisRig with;
    AxisRig without;
    for (int i = 0; i < 2; ++i) {
      with.feed(axis_bytes(axis_message(0, "x", 1, {true, reference})));
      without.feed(axis_bytes(axis_message(0, "x", 1, {false, reference})));
    }
    REQUIRE(with.sink.frames.size() == 1);
    REQUIRE(without.sink.frames.size() == 1);
    CHECK(test::same_pose(with.sink.frames[0], without.sink.frames[0]));
    CHECK(with.layouts[0]->bodies[0].skeleton->id == without.layouts[0]->bodies[0].skeleton->id);
  }
}

TEST_CASE("the figure of Axis Studio has a longer neck, told by its bones or by the options") {
  const std::string said = GENERATE("auto", "pro", "studio");
  const bool displacement = GENERATE(true, false);
  INFO(said << (displacement ? ", displacement" : ""));
  axis::AxisEmulator emulator({.content = {.displacement = displacement, .reference = false},
                               .figure = axis::Figure::kStudio});
  AxisRig rig({{"figure", said}});
  for (int i = 0; i < 3; ++i) rig.step(emulator);
  REQUIRE_FALSE(rig.layouts.empty());
  const Body& walker = rig.layouts[0]->bodies[0];
  const Skeleton& skeleton = *walker.skeleton;
  const bool studio = said == "studio" || (said == "auto" && displacement);
  CHECK(skeleton.joints[10].name == (studio ? "Neck" : "Spine3"));
  CHECK(skeleton.joint_of(Bone::kNeck) == (studio ? 10 : 11));
  const int shoulder = skeleton.joint_of(Bone::kLeftShoulder);
  CHECK(skeleton.joints[static_cast<std::size_t>(shoulder)].parent == (studio ? 9 : 10));
  CHECK(walker.remark.contains(studio ? "of Axis Studio" : "of Axis Neuron"));
  if (said == "pro" && displacement) return;  // a wrong word of the user's
  double above_hips_m = 0.0;
  for (int j = shoulder; j > skeleton.root_joint; j = skeleton.joints[std::size_t(j)].parent) {
    above_hips_m += skeleton.joints[std::size_t(j)].offset_m.y();
  }
  CHECK(above_hips_m == Approx(0.47));
}

TEST_CASE("Axis avatars come, go and change their proportions, each described in time") {
  AxisEmulator emulator({.rate_hz = 100.0});
  AxisRig rig;
  const auto run = [&](int frames) {
    rig.sink.clear();
    for (int i = 0; i < frames; ++i) rig.step(emulator);
  };
  run(100);
  REQUIRE(rig.layouts.size() == 1);
  CHECK(rig.layouts[0]->bodies[0].name == "Walker");
  CHECK(rig.layouts[0]->bodies[1].name == "Waver");
  CHECK(rig.sink.frames.size() == 2 * 99);
  for (std::size_t body = 0; body < 2; ++body) {
    CHECK(rig.layouts[0]->bodies[body].skeleton->id == emulator.skeleton(body)->id);
  }
  CHECK(emulator.skeleton(2) == nullptr);
  emulator.set_present(0, false);
  run(100);
  CHECK(rig.layouts.size() == 1);
  run(20);
  REQUIRE(rig.layouts.size() == 2);
  CHECK(rig.layouts[1]->bodies.size() == 1);
  emulator.set_present(0, true);
  run(100);
  REQUIRE(rig.layouts.size() == 3);
  CHECK(rig.layouts[2]->bodies.size() == 2);
  emulator.set_scale(1, 0.902F);  // less than the applications shift bones
  run(300);
  CHECK(rig.layouts.size() == 3);
  emulator.set_scale(1, 1.0F);
  run(90);
  CHECK(rig.layouts.size() == 3);
  run(20);
  REQUIRE(rig.layouts.size() == 4);
  CHECK(rig.layouts[3]->bodies[0].skeleton->id == rig.layouts[2]->bodies[0].skeleton->id);
  CHECK(rig.layouts[3]->bodies[1].skeleton->joints[2].offset_m.y() == Approx(-0.43));
}

TEST_CASE("a pause of the whole Axis stream takes no avatar away") {
  AxisEmulator emulator({.rate_hz = 100.0});
  AxisRig rig;
  for (int i = 0; i < 3; ++i) rig.step(emulator);
  const auto resume = [&](std::uint32_t avatar, const char* name, std::int64_t at_ns) {
    rig.now_ns = at_ns;
    rig.feed(axis_bytes(axis_message(avatar, name, 50)));
  };
  resume(0, "Walker", 60 * kNanosPerSecond);
  resume(1, "Waver", 60 * kNanosPerSecond + 1);
  CHECK(rig.layouts.size() == 1);
  resume(0, "Walker", 60 * kNanosPerSecond + 900'000'000);
  resume(0, "Walker", 61 * kNanosPerSecond + 100'000'000);  // without the waver
  CHECK(rig.layouts.size() == 2);
}

TEST_CASE("Axis avatars of one name or number are told apart, and there are at most 64") {
  AxisRig rig;
  AxisBytes bytes;
  const auto add = [&](std::uint32_t number, const std::string& name) {
    const AxisBytes message = axis_bytes(axis_message(number, name, 1, {}));
    bytes.insert(bytes.end(), message.begin(), message.end());
  };
  add(0, "Ann");
  add(1, "Ann");
  add(1, "Bo");
  add(0, "Ann-1");
  add(5, "");
  for (std::uint32_t i = 0; i < 59; ++i) add(100 + i, "crowd");
  add(6, "one too many");
  rig.feed(bytes);
  REQUIRE(rig.layouts.size() == 1);
  const auto& bodies = rig.layouts[0]->bodies;
  REQUIRE(bodies.size() == kMaxBodies);
  CHECK(bodies[0].name == "Ann");
  CHECK(bodies[1].name == "Ann-1");
  CHECK(bodies[2].name == "Bo");
  CHECK(bodies[3].name == "Ann-1-0");
  CHECK(bodies[4].name == "avatar");
  CHECK(rig.sink.count(Outcome::kOutOfRange) == 1);
  rig.sink.clear();
  rig.feed(bytes);
  CHECK(rig.sink.frames.size() == kMaxBodies);
  CHECK(rig.sink.bodies[3] == 3);
}

TEST_CASE("a reference that appears changes the Axis figure") {
  AxisRig rig;
  rig.introduce(axis_message(0, "x", 1, {false, false}));
  CHECK(rig.outcome_of(axis_bytes(axis_message(0, "x", 2, {false, false}))) == Outcome::kOk);
  rig.now_ns = kNanosPerSecond / 2;
  CHECK(rig.outcome_of(axis_bytes(axis_message(0, "x", 3, {false, true}))) == Outcome::kForeign);
  REQUIRE(rig.layouts.size() == 2);
  CHECK(rig.layouts[1]->bodies[0].skeleton->joints[0].name == "Reference");
  CHECK(rig.layouts[1]->bodies[0].skeleton->root_joint == 1);
  CHECK(rig.outcome_of(axis_bytes(axis_message(0, "x", 4, {false, true}))) == Outcome::kOk);
}

TEST_CASE("every form of the emulated Axis stream gives the same frames, whole or in datagrams") {
  for (const Content content : {Content{true, false}, Content{true, true}, Content{false, true}}) {
    AxisRig first;
    AxisEmulator emulator({.content = content, .order = 3, .rate_hz = 100.0});
    for (int i = 0; i < 20; ++i) first.step(emulator);
    REQUIRE(first.sink.frames.size() == 38);
    for (const Form form : {Form::kBinary, Form::kOldBinary, Form::kText}) {
      for (const std::size_t split : {0U, 1024U, 100'000U}) {
        AxisRig rig({{"link", std::string("udp")}});
        AxisEmulator other(
            {.form = form, .content = content, .order = 3, .rate_hz = 100.0, .split_bytes = split});
        rig.layouts.push_back(rig.driver.make_layout(first.sink.described).value());
        rig.decoder->use(*rig.layouts.back());
        while (other.next_due_ns() < 200'000'000) {
          AxisBytes bytes;
          other.emit(other.next_due_ns(), bytes);
          CHECK((split == 0 || bytes.size() <= split));
          rig.decoder->feed(bytes, 0, rig.sink);
        }
        REQUIRE(rig.sink.frames.size() == 40);
        CHECK(rig.sink.count(Outcome::kOk) == 40);
        for (std::size_t i = 0; i < first.sink.frames.size(); ++i) {
          check_same_pose(rig.sink.frames[i + 2], first.sink.frames[i], 1e-6);
        }
      }
    }
  }
}

TEST_CASE("late and repeated Axis datagrams are dropped") {
  AxisRig rig({{"link", std::string("udp")}, {"rate_hz", 100.0}});
  rig.introduce(axis_message(0, "x", 100));
  for (const std::uint32_t number : {101U, 103U, 102U, 103U, 104U, 0U}) {
    rig.feed(axis_bytes(axis_message(0, "x", number)));
  }
  CHECK(rig.sink.frames.size() == 4);
  CHECK(rig.sink.count(Outcome::kLate) == 1);
  CHECK(rig.sink.count(Outcome::kDuplicate) == 1);
  CHECK(rig.sink.frames[0].header.device_ns == 10'000'000);
  CHECK(rig.sink.frames[1].header.device_ns == 30'000'000);
  CHECK(rig.sink.frames[2].header.device_ns == 40'000'000);
  CHECK(rig.sink.frames[3].header.device_ns == kNoTime_ns);  // not numbered
  AxisRig tcp;
  tcp.introduce(axis_message(0, "x", 100));
  for (int i = 0; i < 3; ++i) tcp.feed(axis_bytes(axis_message(0, "x", 7)));
  CHECK(tcp.sink.frames.size() == 3);
  CHECK(tcp.sink.frames[0].header.device_ns == kNoTime_ns);
}

TEST_CASE("all Axis avatars have one clock, whenever they were described") {
  AxisRig rig({{"link", std::string("udp")}, {"rate_hz", 100.0}});
  AxisEmulator emulator({.rate_hz = 100.0, .split_bytes = 2000});
  const auto run = [&](std::int64_t until_ns) {
    while (emulator.next_due_ns() < until_ns) rig.step(emulator);
    rig.sink.clear();
    for (int i = 0; i < 2; ++i) rig.step(emulator);
    REQUIRE(rig.sink.frames.size() == 2);
    CHECK(rig.sink.bodies == std::vector<std::size_t>{0, 1});
    CHECK(rig.sink.frames[0].header.device_ns == until_ns);
    CHECK(rig.sink.frames[1].header.device_ns == until_ns);
  };
  run(kNanosPerSecond);
  CHECK(rig.layouts.size() == 2);  // the first without the second avatar
  emulator.set_present(1, false);
  while (emulator.next_due_ns() < 5 * kNanosPerSecond) rig.step(emulator);
  emulator.set_present(1, true);
  run(6 * kNanosPerSecond);
}

TEST_CASE("a lost half of an Axis datagram loses its message only") {
  AxisRig rig({{"link", std::string("udp")}});
  rig.introduce(axis_message(0, "x", 1));
  for (std::uint32_t number = 2; number < 12; ++number) {
    const AxisBytes whole = axis_bytes(axis_message(0, "x", number));
    const auto half = whole.begin() + 1024;
    if (number != 4) rig.feed({whole.begin(), half});
    if (number != 8) rig.feed({half, whole.end()});
  }
  CHECK(rig.sink.frames.size() == 8);
  CHECK(rig.sink.count(Outcome::kOk) == 8);
  CHECK(rig.sink.count(Outcome::kShort) + rig.sink.count(Outcome::kForeign) == 2);
}

TEST_CASE("the emulated Axis avatars take poses of their own skeletons") {
  for (const Content content : {Content{true, false}, Content{false, true}}) {
    AxisEmulator emulator({.content = content, .order = 1});
    AxisRig rig({{"order", std::string("XYZ")}});
    Frame frame;
    frame.joint_count = static_cast<std::uint16_t>(emulator.skeleton(1)->joints.size());
    frame.root_position_m = {0.5F, 1.25F, -2.0F};
    for (std::size_t j = 0; j < frame.joint_count; ++j) {
      frame.valid.set(j);
      const double angle_rad = 0.3 + 0.01 * static_cast<double>(j);
      frame.rotation_xyzw[j] =
          from_eigen(axis_rotation(Axis::kX, angle_rad) * axis_rotation(Axis::kZ, -angle_rad));
    }
    emulator.pose(1, frame);
    for (int i = 0; i < 2; ++i) rig.step(emulator);
    REQUIRE(rig.sink.frames.size() == 2);
    const Frame& got = rig.sink.frames[1];
    for (std::size_t i = 0; i < 3; ++i) {
      CHECK(got.root_position_m[i] == Approx(frame.root_position_m[i]).margin(1e-5));
    }
    for (std::size_t j = 0; j < frame.joint_count; ++j) {
      CHECK(angle_between_rad(to_eigen_double(got.rotation_xyzw[j]),
                              to_eigen_double(frame.rotation_xyzw[j])) < 1e-5);
    }
  }
}

TEST_CASE("the emulated Axis avatars move smoothly and for ever") {
  AxisEmulator emulator({.rate_hz = 100.0});
  AxisRig rig;
  for (int i = 0; i < 1300; ++i) rig.step(emulator);
  double farthest_m = 0.0;
  double most_rad = 0.0;
  const auto& frames = rig.sink.frames;
  for (std::size_t i = 2; i < frames.size(); ++i) {
    CHECK(test::is_valid(frames[i]));
    for (std::size_t k = 0; k < 3; ++k) {
      farthest_m = std::max(farthest_m, std::abs(double(frames[i].root_position_m[k]) -
                                                 double(frames[i - 2].root_position_m[k])));
    }
    for (std::size_t c = 0; c < frames[i].angle_count; ++c) {
      most_rad = std::max(
          most_rad, std::abs(double(frames[i].angle_rad[c]) - double(frames[i - 2].angle_rad[c])));
    }
  }
  CHECK(farthest_m > 0.0);
  CHECK(farthest_m < 0.01);
  CHECK(most_rad < 0.1);
}

namespace {

// Datagrams cut at 1024 bytes, a lost one, a repeated message, damage, text, and an avatar that
// leaves and is then described away.
std::string axis_log() {
  std::string text =
      "# Not a recording: made by posed's emulator of Axis Neuron, with damage put in.\n"
      "driver axis\nidentity udp 127.0.0.1:7002\ntext axis link=udp order=YXZ rate=60\n";
  AxisRig rig({{"link", std::string("udp")}});
  const auto add = [&](std::int64_t after_ns, const AxisBytes& bytes) {
    rig.now_ns += after_ns;
    const int before = rig.sink.descriptions;
    rig.feed(bytes);
    text += test::recorded_row(rig.now_ns, "hex", bytes);
    if (rig.sink.descriptions != before)
      text += test::recorded_row(rig.now_ns, "bodies", rig.sink.described);
  };
  const auto next = [](AxisEmulator& emulator) {
    AxisBytes bytes;
    emulator.emit(emulator.next_due_ns(), bytes);
    return bytes;
  };
  AxisEmulator whole({});
  add(1'000'000, next(whole));
  AxisEmulator cut({.split_bytes = 1024});
  for (int i = 0; i < 24; ++i) {  // four datagrams a frame
    AxisBytes bytes = next(cut);
    if (i < 4 || i == 9) continue;                              // sent before; lost
    if (i == 12) bytes[7] = std::byte{0xFF};                    // the count
    if (i == 18) std::fill_n(&bytes[100], 4, std::byte{0xFF});  // not a number
    add(4'000'000, bytes);
  }
  for (int i = 0; i < 2; ++i) add(4'000'000, axis_bytes(axis_message(1, "Waver", 7)));  // twice
  AxisEmulator words({.form = Form::kText, .content = {false, false}});
  words.set_present(0, false);
  add(300'000'000, next(words));
  AxisBytes damaged = next(words);
  damaged[500] = std::byte{'x'};
  add(400'000'000, damaged);
  add(400'000'000, next(words));  // the walker is gone
  damaged.resize(400);
  add(300'000'000, damaged);
  for (int i = 0; i < 2; ++i) add(300'000'000, next(whole));  // and is back
  return text;
}

}  // namespace

TEST_CASE("write the log of the emulated Axis application", "[.write-logs]") {
  const auto path = test::golden("devices") / "axis.log";
  if (!std::filesystem::exists(path)) std::ofstream(path) << axis_log();
}

}  // namespace posed::drivers
