// `posed smooth` with the real binary: the live stage offline, filled gaps, messages on wrong use.
#include <cmath>
#include <fstream>
#include <iterator>

#include <nlohmann/json.hpp>

#include "proto/clip/hand_clip.hpp"
#include "proto/frame/hand_skeleton.hpp"
#include "tests/e2e/outcome.hpp"
#include "tests/support/temp_folder.hpp"

namespace posed::test {
namespace {

// A hand that opens and closes, 60 Hz; five frames of the index are missing.
clip::HandClip waving() {
  clip::HandClip hand;
  hand.rate_hz = 60.0;
  for (int t = 0; t < 240; ++t) {
    hand.time_s.push_back(t / 60.0);
    HandAngles& angles = hand.angles.emplace_back();
    for (std::size_t c = 0; c < angles.size(); c += 3) {
      angles[c] = 0.6 + 0.5 * std::sin(t / 15.0 + static_cast<double>(c));
    }
    if (t >= 100 && t < 105) {
      for (std::size_t c = 9; c < 18; ++c) angles[c] = std::nan("");
    }
  }
  return hand;
}

}  // namespace

TEST_CASE("a recorded hand is smoothed and its gaps filled", "[smooth]") {
  const TempFolder folder;
  const auto in = folder.path() / "in.csv";
  const auto out = folder.path() / "out.csv";
  const clip::HandClip hand = waving();
  clip::HandClip flaky = hand;
  flaky.angles[150][30] += 1.0;  // bends the ring finger's middle joint
  REQUIRE(clip::write_hand_csv(flaky, in));
  const auto done =
      posed({"smooth", "--lag", "33ms", "--noise-deg", "1", in, "--out", out, "--json"});
  REQUIRE(done.code == 0);
  const auto report = nlohmann::json::parse(done.out);
  CHECK(report["frames"] == 240);
  CHECK(report["lag_frames"] == 2);
  CHECK(report["bridged_values"] == 45);
  CHECK(report["dropped_values"] == 1);
  REQUIRE(report["dropped"].size() == 1);
  CHECK(report["dropped"][0]["joint"] == hand_skeleton(hand.side).joints[11].name);
  CHECK(report["dropped"][0]["share"] == Approx(1.0 / 240));
  const auto smooth = clip::read_hand_clip(out);
  REQUIRE(smooth);
  REQUIRE(smooth->angles.size() == hand.angles.size());
  const clip::HandClip whole = [&hand] {
    clip::HandClip filled = hand;
    clip::fill_gaps(filled);
    return filled;
  }();
  for (std::size_t t = 0; t < hand.angles.size(); ++t) {
    CHECK(smooth->time_s[t] == Approx(hand.time_s[t]).margin(1e-6));
    for (std::size_t c = 0; c < kHandChannels; ++c) {
      REQUIRE(std::abs(smooth->angles[t][c] - whole.angles[t][c]) < 0.1);
    }
  }
}

TEST_CASE("smooth never destroys a recording", "[smooth]") {
  const TempFolder folder;
  const std::string in = folder.path() / "in.csv";
  REQUIRE(clip::write_hand_csv(waving(), in));
  const auto bytes = [&](const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    return std::string{std::istreambuf_iterator<char>(file), {}};
  };
  const std::string before = bytes(in);
  const auto onto_itself = posed({"smooth", in, "--out", in, "--overwrite"});
  CHECK(onto_itself.code == 2);
  CHECK(onto_itself.err.find("is read by this command") != std::string::npos);
  CHECK(bytes(in) == before);
  const std::string other = folder.write("other.csv", "mine");
  CHECK(posed({"smooth", in, "--out", other}).code == 2);
  CHECK(bytes(other) == "mine");
  CHECK(posed({"smooth", in, "--out", folder.path() / "out.bvh"}).code == 2);
  CHECK(posed({"smooth", in, "--out", other, "--overwrite"}).code == 0);
}

TEST_CASE("wrong use of smooth gives one error message", "[smooth]") {
  const TempFolder folder;
  const std::string in = folder.path() / "in.csv";
  const std::string out = folder.path() / "out.csv";
  REQUIRE(clip::write_hand_csv(waving(), in));
  const auto too_long = posed({"smooth", "--lag", "6", in, "--out", out});
  CHECK(too_long.code == 2);
  CHECK(too_long.err.find("at most 5") != std::string::npos);
  CHECK(posed({"smooth", "--lag", "fast", in, "--out", out}).code == 2);
  CHECK(posed({"smooth", "--noise-deg", "-1", in, "--out", out}).code == 2);
  CHECK(posed({"smooth", in + ".gone", "--out", out}).code == 1);
  const auto no_model = posed({"smooth", "--model", in, in, "--out", out});
  CHECK(no_model.code == 1);
  CHECK(no_model.err.find("in.csv") != std::string::npos);
}

}  // namespace posed::test
