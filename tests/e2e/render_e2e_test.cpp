// `posed render`: strips of clips and of a log with its unstyled motion.
#include <catch2/catch.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <numbers>
#include <thread>

#include "models/motion/motion.hpp"
#include "models/motion/synthetic_walker.hpp"
#include "models/style/model/stride_phase.hpp"
#include "proto/clip/hand_clip.hpp"
#include "tests/e2e/served.hpp"
#include "tests/support/file_text.hpp"
#include "tests/support/has.hpp"

namespace posed::test {
namespace {

using namespace std::chrono_literals;

class Gallery : public Stage {
 public:
  Gallery() {
    const auto walk = motion::make_walker({.seconds = 2.0, .rate_hz = 60.0}).value();
    REQUIRE(clip::write_bvh(walk, folder.path() / "walk.bvh"));
  }

  [[nodiscard]] ProgramOutcome render(const std::string& in, const std::string& out,
                                      std::vector<std::string> more = {}) const {
    more.insert(more.begin(), {"render", path(in), "--out", path(out)});
    return posed(std::move(more));
  }
};

}  // namespace

TEST_CASE("render draws a clip as a strip, as a pose and refuses what it cannot draw") {
  const Gallery gallery;
  const ProgramOutcome strip =
      gallery.render("walk.bvh", "strip.svg", {"--view", "side", "--count", "5", "--json"});
  INFO(strip.err);
  REQUIRE(strip.code == 0);
  CHECK(nlohmann::json::parse(strip.out).at("frames") == 120);
  const std::string svg = file_text(gallery.path("strip.svg"));
  CHECK(has(svg, "5 poses seen from the side"));
  CHECK(has(svg, "walk.bvh"));

  REQUIRE(gallery.render("walk.bvh", "pose.svg", {"--frame", "60"}).code == 0);
  CHECK(has(file_text(gallery.path("pose.svg")), "1.00 s"));
  REQUIRE(gallery.render("walk.bvh", "POSE.SVG", {"--frame", "60"}).code == 0);
  CHECK(file_text(gallery.path("POSE.SVG")) == file_text(gallery.path("pose.svg")));

  const auto refused = [&](const std::string& out, const std::vector<std::string>& more,
                           const std::string& sentence) {
    const ProgramOutcome outcome = gallery.render("walk.bvh", out, more);
    INFO(outcome.err);
    CHECK(outcome.code == 2);
    CHECK(has(outcome.err, sentence));
  };
  refused("no.svg", {"--frame", "120"}, "0 to 119, not 120");
  refused("no.mp4", {}, "add --video");
  refused("no.svg", {"--video"}, "a video is ... .webp");
  refused("no.svg", {"--raw-beside"}, "is a clip");
  refused("no.svg", {"--from", "7"}, "7 s ... lasts ");
  refused("strip.svg", {}, "--overwrite");
}

TEST_CASE("the pictures of a strip show a whole stride, however many strides there are") {
  const Gallery gallery;
  const auto clip = motion::make_walker({.seconds = 12.0, .rate_hz = 60.0}).value();
  REQUIRE(clip::write_bvh(clip, gallery.folder.path() / "long.bvh"));
  const auto leg = motion::leg_signal(motion::motion_of(clip).value());
  const auto walk = style::walk_phases(*leg, 60.0);
  REQUIRE(walk);
  constexpr double kTurn = 2.0 * std::numbers::pi;
  const double strides = (walk->phase[walk->phase.size() - 1] - walk->phase[0]) / kTurn;
  const int count = static_cast<int>(std::lround(strides)) + 1;  // a stride from each to the next
  REQUIRE(count > 6);
  REQUIRE(gallery.render("long.bvh", "long.svg", {"--count", std::to_string(count)}).code == 0);
  const std::string svg = file_text(gallery.path("long.svg"));
  std::vector<double> phases;
  for (auto at = svg.find(" s</text>"); at != std::string::npos;
       at = svg.find(" s</text>", at + 1)) {
    const auto frame = std::lround(60.0 * std::stod(svg.substr(svg.rfind('>', at) + 1, at)));
    const auto found = std::ranges::find(walk->frames, frame);
    if (found != walk->frames.end()) {
      const double phase = walk->phase[found - walk->frames.begin()];
      phases.push_back(phase - kTurn * std::floor(phase / kTurn));
    }
  }
  REQUIRE(std::ssize(phases) >= count - 2);
  std::ranges::sort(phases);
  phases.push_back(phases.front() + kTurn);
  for (std::size_t i = 1; i < phases.size(); ++i) CHECK(phases[i] - phases[i - 1] < kTurn / 3.0);
}

TEST_CASE("render draws a hand from a BVH as from a CSV") {
  const Gallery gallery;
  clip::HandClip hand;
  hand.angles.assign(2, HandAngles{});
  hand.time_s = {0.0, 1.0 / 30.0};
  REQUIRE(clip::write_hand_csv(hand, gallery.path("hand.csv")));
  REQUIRE(clip::write_bvh(clip::clip_of_hand(hand, "adult").value(), gallery.path("hand.bvh")));
  for (const char* name : {"hand.csv", "hand.bvh"}) {
    REQUIRE(gallery.render(name, std::string(name) + ".svg", {"--frame", "0"}).code == 0);
    CHECK(has(file_text(gallery.path(std::string(name) + ".svg")), "thumb dark orange"));
  }
}

TEST_CASE("render draws a log's motion beside the unstyled one, published or not") {
  Gallery gallery;
  std::string config = Stage::kEndpoints;
  for (const std::string raw : {"true", "false"}) {
    config += "[[stream]]\nname = \"raw_" + raw + "\"\npublish_raw = " + raw +
              "\ndriver = \"file\"\n[stream.file]\npath = \"walk.bvh\"\nloop = false\npace = 0.0\n";
  }
  gallery.folder.write("posed.toml", config);
  gallery.record();
  for (int i = 0; i < 50 && !has(gallery.ctl({"status"}).out, "ended"); ++i) {
    std::this_thread::sleep_for(50ms);
  }
  gallery.daemon->send(SIGTERM);
  REQUIRE(gallery.daemon->exit_code() == 0);
  for (const std::string stream : {"raw_true", "raw_false"}) {
    const ProgramOutcome both =
        gallery.render("take.plog", stream + ".svg", {"--stream", stream, "--raw-beside"});
    INFO(both.err);
    REQUIRE(both.code == 0);
    const std::string svg = file_text(gallery.path(stream + ".svg"));
    CHECK(has(svg, "as it came in"));
    CHECK(has(svg, "as posed published it"));
  }
}

}  // namespace posed::test
