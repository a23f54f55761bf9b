// The streams of a VirtualDaemon, and the bytes that their devices send.
#include <algorithm>
#include <cmath>
#include <random>

#include <catch2/catch.hpp>

#include "drivers/emulator.hpp"
#include "drivers/glove/calibration_file.hpp"
#include "drivers/glove/fit.hpp"
#include "drivers/glove/glove_emulator.hpp"
#include "drivers/options.hpp"
#include "models/gesture/model_file.hpp"
#include "models/style/model/style_model.hpp"
#include "proto/clip/clip.hpp"
#include "proto/clip/device_clip.hpp"
#include "tests/support/stage_commands.hpp"
#include "tests/support/temp_folder.hpp"
#include "tests/support/virtual_daemon.hpp"
#include "tests/unit/models/gesture/toy_gesture.hpp"
#include "tests/unit/models/style/toy_style.hpp"

namespace posed::test {
namespace {

constexpr double kWalkRate_hz = 60.0;
constexpr double kGloveRate_hz = 100.0;

std::string text_of(const drivers::Emulator::Bytes& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};  // NOLINT: bytes as text
}

// Removes the chunks from time `from_s` on from `link` and returns them.
std::vector<ScriptedChunk> cut_from(ScriptedLink& link, double from_s) {
  const auto at = std::ranges::lower_bound(link.chunks, from_s, {}, &ScriptedChunk::at_s);
  std::vector<ScriptedChunk> rest(at, link.chunks.end());
  link.chunks.erase(at, link.chunks.end());
  return rest;
}

void disturb(std::vector<ScriptedLink>& links, bool comes_back, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const auto draw = [&](double most) {
    return std::uniform_real_distribution<double>(0.0, most)(random);
  };
  REQUIRE(links.size() == 1);
  const double length_s = links[0].chunks.back().at_s;
  for (double at_s = 0.3 + draw(0.8); at_s < length_s; at_s += 0.2 + draw(1.0)) {
    ScriptedLink& link = links.back();
    std::vector<ScriptedChunk> rest = cut_from(link, at_s);
    const double pause_s = draw(2.0) < 1.0 ? draw(0.3) : draw(1.2);
    const double what = draw(3.0);
    if (what < 1.0) {  // silent for a while: the following chunks are shifted
      for (ScriptedChunk& chunk : rest) chunk.at_s += pause_s;
      std::ranges::move(rest, std::back_inserter(link.chunks));
    } else if (what < 2.0 || !comes_back) {  // delayed: all chunks of the pause come at once
      for (ScriptedChunk& chunk : rest) chunk.at_s = std::max(chunk.at_s, at_s + pause_s);
      std::ranges::move(rest, std::back_inserter(link.chunks));
    } else {  // unplugged
      link.until_s = at_s;
      ScriptedLink next{.from_s = at_s + pause_s, .chunks = {}, .until_s = kNever_s, .flood = {}};
      for (ScriptedChunk& chunk : rest) {
        if (chunk.at_s >= next.from_s) next.chunks.push_back(std::move(chunk));
      }
      links.push_back(std::move(next));
    }
  }
}

}  // namespace

VirtualStream walking_stream(const std::string& name, double length_s, unsigned style_seed) {
  const TempFolder folder;
  const auto path = folder.path() / "walk.bvh";
  const int frames = static_cast<int>(length_s * kWalkRate_hz);
  REQUIRE(clip::write_bvh(toy_walk(frames, kWalkRate_hz, 0.4), path));
  const auto walk = clip::open_device_clip(path);
  REQUIRE(walk);
  VirtualStream stream;
  stream.name = name;
  stream.description = drivers::find_driver("file")->describe(walk->description, "walk").value();
  stream.settings.publish_raw = true;
  stream.settings.stages = {pipeline::stage_settings(style::style_type()),
                            pipeline::stage_settings(generate::generate_type())};
  stream.model_files = {style::serialize_model(toy_model(style_seed)), ""};
  stream.links.emplace_back();
  for (std::size_t i = 0; i < walk->frames.size(); ++i) {
    stream.links[0].chunks.push_back(
        {.at_s = static_cast<double>(i) / kWalkRate_hz, .bytes = walk->frames[i]});
  }
  return stream;
}

VirtualStream glove_stream(const std::string& name, double length_s, Side side) {
  const drivers::Driver& driver = *drivers::find_driver("lucidgloves");
  const drivers::Options options =
      drivers::complete_options(driver,
                                {{"hand", std::string(side == Side::kLeft ? "left" : "right")}})
          .value();
  VirtualStream stream;
  stream.name = name;
  stream.description = driver.expect(options).value();
  stream.settings.stages = {
      pipeline::stage_settings(generate::generate_type(), {{"lag_frames", std::int64_t{2}}}),
      pipeline::stage_settings(hand::constrain_type())};
  stream.model_files = {gesture::serialize_model(toy_gesture_model()), ""};
  stream.links.emplace_back();
  const auto glove = driver.emulate(options).value();
  using drivers::glove::Pose;
  const HandAngles flat = drivers::glove::hand_in(Pose::kFlat);
  const HandAngles fist = drivers::glove::hand_in(Pose::kFist);
  for (int i = 0; i < static_cast<int>(length_s * kGloveRate_hz); ++i) {
    const double at_s = i / kGloveRate_hz;
    const double closed = 0.5 - 0.5 * std::cos(2.0 * kPi * at_s);
    HandAngles angles = flat;
    for (std::size_t c = 0; c < angles.size(); ++c) angles[c] += closed * (fist[c] - flat[c]);
    glove->pose(0, drivers::glove::hand_frame(angles));
    drivers::Emulator::Bytes line;
    glove->emit(nanoseconds(at_s), line);
    stream.links[0].chunks.push_back({.at_s = at_s, .bytes = text_of(line)});
  }
  return stream;
}

void disturb(VirtualStream& stream, std::uint64_t seed) {
  disturb(stream.links, stream.description.driver != "file", seed);
}

void disturb(VirtualSource& source, std::uint64_t seed) { disturb(source.links, true, seed); }

std::string glove_calibration(int variant) {
  drivers::glove::CalibrationFile file;
  file.driver = "lucidgloves";
  file.hand = Side::kRight;
  const double low = 100.0 + 10.0 * variant;
  for (const char* sensor : {"index_joint1", "middle_joint1", "ring_joint2"}) {
    file.sensors[sensor] = {{low, 0.0}, {3500.0, 1.0}};
  }
  return drivers::glove::format_calibration(file);
}

}  // namespace posed::test
