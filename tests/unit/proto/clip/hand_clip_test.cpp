#include "proto/clip/hand_clip.hpp"

#include <catch2/catch.hpp>

#include <cmath>

#include "proto/clip/format.hpp"
#include "proto/frame/hand_skeleton.hpp"
#include "tests/support/temp_folder.hpp"

namespace posed::clip {
namespace {

std::string header() {
  std::string line = "time_s";
  for (const std::string_view finger : kFingerNames) {
    for (const char joint : {'1', '2', '3'}) {
      for (const char axis : {'x', 'y', 'z'}) {
        line += ',' + std::string(finger) + joint + '_' + axis + "_rad";
      }
    }
  }
  return line + '\n';
}

// A frame whose angle k is `base` + k / 100.
std::string row(const std::string& time, double base) {
  std::string line = time;
  for (int k = 0; k < kHandChannels; ++k) line += ',' + std::to_string(base + k / 100.0);
  return line + '\n';
}

Result<HandClip> parse_hand_csv(const std::string& text) {
  const auto clip = TRY(parse_clip({.name = "h.csv", .bytes = text}));
  return hand_of(clip);
}

std::string error_of(const std::string& text) {
  const auto clip = parse_hand_csv(text);
  REQUIRE_FALSE(clip.has_value());
  return clip.error().text();
}

HandClip read(const std::string& text) {
  auto clip = parse_hand_csv(text);
  if (!clip) FAIL(clip.error().text());
  return std::move(*clip);
}

// A hand that closes beyond a right angle and opens again, every channel moving.
HandClip closing_hand(Side side) {
  HandClip clip{
      .path = "made", .side = side, .rate_hz = 60.0, .time_s = {}, .angles = {}, .warnings = {}};
  for (int i = 0; i < 90; ++i) {
    HandAngles angles;
    for (std::size_t a = 0; a < angles.size(); ++a) {
      const double swing = std::sin(i * 0.07 + 0.1 * static_cast<double>(a));
      angles[a] = a % 3 == 0 ? 0.9 + 0.9 * swing : 0.2 * swing;
    }
    clip.time_s.push_back(i / 60.0);
    clip.angles.push_back(angles);
  }
  return clip;
}

}  // namespace

TEST_CASE("Unix time counts from the first frame, and what is no time is called so") {
  const HandClip clip = read(header() + row("1700000000.5", 0.0) + row("1700000000.75", 1.0));
  CHECK(clip.time_s[0] == 0.0);
  CHECK(clip.time_s[1] == Approx(0.25));
  for (const char* time : {"1700000000000", "22:13:20.5", "2023-11-14T22:13:20Z"}) {
    INFO(time);
    CHECK(
        error_of(header() + row(time, 0)).contains("is no time: the first column counts seconds"));
  }
}

TEST_CASE("a missing value of any program is one, and any other word is an error") {
  const auto last = [](const std::string& value) {
    std::string text = row("0.1", 1.0);
    text.replace(text.rfind(','), std::string::npos, "," + value + "\n");
    return header() + row("0", 0.0) + text;
  };
  for (const char* value : {"", "nan", "NaN", "NA", "N/A", "null", "None", "-", "-nan(ind)"}) {
    INFO(value);
    CHECK(std::isnan(read(last(value)).angles[1][44]));
  }
  for (const char* value : {"inf", "x", "--1", "nana"}) {
    INFO(value);
    CHECK(error_of(last(value)).ends_with("is not a number a pose can have"));
  }
}

TEST_CASE("a hand CSV is read: times, angles in hand45 order, missing values") {
  std::string text = header() + row("0.5", 0.0) + row("0.6", 1.0);
  const std::size_t field = text.rfind(",1.01");
  text.erase(field + 1, std::string("1.010000").size());
  const HandClip clip = read(text);
  CHECK(clip.warnings.empty());
  CHECK(clip.rate_hz == Approx(10.0));
  CHECK(clip.time_s == std::vector{0.5, 0.6});
  CHECK(clip.angles[0][44] == Approx(0.44));
  CHECK(std::isnan(clip.angles[1][1]));
  CHECK(clip.angles[1][2] == Approx(1.02));
}

TEST_CASE("line ends, blanks, blank lines and a byte order mark do not matter") {
  const std::string plain = header() + row("0", 0.1) + row("0.1", 0.2);
  std::string odd = "\xEF\xBB\xBF";
  for (const char c : plain) odd += c == '\n' ? std::string(" \r\n\r\n") : std::string(1, c);
  std::string spaced;
  for (const char c : plain) spaced += c == ',' ? std::string(" , ") : std::string(1, c);
  CHECK(read(odd).angles == read(plain).angles);
  CHECK(read(spaced).angles == read(plain).angles);
}

TEST_CASE("a hand CSV that a spreadsheet, pandas or R saved is the same hand") {
  const std::string plain = header() + row("0", 0.125) + row("0.1", -2.5);
  const auto spread = [&](char separator, char point) {
    std::string odd;
    for (const char c : plain) odd += c == ',' ? separator : c == '.' ? point : c;
    return odd;
  };
  std::string utf16 = "\xff\xfe";
  for (const char c : plain) utf16 += {c, '\0'};
  const std::string numbered = "\"\",\"time_s\"" + header().substr(std::string("time_s").size()) +
                               "0," + row("0", 0.125) + "1," + row("0.1", -2.5);
  for (const std::string& odd : {spread(';', ','), spread(';', '.'), spread('\t', '.'),
                                 "sep=;\r\n" + spread(';', ','), numbered, utf16}) {
    INFO(odd.substr(0, 40));
    const HandClip clip = read(odd);
    CHECK(clip.angles == read(plain).angles);
    CHECK(clip.time_s == read(plain).time_s);
  }
  CHECK(error_of("Frame,Hips_x\n1,2\n").ends_with("reads .bvh, .fbx and .glb: export one there"));
}

TEST_CASE("times may be uneven, missing or repeated; they may not run back") {
  const HandClip gaps = read(header() + row("", 0) + row("1.0", 0) + row("1.1", 0) + row("", 0) +
                             row("1.3", 0) + row("1.3", 0) + row("1.4", 0) + row("", 0));
  const std::vector<double> expected{0.9, 1.0, 1.1, 1.2, 1.3, 1.35, 1.4, 1.5};
  REQUIRE(gaps.time_s.size() == expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) CHECK(gaps.time_s[i] == Approx(expected[i]));
  CHECK(gaps.warnings.at(0) ==
        "4 of 8 frames have no time of their own; placed between the others");
  const HandClip none = read(header() + row("", 0) + row("", 0));
  CHECK(none.rate_hz == 30.0);
  CHECK(none.time_s[1] == Approx(1.0 / 30));
  CHECK(none.warnings.at(0) == "2 of 2 frames have no time of their own; played at 30 Hz");
  CHECK(error_of(header() + row("0", 0) + row("2", 0) + row("1", 0)) ==
        "h.csv:4: frame 3: its time 1 lies before the 2 of a frame above it");
}

TEST_CASE("times that count milliseconds are refused, with how to convert them") {
  CHECK(error_of(header() + row("0", 0) + row("33.3", 0) + row("66.6", 0)) ==
        "h.csv:2: its times are 33.3 s apart, which is no recording of a hand; time_s counts"
        " seconds, so divide the times by 1000 if they are milliseconds");
  CHECK(read(header() + row("0", 0) + row("1", 0)).rate_hz == Approx(1.0));
}

TEST_CASE("stamps that are only rounded give the clock's own rate") {
  std::string text = header();
  for (int i = 0; i < 300; ++i) text += row(std::to_string(i / 30.0), 0);
  CHECK(read(text).rate_hz == Approx(30.0).epsilon(1e-6));
}

TEST_CASE("an invalid hand CSV is refused with its line") {
  CHECK(error_of("") == "h.csv: is empty, so it is no hand CSV");
  CHECK(error_of("\ntime_s,thumb1_y_rad\n") ==
        "h.csv:2: column 2 is 'thumb1_y_rad' where a hand CSV has 'thumb1_x_rad'; its header is "
        "time_s,thumb1_x_rad,thumb1_y_rad, ..., little3_z_rad");
  std::string wide = header();
  wide.insert(wide.size() - 1, ",more");
  CHECK(error_of(wide) == "h.csv:1: has more than the 46 columns of a hand CSV");
  CHECK(error_of(header()) == "h.csv: has no frames, so there is nothing to play");
  CHECK(error_of(header() + "0,1,2\n")
            .starts_with("h.csv:2: frame 1: the frame has 3 values where its channels need 46"));
  std::string extra = row("0", 0);
  extra.insert(extra.size() - 1, ",1");
  CHECK(
      error_of(header() + extra).starts_with("h.csv:2: frame 1: the frame has 47 values or more"));
  for (const std::string bad : {"inf", "1e300", "0x1", "one", "1;2"}) {
    std::string line = row("0", 0);
    line.replace(line.find("0.000000"), 8, bad);
    CHECK(error_of(header() + row("0", 0) + line) ==
          "h.csv:3: frame 2: '" + bad + "' is not a number a pose can have");
  }
  std::string degrees = row("0", 0);
  degrees.replace(degrees.find("0.000000"), 8, "90.0");
  CHECK(error_of(header() + degrees)
            .starts_with("h.csv:2: frame 1: '90.0' is beyond what a pose can have"));
}

TEST_CASE("a hand CSV is written as it was read, to the last bit") {
  const test::TempFolder folder;
  HandClip clip = closing_hand(Side::kRight);
  clip.angles[3][7] = std::nan("");
  REQUIRE(write_hand_csv(clip, folder.path() / "hand.csv"));
  const auto again = read_hand_clip(folder.path() / "hand.csv");
  if (!again) FAIL(again.error().text());
  CHECK(again->time_s == clip.time_s);
  CHECK(again->rate_hz == Approx(60.0));
  REQUIRE(again->angles.size() == clip.angles.size());
  for (std::size_t i = 0; i < clip.angles.size(); ++i) {
    for (std::size_t a = 0; a < kHandChannels; ++a) {
      const bool same = again->angles[i][a] == clip.angles[i][a] ||
                        (std::isnan(again->angles[i][a]) && std::isnan(clip.angles[i][a]));
      if (!same) FAIL(i << " " << a);
    }
  }
}

TEST_CASE("a hand goes through a BVH and back with the same angles, both sides") {
  const test::TempFolder folder;
  for (const Side side : {Side::kLeft, Side::kRight}) {
    const HandClip hand = closing_hand(side);
    const auto clip = clip_of_hand(hand, "adult");
    REQUIRE(clip);
    REQUIRE(write_bvh(*clip, folder.path() / "hand.bvh"));
    auto read_back = read_clip(folder.path() / "hand.bvh");
    if (!read_back) FAIL(read_back.error().text());
    CHECK(read_back->warnings.empty());
    CHECK(read_back->skeleton->joints[5].offset_m.isApprox(clip->skeleton->joints[5].offset_m));
    const auto again = hand_of(*read_back);
    if (!again) FAIL(again.error().text());
    CHECK(again->side == side);
    double worst_rad = 0.0;
    for (std::size_t i = 0; i < hand.angles.size(); ++i) {
      for (std::size_t a = 0; a < kHandChannels; ++a) {
        worst_rad = std::max(worst_rad, std::abs(again->angles[i][a] - hand.angles[i][a]));
      }
    }
    CHECK(worst_rad < 1e-6);
    read_back->channels.row(10).setConstant(std::nan(""));
    const auto gap = hand_of(*read_back);
    REQUIRE(gap);
    CHECK(std::isnan(gap->angles[10][0]));
    CHECK(gap->angles[11][0] == Approx(hand.angles[11][0]));
  }
}

TEST_CASE("a clip without the fingers of a hand says what is missing") {
  Clip clip;
  auto skeleton = std::make_shared<Skeleton>(hand_skeleton(Side::kLeft));
  skeleton->joints[4].bone.reset();
  clip.skeleton = skeleton;
  clip.path = "c.bvh";
  CHECK(hand_of(clip, {.hand = Side::kLeft}).error().text() ==
        "c.bvh: has no left hand with fifteen finger joints: leftIndexProximal is missing");
}

TEST_CASE("gaps are filled linearly and reported") {
  HandClip clip = closing_hand(Side::kRight);
  const double before = clip.angles[10][0];
  const double after = clip.angles[13][0];
  for (const std::size_t i : {0U, 1U, 11U, 12U}) clip.angles[i][0] = std::nan("");
  for (HandAngles& angles : clip.angles) angles[5] = std::nan("");
  const double first = clip.angles[2][0];
  fill_gaps(clip);
  CHECK(clip.angles[0][0] == first);
  CHECK(clip.angles[11][0] == Approx(before + (after - before) / 3));
  CHECK(clip.angles[12][0] == Approx(before + (after - before) * 2 / 3));
  CHECK(clip.angles[40][5] == 0.0);
  CHECK(clip.warnings.at(0) == "94 missing values were filled from their neighbours in time");
}

}  // namespace posed::clip
