// The landmarks driver: its messages, what is refused, its bodies, and the angles of hands whose
// points are known.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <numbers>
#include <random>
#include <sstream>
#include <string>

#include "drivers/driver.hpp"
#include "drivers/landmarks/emulator.hpp"
#include "drivers/landmarks/fit.hpp"
#include "drivers/landmarks/protocol.hpp"
#include "drivers/landmarks/tracks.hpp"
#include "proto/frame/hand_skeleton.hpp"
#include "tests/support/allocations.hpp"
#include "tests/support/shared.hpp"
#include "tests/unit/drivers/collect_sink.hpp"
#include "tests/unit/drivers/recorded_log.hpp"

namespace posed::drivers::landmarks {
namespace {

using test::CollectSink;
using Bytes = std::vector<std::byte>;
using Layout = std::unique_ptr<const SourceLayout>;

Bytes bytes_of(const std::string& text) {
  const auto bytes = std::as_bytes(std::span(text));
  return {bytes.begin(), bytes.end()};
}

std::string points_text(std::size_t numbers, const std::string& one = "0.01") {
  std::string text;
  for (std::size_t i = 0; i < numbers; ++i) text += (i == 0 ? "" : ",") + one;
  return "[" + text + "]";
}

// Points of a flat hand, written as a tracker writes them.
std::string flat_hand(const std::string& side = "right", const std::string& score = "0.9") {
  LandmarksEmulator emulator(10.0);
  Bytes bytes;
  emulator.emit(0, bytes);
  const std::string text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const auto at = text.find("\"points\":", text.find(side));
  const auto points = text.substr(at, text.find(']', at) + 1 - at);
  return R"({"side":")" + side + R"(","score":)" + score + "," + points + "}";
}

std::string message_of(const std::string& hands, const std::string& head = R"("version":1)") {
  return R"({"posed":"landmarks",)" + head + R"(,"hands":[)" + hands + "]}";
}

// A decoder that knows both hands.
struct LandmarksRig {
  const Driver& driver = *find_driver("landmarks");
  std::unique_ptr<Decoder> decoder = driver.make_decoder(driver.expect({}).value()).value();
  Layout layout = driver.make_layout(std::array{std::byte{3}}).value();
  CollectSink sink;
  std::int64_t now_ns = 0;

