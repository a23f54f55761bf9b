// The whole daemon with a mocap system whose bodies come, go and change, with all its threads and a
// real socket, recorded and replayed.
//   POSED_STRESS_S: seconds of the run, 4 if it is not set.
#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <map>
#include <string>
#include <thread>
#include <utility>

#include <catch2/catch.hpp>

#include "daemon/assembly/daemon.hpp"
#include "daemon/config/config.hpp"
#include "daemon/record/recorder.hpp"
#include "daemon/system/clock.hpp"
#include "proto/log/reader.hpp"
#include "tests/support/free_port.hpp"
#include "tests/support/mocap_room.hpp"
#include "tests/support/replayed.hpp"
#include "tests/support/temp_folder.hpp"
#include "tests/unit/models/style/toy_style.hpp"

namespace posed::assembly {
namespace {

using namespace std::chrono_literals;

constexpr double kRate_hz = 100.0;

double stress_s() {
  const char* const text = std::getenv("POSED_STRESS_S");
  return text != nullptr ? std::atof(text) : 4.0;
}

config::DaemonConfig config_of(std::uint16_t port, const std::filesystem::path& walk) {
  const std::string text =
      "[publish]\nendpoint = \"tcp://127.0.0.1:*\"\n[control]\nendpoint = \"tcp://127.0.0.1:*\"\n"
      "[[source]]\nname = \"room\"\ndriver = \"template_mocap\"\nstreams = \"all\"\n"
      "publish_raw = true\n[source.template_mocap]\nlisten = \"127.0.0.1:" +
      std::to_string(port) +
      "\"\n[[stream]]\nname = \"anchor\"\nsource = \"room\"\nbody = \"Person 0\"\n"
      "[[stream]]\nname = \"refused\"\nsource = \"room\"\nbody = \"Person 1\"\n[stream.generate]\n"
      "[[stream]]\nname = \"walker\"\ndriver = \"file\"\n[stream.file]\npath = \"" +
      walk.string() + "\"\nloop = true\n";
  config::Reading reading = config::read_config(text, "room.toml", drivers::registry());
  INFO((reading.errors.empty() ? "" : reading.errors[0].text()));
  REQUIRE(reading.errors.empty());
  reading.config.realtime = false;
  return std::move(reading.config);
}

// Of a recorded stream: how many frames lie between those that were published, by its name.
struct Gaps {
  std::uint64_t frames = 0, missing = 0, last = 0;
};
std::map<std::string, Gaps> gaps_in(const std::filesystem::path& path) {
  std::map<std::string, Gaps> all;
  const auto log = log::Reader::open(path);
  REQUIRE(log);
  auto streams = log->streams();
  std::ranges::sort(streams, {}, &log::StreamRow::first_item);
  for (const log::StreamRow& stream : streams) {
    Gaps& gaps = all[stream.name];
    auto frames = log->frames(stream.id, false);
    REQUIRE(frames);
    for (auto row = frames->next(); row && *row; row = frames->next()) {
      const std::uint64_t sequence = (*row)->sequence;
      REQUIRE(sequence > gaps.last);
      if (gaps.frames > 0) gaps.missing += sequence - gaps.last - 1;
      gaps.last = sequence;
      ++gaps.frames;
    }
  }
  return all;
}

}  // namespace

TEST_CASE("bodies come, go and change while the daemon records", "[bodies]") {
  const test::TempFolder folder;
  const auto walk = folder.path() / "walk.bvh";
  const auto file = folder.path() / "room.plog";
  REQUIRE(clip::write_bvh(test::toy_walk(240, 120.0), walk));
  const std::uint16_t port = test::free_port();
  auto opened = Daemon::open(config_of(port, walk));
  REQUIRE(opened);
  Daemon& daemon = **opened;
  record::RecorderOptions recording;
  recording.file = file;
  recording.frames = true;
  recording.clock = system::monotonic_ns;
  auto recorder = record::Recorder::open(std::move(recording),
                                         record::recorded_setup(daemon.sources(), daemon.slots()));
  REQUIRE(recorder);
  DaemonHooks hooks;
  hooks.record_sink = &(*recorder)->record_sink();
  hooks.record_stream = [&](const devices::NewStream& stream) {
    (*recorder)->add_stream(record::recorded_stream(stream));
  };
  REQUIRE(daemon.start(std::move(hooks)));

  test::MocapRoom room(port);
  const std::int64_t begin_ns = system::monotonic_ns();
  const std::int64_t until_ns = begin_ns + nanoseconds(stress_s());
  for (std::int64_t frame = 0; system::monotonic_ns() < until_ns; ++frame) {
    if (frame % 50 == 0) room.change();
    if (frame % 50 == 25) room.describe();  // says the same again
    room.frame();
    const std::int64_t next_ns = begin_ns + nanoseconds(static_cast<double>(frame) / kRate_hz);
    std::this_thread::sleep_for(
        std::chrono::nanoseconds(std::max<std::int64_t>(next_ns - system::monotonic_ns(), 0)));
  }
  const v1::Stats stats = daemon.stats();
  // The anchor, the walker and others; the refused one is never live.
  const Daemon::StreamCounts counts = daemon.stream_counts();
  CHECK(counts.live >= 2);
  CHECK(counts.all > counts.live);
  const std::vector<std::string> names = daemon.stream_names();
  for (const char* name : {"walker", "anchor", "refused"}) {
    CHECK(std::ranges::count(names, name) == 1);
  }
  daemon.stop();
  REQUIRE((*recorder)->finish());

  const auto log = log::Reader::open(file);
  REQUIRE(log);
  const std::size_t came = log->streams().size() - 2;  // but the walker and the anchor
  CHECK(came >= static_cast<std::size_t>(stress_s()));
  auto gaps = gaps_in(file);
  CHECK(gaps["anchor"].frames > 50);
  CHECK(gaps["walker"].frames > 50);
  CHECK(gaps.count("refused") == 0);
  // Under load a frame may be skipped because newer ones wait. Every such frame is counted.
  bool refused = false;
  for (const v1::StreamStats& stream : stats.stream()) {
    refused |= stream.stream() == "refused" && stream.state() == "refused" &&
               stream.refusal().find("no joint angles") != std::string::npos;
    if (stream.stream() != "anchor" && stream.stream() != "walker") continue;
    CHECK(gaps[stream.stream()].missing <= stream.shed() + stream.dropped());
  }
  CHECK(refused);
  const test::Replayed result = test::replayed(file);
  CHECK((result.difference ? result.difference->text() : "") == "");
  CHECK(result.counts.compared > 200);
  CHECK(result.counts.lost + result.counts.after_gap + result.counts.past_end == 0);
  WARN(came << " streams came, " << result.counts.compared << " frames compared; missing: anchor "
            << gaps["anchor"].missing << " of " << gaps["anchor"].last << ", walker "
            << gaps["walker"].missing << " of " << gaps["walker"].last);
}

}  // namespace posed::assembly
