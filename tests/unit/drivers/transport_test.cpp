// The transports that play recordings: schedule, order, loop, end.
#include <catch2/catch.hpp>

#include <algorithm>
#include <limits>
#include <string>

#include "drivers/transport/file.hpp"
#include "drivers/transport/replay.hpp"
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

Recording recording(const std::vector<std::pair<std::int64_t, std::string>>& chunks) {
  Recording out;
  for (const auto& [arrival_ns, text] : chunks) out.add(arrival_ns, std::as_bytes(std::span(text)));
  return out;
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

TEST_CASE("a recording replays with its own gaps, faster, or at once") {
  const std::vector<std::pair<std::int64_t, std::string>> chunks{
      {1'000'000'000, "a"}, {1'004'000'000, "b"}, {1'004'000'000, "c"}, {1'020'000'000, "d"}};
  for (const double speed : {1.0, 4.0}) {
    const auto transport = must(ReplayTransport::open(recording(chunks), 1'000'000'000, speed));
    const Played played = play(*transport, 100);
    CHECK(played.text == "abcd");
    CHECK(played.ended);
    REQUIRE(played.at_ns.size() == 4);
    for (std::size_t i = 0; i < 4; ++i) {
      const auto after_ns = static_cast<double>(chunks[i].first - 1'000'000'000) / speed;
      CHECK(static_cast<double>(played.at_ns[i] - kStart_ns) == after_ns);
    }
  }
  const auto transport = must(ReplayTransport::open(recording(chunks), 1'000'000'000, 0));
  CHECK(play(*transport, 100).text == "abcd");
}

TEST_CASE("a recording's odd arrival times neither stop nor crash its replay") {
  constexpr auto kMin = std::numeric_limits<std::int64_t>::min();
  const auto transport =
      must(ReplayTransport::open(recording({{kMin, "a"}, {5, "b"}, {3, "c"}, {-7, "d"}}), 5, 1));
  CHECK(play(*transport, 100).text == "abcd");
  CHECK(must(ReplayTransport::open({}, 0, 1))->read(0).end);
  CHECK_FALSE(ReplayTransport::open({}, 0, -1).has_value());
  CHECK_FALSE(ReplayTransport::open({}, 0, std::numeric_limits<double>::quiet_NaN()).has_value());
}

}  // namespace posed::drivers
