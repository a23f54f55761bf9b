#include "proto/clip/timecode_cut.hpp"

#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include <catch2/catch.hpp>

namespace posed::clip {
namespace {

// Frames of a minute of 29.97 drop frame from `first`, each number as the frame after it has it.
std::string label(int number, bool drops) {
  if (drops) {
    const int ten = number / 17982, rest = number % 17982;
    number += 18 * ten + (rest < 1800 ? 0 : 2 * ((rest - 1800) / 1798 + 1));
  }
  number %= 24 * 3600 * 30;
  char text[16];
  const int length = std::snprintf(text, sizeof text, "%02d:%02d:%02d:%02d", number / 108000,
                                   number / 1800 % 60, number / 30 % 60, number % 30);
  return {text, static_cast<std::size_t>(length)};
}

Clip clip_of_codes(const std::vector<std::string>& codes, double rate_hz) {
  auto skeleton = std::make_shared<Skeleton>();
  skeleton->joints.emplace_back().name = "root";
  Clip clip;
  clip.path = "take";
  clip.skeleton = skeleton;
  clip.frame_rate_hz = rate_hz;
  clip.channels.resize(std::ssize(codes), 1);
  for (const std::string& code : codes) {
    clip.channels(std::ssize(clip.timecode), 0) = static_cast<double>(clip.timecode.size());
    clip.timecode.push_back(to_timecode(code));
  }
  return clip;
}

// "first to last" of the frames that stay, or what the error says.
std::string kept(const Clip& clip, const char* from, const char* to = "") {
  const auto cut = cut_by_timecode(clip, from, to);
  if (!cut) return cut.error().text();
  const auto frame = [&](int at) { return std::to_string(static_cast<int>(cut->channels(at, 0))); };
  return frame(0) + " to " + frame(cut->frames() - 1);
}

}  // namespace

TEST_CASE("a clip is cut by the timecode of its frames, through drop frame and midnight") {
  // Four frames of 120 Hz have one number of 30 a second.
  const auto minutes = [](int first, bool drops) {
    std::vector<std::string> codes;
    for (int i = 0; i < 2 * 7200; ++i) codes.push_back(label(first + i / 4, drops));
    return clip_of_codes(codes, 120.0);
  };
  const Clip plain = minutes(10 * 108000, false);
  CHECK(kept(plain, "10:00:01:00") == "120 to 14399");
  CHECK(kept(plain, "", "10:00:01:00") == "0 to 123");
  CHECK(kept(plain, "10:00:01:05@30", "10:00:01:06") == "140 to 147");
  const Clip dropping = minutes(0, true);
  REQUIRE(view_of(dropping.timecode[7200]) == "00:01:00:02");
  CHECK(kept(dropping, "00:00:59;29", "00:01:00;02") == "7196 to 7203");
  const Clip midnight = minutes(24 * 108000 - 30, false);
  CHECK(kept(midnight, "23:59:59:15", "00:00:00:01") == "60 to 127");
  CHECK(kept(midnight, "00:00:10:00") == "1320 to 14399");
  const auto early = cut_by_timecode(midnight, "23:59:00:00", "");
  REQUIRE(early);
  CHECK(early->frames() == 14400);
  CHECK(early->warnings.size() == 1);
}

TEST_CASE("milliseconds and a take's beginning are cut with the rate that is said") {
  const Clip ms = clip_of_codes({"10:00:00.000", "", "10:00:00.200", "10:00:00.300"}, 10.0);
  CHECK(kept(ms, "10:00:00.150") == "2 to 3");
  CHECK(kept(ms, "10:00:00:05@25") == "2 to 3");
  CHECK_THAT(kept(ms, "10:00:00:05"), Catch::Contains("10:20:30:05@25"));
  std::vector<std::string> trigger(100 * 61);
  trigger[0] = "00:00:59:00";
  const Clip take = clip_of_codes(trigger, 100.0);
  CHECK(kept(take, "00:01:00:00@25") == "100 to 6099");
  CHECK(kept(take, "00:01:01:00@25", "00:01:01:10@25") == "200 to 240");
  // The second that lacks two numbers is no longer than the others.
  CHECK(kept(take, "00:01:00;02@29.97") == "101 to 6099");
  CHECK_THAT(kept(take, "00:01:00:00"), Catch::Contains("now and then"));
}

TEST_CASE("a timecode that cannot be is refused with a sentence") {
  for (const char* text :
       {"", "10:00:00", "24:00:00:00", "10:60:00:00", "1:00:00:00", "10:00:00:0x", "10:00:00:05@",
        "10:00:00:05@31", "10:00:00:25@25", "10:00:00.050@25", "10:01:00;00", "10:01:00;03@59.94",
        "10:00:00;00@25"}) {
    INFO(text);
    const auto moment = parse_timecode(text);
    REQUIRE_FALSE(moment);
    CHECK(moment.error().text().size() > 40);
  }
  for (const char* text : {"10:10:00;00", "10:01:00;02@29.97", "10:00:00:23@23.98",
                           "10:00:00:47@47.952", "00:00:00:99@100", "23:59:59.999"}) {
    INFO(text);
    CHECK(parse_timecode(text));
  }
  std::vector<std::string> codes;
  for (int i = 0; i < 90; ++i) codes.push_back(label(i, false));
  const Clip clip = clip_of_codes(codes, 30.0);
  CHECK_THAT(kept(clip, "00:00:00:10@25"), Catch::Contains("counts frames 0 to 29"));
  CHECK_THAT(kept(clip, "00:00:00:40"), Catch::Contains("counts frames 0 to 29"));
  CHECK_THAT(kept(clip, "00:00:00.500"), Catch::Contains("write hh:mm:ss:ff"));
  CHECK_THAT(kept(clip, "05:00:00:00"), Catch::Contains("00:00:00:00 to 00:00:02:29"));
  CHECK_THAT(kept(clip_of_codes({}, 30.0), "05:00:00:00"), Catch::Contains("no timecode"));
}

}  // namespace posed::clip
