// HID gloves with the real binary: bound by serial number, unplugged, and found on another node.
#include <catch2/catch.hpp>

#include <algorithm>
#include <csignal>
#include <string>
#include <vector>

#include "drivers/driver.hpp"
#include "proto/log/reader.hpp"
#include "tests/e2e/events.hpp"
#include "tests/e2e/outcome.hpp"
#include "tests/support/temp_folder.hpp"
#include "tests/usb/gloves.hpp"
#include "tests/usb/speaker.hpp"

namespace posed::test {
namespace {

constexpr std::size_t kReplugs = 3;

std::unique_ptr<drivers::Emulator> emulator(const std::string& driver,
                                            const drivers::Options& options) {
  auto made = drivers::find_driver(driver)->emulate(options);
  REQUIRE(made);
  return std::move(*made);
}

// Checks that every chunk of the stream is one report as its glove sent it, in order, and that none
// is missing except between two connections.
void check_chunks(const std::string& log, const std::string& stream,
                  const std::vector<Speaker::Report>& said, std::size_t connections) {
  auto reader = log::Reader::open(log);
  REQUIRE(reader);
  const auto row = std::ranges::find(reader->streams(), stream, &log::StreamRow::name);
  REQUIRE(row != reader->streams().end());
  std::size_t count = 0, jumps = 0;
  auto from = said.begin();
  for (auto chunk = reader->next_chunk(); chunk && *chunk; chunk = reader->next_chunk()) {
    if ((*chunk)->source != row->source || (*chunk)->direction != 0) continue;
    const auto at = std::find_if(from, said.end(), [&](const auto& report) {
      return std::ranges::equal(report, (*chunk)->bytes);
    });
    REQUIRE(at != said.end());
    jumps += at == from ? 0 : 1;
    from = at + 1;
    ++count;
  }
  INFO(stream << ": " << count << " reports, " << jumps << " jumps");
  CHECK(count > 30 * connections);
  CHECK(jumps <= connections);
}

std::string config(const std::string& description) {
  return "realtime = false\n[publish]\nendpoint = \"tcp://127.0.0.1:*\"\n"
         "[control]\nendpoint = \"tcp://127.0.0.1:*\"\n"
         "[[stream]]\nname = \"ultra\"\ndriver = \"fivedt\"\nid = \"ULTRA-7\"\nhand = \"left\"\n"
         "[stream.fivedt]\nmodel = \"ultra-usb-14\"\n"
         "[[stream]]\nname = \"mine\"\ndriver = \"described\"\nid = \"1-4\"\n"
         "[stream.described]\ndevice = \"" +
         description + "\"\n";
}

}  // namespace

TEST_CASE("gloves on hidraw are unplugged and return on another node; the log has all reports") {
  const TempFolder folder;
  const std::string description = folder.write("mine.toml", readme_description());
  const std::string log = folder.path() / "take.plog";
  Bench bench;
  HidGlove ultra(bench, kUltra), mine(bench, kMine);
  const Speaker ultra_speaks(ultra, emulator("fivedt", {{"model", std::string("ultra-usb-14")}}));
  const Speaker mine_speaks(mine, emulator("described", {{"device", description}}));

  Process daemon({"record", "--config", folder.write("posed.toml", config(description)), "--out",
                  log, "--frames"});
  const auto ready = daemon.line();
  INFO(daemon.errors());
  REQUIRE(ready);
  const std::string publish = nlohmann::json::parse(*ready).at("publish");
  Process events(
      {"monitor", "--connect", publish, "--topic", "event", "--stream", "ultra", "--json"});
  const auto expect_frames = [&] {
    const auto received =
        posed({"monitor", "--connect", publish, "--stream", "ultra", "--json", "--count", "30"});
    CHECK(received.code == 0);
  };
  mine.plug();
  ultra.plug();
  expect_frames();  // by then the other monitor is subscribed, too
  for (std::size_t i = 0; i < kReplugs; ++i) {
    ultra.unplug();
    wait_for(events, "KIND_LOST");
    ultra.plug();
    wait_for(events, "KIND_FOUND");
    expect_frames();
  }
  daemon.send(SIGTERM);
  CHECK(daemon.exit_code() == 0);
  check_chunks(log, "ultra", ultra_speaks.said(), kReplugs + 1);
  check_chunks(log, "mine", mine_speaks.said(), 1);
  const auto replay =
      posed({"replay", log, "--speed", "max", "--out", folder.path() / "frames.bin", "--expect"});
  INFO(replay.err);
  CHECK(replay.code == 0);
}

}  // namespace posed::test