  LandmarksRig() { decoder->use(*layout); }
  // What it is counted as.
  Outcome feed(const std::string& text) {
    sink.clear();
    decoder->feed(bytes_of(text), now_ns, sink);
    for (int i = 0; i < kOutcomes; ++i) {
      if (sink.outcomes[static_cast<std::size_t>(i)] != 0) return static_cast<Outcome>(i);
    }
    return Outcome::kCount;
  }
};

bool is_finite(double value) { return std::isfinite(value); }

// Angles of a hand that 21 points can tell, anywhere within its limits but their ends.
HandAngles random_angles(std::mt19937& random) {
  const HandShape& shape = default_hand_shape();
  HandAngles angles{};
  const auto set = [&](std::size_t f, std::size_t j, std::size_t axis) {
    const AngleRange& range = shape.fingers[f].range[j][axis];
    std::uniform_real_distribution<double> any(0.98 * range.min_rad, 0.98 * range.max_rad);
    angles[f * kFingerChannels + 3 * j + axis] = any(random);
  };
  for (std::size_t f = 0; f < kFingers; ++f) {
    set(f, 0, f == 0 ? 2 : 0);
    set(f, 0, 1);
    set(f, 1, 0);
    set(f, 2, 0);
  }
  return angles;
}

// The points anywhere before the camera, turned in any way, of a hand of any size.
Landmarks moved(const Landmarks& point_m, std::mt19937& random) {
  std::normal_distribution<double> normal;
  const Eigen::Quaterniond turn =
      Eigen::Quaterniond(normal(random), normal(random), normal(random), normal(random))
          .normalized();
  const Eigen::Vector3d place_m =
      0.1 * Eigen::Vector3d(normal(random), normal(random), normal(random));
  const double size = std::uniform_real_distribution<double>(0.5, 1.3)(random);
  Landmarks there{};
  for (std::size_t k = 0; k < kLandmarks; ++k) {
    const Eigen::Vector3d p =
        place_m + size * (turn * Eigen::Vector3f(point_m[k].data()).cast<double>());
    for (int i = 0; i < 3; ++i) there[k][i] = static_cast<float>(p[i]);
  }
  return there;
}

}  // namespace

TEST_CASE("the landmarks of a posed hand give its angles back") {
  const HandFit fit;
  std::mt19937 random(7);
  double worst_deg = 0.0;
  int thumbs = 0;  // further off, where a float's last digit is a hundredth of a degree
  constexpr int kSeeds = 4000;
  for (int seed = 0; seed < kSeeds; ++seed) {
    const Side side = seed % 2 == 0 ? Side::kLeft : Side::kRight;
    const Skeleton skeleton = hand_skeleton(side);
    const HandAngles given = random_angles(random);
    Frame frame;
    set_hand_angles(skeleton, given, frame);
    HandAngles got{};
    REQUIRE(fit.angles_of(side, moved(landmarks_of(skeleton, frame), random), got));
    double thumb_deg = 0.0;
    for (std::size_t i = 0; i < given.size(); ++i) {
      const double off_deg = std::abs(got[i] - given[i]) * 180.0 / std::numbers::pi;
      double& worst = i < kFingerChannels ? thumb_deg : worst_deg;
      worst = std::max(worst, off_deg);
    }
    // A thumb that stands along its own axis of opposition has one spread for two points.
    CHECK(thumb_deg < 0.1);
    thumbs += thumb_deg < 0.01 ? 0 : 1;
  }
  CHECK(worst_deg < 0.01);
  CHECK(thumbs < kSeeds / 200);
}

TEST_CASE("whatever points come, the angles are finite and within the limits") {
  const HandFit fit;
  const HandShape& shape = default_hand_shape();
  std::mt19937 random(11);
  std::uniform_real_distribution<float> any(-0.2F, 0.2F);
  std::uniform_int_distribution<std::size_t> which(0, kLandmarks - 1);
  int fitted = 0;
  for (int seed = 0; seed < 5000; ++seed) {
    Landmarks point_m{};
    for (Vec3f& p : point_m) p = {any(random), any(random), any(random)};
    for (int same = 0; same < seed % 20; ++same) point_m[which(random)] = point_m[which(random)];
    HandAngles angles{};
    if (!fit.angles_of(Side::kRight, point_m, angles)) continue;
    ++fitted;
    for (std::size_t i = 0; i < angles.size(); ++i) {
      const AngleRange& range = shape.fingers[i / kFingerChannels].range[i / 3 % 3][i % 3];
      CHECK((angles[i] >= range.min_rad && angles[i] <= range.max_rad));  // false for NaN
    }
  }
  CHECK(fitted > 3000);
  HandAngles angles{};
  CHECK_FALSE(fit.angles_of(Side::kRight, Landmarks{}, angles));
}

TEST_CASE("a hand tracker's hands become bodies of hand45") {
  LandmarksRig rig;
  REQUIRE(rig.feed(message_of(flat_hand("left") + "," + flat_hand("right"),
                              R"("version":1,"time_ns":5)")) == Outcome::kOk);
  REQUIRE(rig.sink.frames.size() == 2);
  CHECK(rig.sink.bodies == std::vector<std::size_t>{0, 1});
  CHECK(hand_side(*rig.layout->bodies[0].skeleton) == Side::kLeft);
  CHECK(rig.layout->bodies[1].name == "right");
  for (const double angle_rad : hand_angles(rig.sink.frames[1])) CHECK(std::abs(angle_rad) < 1e-3);
  // Nothing is seen, and the tracker says so: for a second the hands are somewhere.
  for (const std::string& none : {std::string(), flat_hand("left", "0.3")}) {
    rig.now_ns += kNanosPerSecond / 2;
    CHECK(rig.feed(message_of(none)) == Outcome::kOk);
    REQUIRE(rig.sink.frames.size() == 2);
    CHECK(std::ranges::none_of(hand_angles(rig.sink.frames[0]), is_finite));
  }
  rig.now_ns += 1;
  CHECK(rig.feed(message_of("")) == Outcome::kOk);
  CHECK(rig.sink.frames.empty());
  // One hand is damaged, the other is kept.
  CHECK(rig.feed(message_of(R"({"side":"left","points":[]},)" + flat_hand())) == Outcome::kShort);
  CHECK(rig.sink.frames.size() == 1);
}

TEST_CASE("a hand keeps its side whatever single pictures say, until somebody tells another") {
  LandmarksRig rig;
  const auto bodies = [&](const std::string& hand, int messages) {
    std::vector<std::size_t> all;
    for (int i = 0; i < messages; ++i) {
      rig.now_ns += kNanosPerSecond / 10;
      CHECK(rig.feed(message_of(hand)) == Outcome::kOk);
      REQUIRE(rig.sink.frames.size() == 1);
      all.push_back(rig.sink.bodies[0]);
    }
    return all;
  };
  const std::string right = flat_hand("right"), left = flat_hand("left");
  CHECK(bodies(right, 20) == std::vector<std::size_t>(20, 1));
  // It is taken for the other hand: first without angles, then with what there is.
  CHECK(bodies(left, 2) == std::vector<std::size_t>(2, 1));
  CHECK(std::ranges::none_of(hand_angles(rig.sink.frames[0]), is_finite));
  CHECK(bodies(left, 10) == std::vector<std::size_t>(10, 1));
  CHECK(std::ranges::all_of(hand_angles(rig.sink.frames[0]), is_finite));
  rig.now_ns += kNanosPerSecond / 2;  // lost for a moment
  CHECK(bodies(left, 1) == std::vector<std::size_t>(1, 1));
  CHECK(bodies(left, 60).back() == 0);  // most pictures count
  std::string sure = right;
  CHECK(bodies(sure.insert(1, R"("sure":true,)"), 1) == std::vector<std::size_t>(1, 1));
  CHECK(bodies(left, 20) == std::vector<std::size_t>(20, 1));
  for (int i = 0; i < 3; ++i) {
    rig.now_ns += kNanosPerSecond / 2;
    CHECK(rig.feed(message_of("")) == Outcome::kOk);
  }
  CHECK(bodies(left, 1) == std::vector<std::size_t>(1, 0));  // another hand
}

TEST_CASE("pictures of a palm decide a hand's side, not those of a back or of half a palm") {
  HandTracks tracks;
  std::int64_t now_ns = 0;
  // The side after so many pictures; the palm is towards the camera, or the back.
  const auto after = [&](Side side, int pictures, float breadth, bool back) {
    const Skeleton skeleton = hand_skeleton(side);
    Frame frame;
    set_hand_angles(skeleton, HandAngles{}, frame);
    TrackedHand hand{.side = side, .score = 1.0, .outcome = Outcome::kOk};
    hand.point_m = landmarks_of(skeleton, frame);
    const float turned = back ? -1.0F : 1.0F;
    for (auto& [x, y, z] : hand.point_m) {
      const Vec3f lying{x, y, z};
      x = turned * breadth * lying[0];
      y = -lying[2];
      z = turned * lying[1];
    }
    Side known = side;
    for (int i = 0; i < pictures; ++i) {
      Message message{.count = 1};
      message.hands[0] = hand;
      tracks.follow(message, now_ns);
      now_ns += kNanosPerSecond / 10;
      known = message.hands[0].side;
    }
    return known;
  };
  CHECK(after(Side::kRight, 10, 1.0F, false) == Side::kRight);
  CHECK(after(Side::kLeft, 30, 1.0F, true) == Side::kRight);
  CHECK(after(Side::kLeft, 30, 0.7F, false) == Side::kRight);
  CHECK(after(Side::kLeft, 20, 1.0F, false) == Side::kLeft);
}

TEST_CASE("a tracker's messages are lines over TCP, and one that stops takes its hands away") {
  const Driver& driver = *find_driver("landmarks");
  const auto decoder =
      driver.make_decoder(driver.expect({{"link", std::string("tcp")}}).value()).value();
  CollectSink sink;
  std::string text;
  for (int i = 0; i < 3; ++i) text += message_of(flat_hand()) + "\r\n";
  text +=
      std::string(kMaxMessage + 1, 'x') + "\n" + message_of("", R"("version":1,"end":true)") + "\n";
  const Bytes bytes = bytes_of(text);
  for (std::size_t at = 0; at < bytes.size(); at += 100) {
    decoder->feed(std::span(bytes).subspan(at, std::min<std::size_t>(100, bytes.size() - at)), 0,
                  sink);
  }
  CHECK(sink.count(Outcome::kForeign) == 3);  // not described yet
  CHECK(sink.count(Outcome::kOutOfRange) == 1);
  CHECK(sink.count(Outcome::kOk) == 1);
  CHECK(sink.descriptions == 2);
  CHECK(sink.described == std::vector{std::byte{0}});
  CHECK(driver.make_layout(sink.described).value()->bodies.empty());
}

TEST_CASE("what is no hand of a tracker is refused and counted") {
  LandmarksRig rig;
  const auto hand = [](const std::string& points) {
    return message_of(R"({"side":"right","points":)" + points + "}");
  };
  const std::string good = flat_hand();
  const auto with = [&](const std::string& number) {
    std::string text = good;
    const auto at = text.find('[') + 1;
    return message_of(text.replace(at, text.find(',', at) - at, number));
  };
  CHECK(rig.feed(with("NaN")) == Outcome::kOutOfRange);
  CHECK(rig.feed(with("1e39")) == Outcome::kOutOfRange);
  CHECK(rig.feed(with("2000")) == Outcome::kOutOfRange);
  CHECK(rig.feed(with("true")) == Outcome::kOutOfRange);
  CHECK(rig.feed(hand(points_text(63))) == Outcome::kOutOfRange);  // all in one place
  CHECK(rig.feed(hand(points_text(62))) == Outcome::kShort);
  CHECK(rig.feed(hand(points_text(64))) == Outcome::kShort);
  CHECK(rig.feed(hand(points_text(4000, "1"))) == Outcome::kShort);
  CHECK(rig.feed(hand(points_text(30'000, "1"))) == Outcome::kOutOfRange);  // 10,000 points
  CHECK(rig.feed(message_of(good + "," + good)) == Outcome::kOutOfRange);
  CHECK(rig.feed(message_of(good + "," + good + "," + good)) == Outcome::kOutOfRange);
  CHECK(rig.feed(message_of(flat_hand("right", "1.5"))) == Outcome::kOutOfRange);
  CHECK(rig.feed(message_of(flat_hand("right", "NaN"))) == Outcome::kOutOfRange);
  CHECK(rig.feed(message_of(good, R"("version":2)")) == Outcome::kForeign);
  CHECK(rig.feed(message_of(good, R"("version":"1")")) == Outcome::kForeign);
  CHECK(rig.feed(R"({"posed":"other","version":1})") == Outcome::kForeign);
  CHECK(rig.feed("[1,2]") == Outcome::kForeign);
  CHECK(rig.feed(message_of(good) + "x") == Outcome::kShort);
  CHECK(rig.feed(message_of(good).substr(0, 300)) == Outcome::kShort);
  CHECK(rig.sink.frames.empty());
  // What a misspelt or empty variable of a tracker leaves is no hand that has gone.
  for (const char* wrong :
       {R"("hands":null)", R"("hands":{})", R"("hand":[])", R"("end":"yes")",
        R"("hands":[],"end":1)", R"("hands":[],"time_ns":"now")", R"("hands":[],"time_ns":null)"}) {
    INFO(wrong);
    CHECK(rig.feed(R"({"posed":"landmarks","version":1,)" + std::string(wrong) + "}") ==
          Outcome::kShort);
  }
  CHECK(rig.feed(message_of("", R"("version":1,"time_ns":1e999)")) == Outcome::kOutOfRange);
  std::string unsure = good;
  CHECK(rig.feed(message_of(unsure.insert(1, R"("sure":"yes",)"))) == Outcome::kOutOfRange);
  // Time: the same again, and one that was overtaken.
  CHECK(rig.feed(message_of(good, R"("version":1,"time_ns":2000000000)")) == Outcome::kOk);
  CHECK(rig.feed(message_of(good, R"("version":1,"time_ns":2000000000)")) == Outcome::kDuplicate);
  CHECK(rig.feed(message_of(good, R"("version":1,"time_ns":1900000000)")) == Outcome::kLate);
}

TEST_CASE(
    "a tracker's hand is described when it has been seen three times, and nothing allocates") {
  LandmarksRig rig;
  const auto fresh = rig.driver.make_decoder(rig.driver.expect({}).value()).value();
  LandmarksEmulator emulator(10.0);
  std::vector<Bytes> messages(40);
  for (std::size_t i = 0; i < messages.size(); ++i) {
    emulator.set_seen(0, i == 5 || i > 20);
    emulator.emit(emulator.next_due_ns(), messages[i]);
  }
  for (std::size_t i = 0; i < messages.size(); ++i) {
    const int earlier = rig.sink.descriptions;
    const auto before = test::allocations();
    fresh->feed(messages[i], static_cast<std::int64_t>(i) * 100'000'000, rig.sink);
    CHECK(test::allocations() == before);
    if (rig.sink.descriptions == earlier) continue;
    CHECK((i == 2 || i == 23));
    CHECK(rig.sink.described == std::vector{i == 2 ? std::byte{2} : std::byte{3}});
    if (i == 2) fresh->use(*rig.layout);
  }
  CHECK(rig.sink.descriptions == 2);
  CHECK(rig.sink.count(Outcome::kForeign) == 3);
  CHECK_FALSE(rig.driver.make_layout(std::array{std::byte{4}}));
  CHECK_FALSE(rig.driver.make_layout(std::array{std::byte{1}, std::byte{1}}));
}

namespace {

// A hand that comes before it is described, both hands, damage, times, and a hand that leaves.
std::string emulated_log() {
  std::string text =
      "# Not a recording: made by posed's emulator of a hand tracker, with damage put in.\n"
      "driver landmarks\nidentity udp 127.0.0.1:7420\ntext landmarks rate=10\n";
  LandmarksEmulator emulator(10.0);
  emulator.set_seen(0, false);
  for (int i = 0; i <= 16; ++i) {
    const std::int64_t at_ns = 1'000'000 + i * 100'000'000;
    if (i == 4 || i == 12) emulator.set_seen(0, i == 4);
    Bytes bytes;
    emulator.emit(emulator.next_due_ns(), bytes);
    if (i == 9) bytes[300] = std::byte{'x'};
    if (i == 10) bytes.resize(bytes.size() / 2);
    if (i == 11) bytes[31] = std::byte{'2'};  // the version
    text += test::recorded_row(at_ns, "hex", bytes);
    if (i == 13) text += test::recorded_row(at_ns, "hex", bytes);
    if (i == 2) text += test::recorded_row(at_ns, "bodies", std::array{std::byte{2}});
    if (i == 6) text += test::recorded_row(at_ns, "bodies", std::array{std::byte{3}});
  }
  return text;
}

}  // namespace

TEST_CASE("write the log of the emulated hand tracker", "[.write-logs]") {
  const auto path = test::golden("devices") / "landmarks.log";
  if (!std::filesystem::exists(path)) std::ofstream(path) << emulated_log();
}

// viewer/test/support/drawn_hands.cpp: each row the gesture, whether it is held, and 19 angles
// [deg] of the hand's own side, or - where there are none. A film whose name ends in "left" has a
// left hand.
TEST_CASE("what the driver makes of a drawn hand", "[.takes]") {
  constexpr std::array<std::size_t, 19> kAngle{2,  3,  6,  1,  9,  12, 15, 10, 18, 21,
                                               24, 27, 30, 33, 28, 36, 39, 42, 37};
  const char* const film = std::getenv("POSED_FILM");
  REQUIRE(film != nullptr);
  const std::string base = film;
  const std::size_t body = base.ends_with("left") ? 0 : 1;
  std::ifstream hands(base + ".hands"), truth(base + ".truth");
  std::ofstream take(base + ".take");
  LandmarksRig rig;
  for (std::string message, row; std::getline(hands, message) && std::getline(truth, row);) {
    std::istringstream words(row);
    std::string word, label, held;
    for (std::size_t i = 0; i < kHandChannels; ++i) words >> word;
    words >> label >> held;
    take << label << ' ' << held;
    static_cast<void>(rig.feed(message));
    rig.now_ns += kNanosPerSecond / 10;
    HandAngles angles{};
    angles.fill(std::numeric_limits<double>::quiet_NaN());
    for (std::size_t i = 0; i < rig.sink.frames.size(); ++i) {
      if (rig.sink.bodies[i] == body) angles = hand_angles(rig.sink.frames[i]);
    }
    if (!is_finite(angles[2])) take << " -";
    for (const std::size_t at : kAngle) {
      if (is_finite(angles[2])) take << ' ' << std::lround(angles[at] * 180.0 / std::numbers::pi);
    }
    take << '\n';
  }
}

}  // namespace posed::drivers::landmarks
