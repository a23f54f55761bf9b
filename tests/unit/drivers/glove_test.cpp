// Code shared by all gloves: calibration curves, the angle map, calibration files and the glove
// decoder.
#include <catch2/catch.hpp>

#include <cmath>
#include <limits>
#include <numbers>

#include "drivers/glove/angle_map.hpp"
#include "drivers/glove/calibration_file.hpp"
#include "drivers/glove/glove_decoder.hpp"
#include "proto/frame/hand_skeleton.hpp"
#include "tests/support/allocations.hpp"
#include "tests/support/replaced.hpp"
#include "tests/unit/drivers/collect_sink.hpp"

namespace posed::drivers::glove {
namespace {

const float kNaN = std::numeric_limits<float>::quiet_NaN();

Model small_model() {
  return {.driver = "small",
          .sensors = {{.name = "bend", .curve = Curve::line(50, 0.0, 150, 1.0)},
                      {.name = "spread", .curve = Curve::line(0, 0.0, 255, 1.0), .unit = "1"}},
          .parameters = {{"bias", 0.5}},
          .map_toml =
              "[angles]\n"
              "bend = [{channel = \"index1_x\"},\n"
              "        {channel = \"index2_x\", gain = 2.0, offset_deg = 90.0}]\n"
              "spread = [{channel = \"index1_y\", gain = -1.0}]\n"};
}

const std::string kSmallFile =
    "format = 1\n"
    "driver = \"small\"\n"
    "glove = \"A1\"\n"
    "hand = \"right\"\n"
    "user = \"ann\"\n"
    "[parameters]\n"
    "bias = 0.25\n"
    "[sensors]\n"
    "bend = [[60, 0.0], [100, 1.0], [180, 1.5]]\n";

std::shared_ptr<const Calibration> must_make(const Model& model) {
  const auto made = default_calibration(model);
  if (!made) FAIL(made.error().text());
  return *made;
}

class SmallDecoder final : public GloveDecoder {
 public:
  SmallDecoder()
      : GloveDecoder(std::make_shared<Skeleton>(hand_skeleton(Side::kRight)),
                     must_make(small_model())) {}
  void feed(std::span<const std::byte> /*bytes*/, std::int64_t /*arrival_ns*/,
            Sink& /*sink*/) noexcept override {}
  using GloveDecoder::emit;
};

}  // namespace

TEST_CASE("a curve goes through its points and on beyond them") {
  Curve curve = Curve::line(10, 1.0, 20, 3.0);
  CHECK(curve.value_at(10) == 1.0F);
  CHECK(curve.value_at(15) == 2.0F);
  CHECK(curve.value_at(0) == -1.0F);
  CHECK(curve.value_at(30) == 5.0F);
  curve.raw[2] = 30.0F;
  curve.value[2] = 4.0F;
  curve.points = 3;
  CHECK(curve.value_at(25) == 3.5F);
  CHECK(curve.value_at(40) == 5.0F);
  CHECK(curve.value_at(0) == -1.0F);
}

TEST_CASE("the angle map adds shares, sets other angles to zero, and marks unknown ones") {
  const auto calibration = must_make(small_model());
  HandAngles angles;
  calibration->map_to_hand(std::array{0.5F, 0.25F}, 0b11, angles);
  const auto channel = [](std::string_view name) {
    return static_cast<std::size_t>(hand_channel(name));
  };
  CHECK(angles[channel("index1_x")] == 0.5);
  CHECK(angles[channel("index2_x")] == Approx(1.0 + std::numbers::pi / 2));
  CHECK(angles[channel("index1_y")] == -0.25);
  CHECK(angles[channel("little3_z")] == 0.0);
  calibration->map_to_hand(std::array{0.5F, 0.25F}, 0b10, angles);
  CHECK(std::isnan(angles[channel("index1_x")]));
  CHECK(angles[channel("index1_y")] == -0.25);
}

TEST_CASE("channels of the hand have names") {
  CHECK(hand_channel("thumb1_x") == 0);
  CHECK(hand_channel("index1_y") == 10);
  CHECK(hand_channel("little3_z") == 44);
  for (const char* const wrong : {"", "thumb", "thumb0_x", "thumb4_x", "thumb1_w", "thumb1_xx",
                                  "palm1_x", "thumb1-x", "index1"}) {
    CHECK(hand_channel(wrong) == -1);
  }
}

TEST_CASE("a wrong angle map is refused with its line") {
  const Model model = small_model();
  const std::array<std::pair<std::string, int>, 7> wrongs{{
      {"x = 1", 1},
      {"[angles]\nnone = []", 2},
      {"[angles]\n\nbend = [{channel = \"index4_x\"}]", 3},
      {"[angles]\nbend = [{gain = 1.0}]", 2},
      {"[angles]\nbend = [{channel = \"index1_x\", gain = nan}]", 2},
      {"[angles]\nbend = [{channel = \"index1_x\", again = 1}]", 2},
      {"[angles]\nbend = [{channel = \"index1_x\"", 2},
  }};
  for (const auto& [toml, line] : wrongs) {
    INFO(toml);
    const auto rows = parse_angle_map(toml, "small.toml", model.sensors);
    REQUIRE_FALSE(rows);
    CHECK(rows.error().file == "small.toml");
    CHECK(rows.error().line == line);
  }
}

TEST_CASE("a calibration file replaces what it names") {
  const auto file = parse_calibration(kSmallFile, "c.toml");
  REQUIRE(file);
  CHECK(file->user == "ann");
  const auto made = make_calibration(small_model(), *file, Side::kRight, "A1");
  REQUIRE(made);
  CHECK((*made)->curve[0].value_at(100) == 1.0F);
  CHECK((*made)->curve[1].value_at(255) == 1.0F);
  CHECK((*made)->parameter[0] == 0.25F);
  const auto again = parse_calibration(format_calibration(*file), "c.toml");
  REQUIRE(again);
  CHECK(again->sensors == file->sensors);
  CHECK(again->parameters == file->parameters);
  CHECK(again->glove == file->glove);
  CHECK(again->user == file->user);
}

TEST_CASE("unusual names are read back from a calibration file unchanged") {
  auto file = parse_calibration(kSmallFile, "c.toml");
  REQUIRE(file);
  file->user = "a\"b\\c\nd";
  const auto again = parse_calibration(format_calibration(*file), "c.toml");
  REQUIRE(again);
  CHECK(again->user == file->user);
}

TEST_CASE("a calibration file truncated anywhere is refused") {
  auto file = parse_calibration(kSmallFile, "c.toml");
  REQUIRE(file);
  file->sensors["spread"] = {{10, 0.0}, {200, 1.0}};
  const std::string text = format_calibration(*file);
  for (std::size_t length = 0; length + 1 < text.size(); ++length) {
    INFO(text.substr(0, length));
    const auto cut = parse_calibration(text.substr(0, length), "c.toml");
    CHECK_FALSE(cut);
    if (!cut) CHECK(cut.error().file == "c.toml");
  }
}

TEST_CASE("a wrong calibration file is refused with an error message") {
  for (const auto& [from, to] :
       std::vector<std::pair<std::string, std::string>>{{"format = 1", "format = 2"},
                                                        {"[60, 0.0]", "[100, 0.0]"},
                                                        {"[60, 0.0]", "[nan, 0.0]"},
                                                        {"[60, 0.0]", "[60, inf]"},
                                                        {"[60, 0.0]", "[60]"},
                                                        {", [100, 1.0], [180, 1.5]]", "]"},
                                                        {"right", "upper"},
                                                        {"hand", "hands"},
                                                        {"bias = 0.25", "bias = true"}}) {
    INFO(from << " -> " << to);
    const auto file = parse_calibration(test::replaced(kSmallFile, from, to), "c.toml");
    REQUIRE_FALSE(file);
    CHECK(file.error().file == "c.toml");
    CHECK(file.error().message.find('\n') == std::string::npos);
  }
}

TEST_CASE("a calibration for another glove, hand or driver is refused") {
  const auto file = parse_calibration(kSmallFile, "c.toml");
  REQUIRE(file);
  const Model model = small_model();
  CHECK(make_calibration(model, *file, Side::kRight, ""));
  CHECK_FALSE(make_calibration(model, *file, Side::kLeft, "A1"));
  CHECK_FALSE(make_calibration(model, *file, Side::kRight, "B2"));
  auto wrong = *file;
  wrong.driver = "large";
  CHECK_FALSE(make_calibration(model, wrong, Side::kRight, "A1"));
  wrong = *file;
  wrong.glove.clear();
  CHECK(make_calibration(model, wrong, Side::kRight, "B2"));
  wrong.sensors["twist"] = {{0, 0}, {100, 1}};
  CHECK_FALSE(make_calibration(model, wrong, Side::kRight, ""));
  wrong = *file;
  wrong.sensors["bend"] = {{100, 0}, {109, 1}};
  CHECK_FALSE(make_calibration(model, wrong, Side::kRight, ""));
  wrong = *file;
  wrong.parameters["gain"] = 1.0;
  CHECK_FALSE(make_calibration(model, wrong, Side::kRight, ""));
}

TEST_CASE("a glove's packet becomes a sample and a frame") {
  const auto layout = sample_layout(small_model(), std::array<std::string, 1>{"button"});
  CHECK(layout.names ==
        std::vector<std::string>{"bend", "spread", "raw_bend", "raw_spread", "button"});
  CHECK(layout.units == std::vector<std::string>{"rad", "1", "1", "1", "1"});
  SmallDecoder decoder;
  test::CollectSink sink;
  const std::array raw{100.0F, 51.0F};
  const std::array extra{1.0F};
  decoder.emit({.raw = raw, .valid = 0b11, .extra = extra, .device_ns = 5}, sink);
  REQUIRE(sink.samples.size() == 1);
  REQUIRE(sink.frames.size() == 1);
  const Sample& sample = sink.samples[0];
  CHECK(sample.value_count == 5);
  CHECK(sample.value[0] == 0.5F);
  CHECK(sample.value[2] == 100.0F);
  CHECK(sample.value[4] == 1.0F);
  CHECK(sample.header.device_ns == 5);
  CHECK(sink.frames[0].header.device_ns == 5);
  CHECK(hand_angles(sink.frames[0])[9] == Approx(0.5));
}

TEST_CASE("NaN never leaves a glove decoder as valid") {
  SmallDecoder decoder;
  test::CollectSink sink;
  for (const float bad : {kNaN, std::numeric_limits<float>::infinity(), 1e38F}) {
    decoder.emit({.raw = std::array{bad, 51.0F}, .valid = 0b11, .extra = {}}, sink);
    REQUIRE(sink.samples.size() == 1);
    REQUIRE(sink.frames.size() == 1);
    CHECK(test::is_valid(sink.samples[0]));
    CHECK_FALSE(sink.samples[0].valid[0]);
    CHECK(sink.samples[0].value[0] == 0.0F);
    CHECK_FALSE(sink.frames[0].valid[static_cast<std::size_t>(hand_joint(1, 0))]);
    CHECK(test::is_valid(sink.frames[0]));
    sink.clear();
  }
  decoder.emit({.raw = std::array{100.0F}, .valid = {}, .extra = std::array{kNaN}}, sink);
  CHECK(sink.samples.size() == 1);
  CHECK(sink.samples[0].valid.none());
  CHECK(sink.frames.empty());
}

TEST_CASE("an angle that no finger can have makes its joint invalid, and is counted") {
  SmallDecoder decoder;
  test::CollectSink sink;
  // bend = 9.95, mapped to 9.95 rad on index1_x and twice that on index2_x: beyond two turns.
  decoder.emit({.raw = std::array{1045.0F, 51.0F}, .valid = 0b11, .extra = {}}, sink);
  CHECK(sink.count(Outcome::kOutOfRange) == 1);
  REQUIRE(sink.frames.size() == 1);
  const auto valid = [&](int joint) {
    return sink.frames[0].valid[static_cast<std::size_t>(hand_joint(1, joint))];
  };
  CHECK(valid(0));
  CHECK_FALSE(valid(1));
  decoder.emit({.raw = std::array{150.0F, 51.0F}, .valid = 0b11, .extra = {}}, sink);
  CHECK(sink.count(Outcome::kOutOfRange) == 1);
  CHECK(sink.frames.back().valid.count() == sink.frames.back().joint_count);
}

TEST_CASE("a glove decoder uses another calibration from the next packet on, without allocation") {
  const auto file = parse_calibration(kSmallFile, "c.toml");
  REQUIRE(file);
  const auto other = make_calibration(small_model(), *file, Side::kRight, "A1");
  REQUIRE(other);
  SmallDecoder decoder;
  test::CollectSink sink;
  const std::array raw{100.0F, 51.0F};
  const Packet packet{.raw = raw, .valid = 0b11, .extra = {}};
  const std::uint64_t before = test::allocations();
  decoder.emit(packet, sink);
  decoder.calibrate(**other);
  decoder.emit(packet, sink);
  CHECK(test::allocations() == before);
  CHECK(sink.samples[0].value[0] == 0.5F);
  CHECK(sink.samples[1].value[0] == 1.0F);
  decoder.calibrate(Calibration{});  // the calibration of a glove without sensors is ignored
  decoder.emit(packet, sink);
  CHECK(sink.samples[2].value[0] == 1.0F);
}

}  // namespace posed::drivers::glove
