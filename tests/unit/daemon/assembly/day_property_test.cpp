// A day of virtual time: a glove, and a room with people in a style, misbehave for some seconds of
// every ten minutes and are silent for the rest, while parts of the daemon are held up, commands
// come, the disk is full at times and the computer sleeps. Memory, open files and the number of
// frames of an hour stay as they were, and the log of the whole day replays bit for bit.
// POSED_HOURS=2 is a shorter day.
#include <malloc.h>

#include <catch2/catch.hpp>

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "daemon/system/process.hpp"
#include "tests/support/dice.hpp"
#include "tests/support/random_streams.hpp"
#include "tests/support/replayed.hpp"
#include "tests/support/seeds.hpp"
#include "tests/support/temp_folder.hpp"
#include "tests/support/virtual_daemon.hpp"

namespace posed::test {
namespace {

constexpr double kPeriod_s = 600.0;  // after this the same begins again
constexpr double kBusy_s = 10.0;     // of it
constexpr double kHour_s = 3600.0;

// What the process holds once an hour.
struct Held {
  double at_s = 0.0;
  double heap_kb = 0.0, resident_mb = 0.0, log_mb = 0.0;
  std::size_t files = 0;
  std::uint64_t frames = 0;  // of the glove, published until then
};

std::size_t open_files() {
  const std::filesystem::directory_iterator files("/proc/self/fd");
  return static_cast<std::size_t>(std::distance(begin(files), end(files)));
}

double size_mb(const std::filesystem::path& log) {
  std::uintmax_t bytes = 0;
  for (const auto& entry : std::filesystem::directory_iterator(log.parent_path())) {
    if (entry.is_regular_file()) bytes += entry.file_size();
  }
  return static_cast<double>(bytes) * 1e-6;
}

// The device is lost at the end of the period, if it was not before.
template <typename Scripted>
Scripted repeated(Scripted scripted) {
  scripted.repeat_s = kPeriod_s;
  scripted.links.back().until_s = kPeriod_s - 1.0;
  return scripted;
}

VirtualOptions day_of(double end_s, const std::filesystem::path& log) {
  VirtualOptions options{.seed = 1, .log = log};
  // Late, because a replay cannot compare what comes after the first lost chunk.
  for (double at_s = end_s * 5.0 / 6.0; at_s < end_s; at_s += kPeriod_s) {
    options.disk_full.push_back({at_s + 5.0, at_s + 8.0});
  }
  for (double at_s = 5.25 * kHour_s; at_s < end_s; at_s += 12.0 * kHour_s) {
    options.asleep.push_back({at_s, at_s + 0.25 * kHour_s});
  }
  options.record_slot.frame_bytes = 1 << 20;
  options.counts_only = true;
  options.look_every_s = kHour_s;
  return options;
}

void add_day(VirtualDaemon& daemon, double end_s) {
  Dice dice(7);
  VirtualStream hand = glove_stream("hand", kBusy_s);
  hand.settings.publish_raw = true;
  disturb(hand, dice.seed());
  daemon.add(repeated(std::move(hand)));
  VirtualSource room = mocap_source("room", kBusy_s, dice.seed());
  disturb(room, dice.seed());
  daemon.add(repeated(std::move(room)));
  for (double at_s = 0.0; at_s < end_s; at_s += kPeriod_s) {
    for (int i = 0; i < 4; ++i) {
      VirtualCommand command = random_command(0, What::kHand, kBusy_s, dice);
      command.at_s += at_s;
      daemon.command(std::move(command));
    }
  }
}

void print(const std::vector<Held>& day) {
  std::printf("%5s %10s %12s %6s %8s %10s\n", "h", "heap kB", "resident MB", "files", "log MB",
              "frames");
  for (const Held& held : day) {
    std::printf("%5.1f %10.1f %12.1f %6zu %8.1f %10llu\n", held.at_s / kHour_s, held.heap_kb,
                held.resident_mb, held.files, held.log_mb,
                static_cast<unsigned long long>(held.frames));
  }
}

}  // namespace

TEST_CASE("a day of virtual time leaves the daemon as it was", "[.day]") {
  const TempFolder folder;
  const auto log = folder.path() / "day.plog";
  const double end_s = static_cast<double>(number_of("POSED_HOURS", 24)) * kHour_s;
  std::vector<Held> day;
  day.reserve(64);
  VirtualOptions options = day_of(end_s, log);
  const VirtualDaemon* running = nullptr;
  options.look = [&](double at_s) {
    const struct mallinfo2 heap = mallinfo2();
    day.push_back({.at_s = at_s,
                   .heap_kb = static_cast<double>(heap.uordblks + heap.hblkhd) * 1e-3,
                   .resident_mb = static_cast<double>(system::resident_bytes()) * 1e-6,
                   .log_mb = size_mb(log),
                   .files = open_files(),
                   .frames = running->published(0).numbers});
  };
  VirtualDaemon daemon(options);
  running = &daemon;
  add_day(daemon, end_s);
  daemon.run(end_s);
  print(day);
  const auto& counters = daemon.counters(0);
  const auto& published = daemon.published(0);
  CHECK(published.numbers + published.missed <= counters.reader.frames);
  if (counters.pipeline.dropped == 0) {
    CHECK(published.numbers + published.missed == counters.reader.frames);
  }
  CHECK(daemon.write_errors() > 0);
  // The first hour fills what is of fixed size.
  REQUIRE(day.size() > 2);
  const Held& first = day[1];
  for (const Held& held : day) {
    INFO("after " << held.at_s / kHour_s << " h");
    CHECK((held.at_s < kHour_s || held.heap_kb < first.heap_kb + 1000.0));
    CHECK((held.at_s < kHour_s || held.resident_mb < first.resident_mb + 1.0));
    CHECK(held.files <= first.files);
  }
  const auto begin_s = day.back().at_s;
  WARN(begin_s / kHour_s << " h: " << day.back().frames << " frames of the glove");
  const Replayed result = replayed(log, true, false);
  REQUIRE((result.difference ? result.difference->text() : "") == "");
  WARN(result.counts.compared << " frames compared with their replay, " << result.counts.after_gap
                              << " come after a gap");
  CHECK(result.counts.compared > 3 * result.counts.after_gap);
}

}  // namespace posed::test
