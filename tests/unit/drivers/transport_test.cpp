// The transport that plays a clip: schedule, order, loop, end.
#include <catch2/catch.hpp>

#include <algorithm>
#include <limits>
#include <string>

#include "drivers/transport/file.hpp"
#include "tests/unit/drivers/chunk_text.hpp"

namespace posed::drivers {
namespace {

constexpr std::int64_t kStart_ns = 5'000'000'000;

Chunks letters(const std::string& all) {
  Chunks chunks;
  for (const char& letter : all) chunks.add(std::string_view(&letter, 1));
  return chunks;
}

struct Played {
  std::string text;
  std::vector<std::int64_t> at_ns;
  bool ended = false;
};

// Like the daemon's reader, on a simulated clock: sleeps until a chunk is due, then reads until no
// more are due. Each wake-up is `late_ns` late.
Played play(Transport& transport, std::size_t most, std::int64_t late_ns = 0) {
  Played played;
  std::int64_t now_ns = kStart_ns;
  while (!played.ended && played.text.size() < most) {
    now_ns = std::max(now_ns, transport.next_due_ns() + late_ns);
    while (played.text.size() < most) {
      const Chunk chunk = transport.read(now_ns);
      played.ended = chunk.end;
      if (chunk.bytes.empty()) break;
      played.text += test::text_of(chunk.bytes);
      played.at_ns.push_back(now_ns);
    }
  }
  return played;
}

std::unique_ptr<Transport> must(Result<std::unique_ptr<Transport>> transport) {
  if (!transport) FAIL(transport.error().text());
  REQUIRE((*transport)->start(kStart_ns));
  return std::move(*transport);
}

}  // namespace

TEST_CASE("a file plays in order, once, and reports its end") {
  for (const double pace : {0.0, 1.0, 3.0}) {
    const auto transport = must(
        FileTransport::open(letters("abcdef"), {.rate_hz = 2000, .pace = pace, .loop = false}));
    const Played played = play(*transport, 100);
    CHECK(played.text == "abcdef");
    CHECK(played.ended);
    CHECK(transport->read(kStart_ns).end);
  }
}

TEST_CASE("a looped file begins again and never ends") {
  for (const double pace : {0.0, 1.0}) {
    const auto transport =
        must(FileTransport::open(letters("abc"), {.rate_hz = 5000, .pace = pace}));
    const Played played = play(*transport, 20);
    CHECK_FALSE(played.ended);
    CHECK(played.text.substr(0, 20) == "abcabcabcabcabcabcab");
  }
}

TEST_CASE("later loops begin where they are told to, in time") {
  const auto transport = must(FileTransport::open(
      letters("abcd"), {.rate_hz = 10.0, .again_from = 1, .time_s = {5.0, 5.1, 5.3, 5.4}}));
  const Played played = play(*transport, 8);
  CHECK(played.text.substr(0, 8) == "abcdbcdb");
  for (const auto& [chunk, time_ms] : {std::pair{3, 400}, {4, 500}, {5, 700}, {6, 800}, {7, 900}}) {
    CHECK(std::abs(played.at_ns[chunk] - kStart_ns - 1'000'000 * time_ms) < 10);
  }
  CHECK_FALSE(FileTransport::open(letters("a"), {.rate_hz = 10.0, .again_from = 1}));
}

TEST_CASE("frames come at their times without drift, and a late one delays no other") {
  constexpr double kRate_hz = 119.88;  // whose period is not a whole number of nanoseconds
  for (const std::int64_t late_ns : {0, 3'000'000, 30'000'000}) {
    const auto transport = must(FileTransport::open(letters("abc"), {.rate_hz = kRate_hz}));
    const Played played = play(*transport, 100'000, late_ns);
    REQUIRE(played.at_ns.size() == 100'000);
    std::int64_t latest_ns = 0;
    std::int64_t earliest_ns = 0;
    for (std::size_t i = 0; i < played.at_ns.size(); ++i) {
      const auto due_ns =
          kStart_ns + static_cast<std::int64_t>(static_cast<double>(i) * 1e9 / kRate_hz);
      latest_ns = std::max(latest_ns, played.at_ns[i] - due_ns);
      earliest_ns = std::min(earliest_ns, played.at_ns[i] - due_ns);
    }
    CHECK(earliest_ns >= 0);
    CHECK(latest_ns <= late_ns + 1);
  }
}

TEST_CASE("the pace (rate ratio) is a factor on the recording's clock") {
  const auto transport = must(FileTransport::open(letters("ab"), {.rate_hz = 100, .pace = 2.5}));
  CHECK(play(*transport, 251).at_ns.back() == kStart_ns + 1'000'000'000);
  CHECK_FALSE(transport->lossless());
  CHECK(transport->poll_fd() == -1);
}

TEST_CASE("an unpaced file is always due and waits for the pipeline") {
  const auto transport = must(FileTransport::open(letters("ab"), {.rate_hz = 100, .pace = 0}));
  CHECK(transport->lossless());
  CHECK(play(*transport, 1000).at_ns.back() == kStart_ns);
}

TEST_CASE("a file that cannot be played is refused with a reason") {
  const auto reason = [](Chunks chunks, const PlaybackOptions& options) {
    const auto transport = FileTransport::open(std::move(chunks), options);
    return transport ? std::string() : transport.error().text();
  };
  CHECK(reason({}, {.rate_hz = 100}) == "there is nothing to play");
  CHECK(reason(letters("a"), {}).starts_with("the frame rate"));
  for (const double pace : {-1.0, 1e9, 1e-9, std::numeric_limits<double>::infinity(),
                            std::numeric_limits<double>::quiet_NaN()}) {
    CHECK(reason(letters("a"), {.rate_hz = 100, .pace = pace}).starts_with("pace should be"));
  }
  Chunks large;
  large.add(std::string(kMaxChunk + 1, 'x'));
  CHECK(reason(std::move(large), {.rate_hz = 100}).starts_with("frame 1 is longer"));
}

}  // namespace posed::drivers
