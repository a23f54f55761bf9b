// A clip played once through the real binary: live output equals what `posed apply --cold` writes,
// the end and the silences of a source are reported to clients, and bad input gives one error
// message and an exit code.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>

#include "daemon/record/decision_code.hpp"
#include "posed/v1/posed.pb.h"
#include "proto/log/reader.hpp"
#include "proto/zmq/zmq_handle.hpp"
#include "tests/e2e/outcome.hpp"
#include "tests/e2e/served.hpp"

namespace posed::test {
namespace {

using std::chrono::steady_clock;

constexpr int kClipFrames = 240;
constexpr double kSame_rad = 1e-5;  // nine digits of a degree, and floats on the way

// A config of one stream. `stream` and `file` are lines of its tables.
std::string config_of(const std::string& stream, const std::string& file,
                      const std::string& model = "one.style",
                      const std::string& publish = "tcp://127.0.0.1:*") {
  return "realtime = false\n[publish]\nendpoint = \"" + publish +
         "\"\n[control]\nendpoint = \"tcp://127.0.0.1:*\"\n[[stream]]\nname = \"walker\"\n"
         "driver = \"file\"\n" +
         stream + "\n[stream.file]\n" + file + "\n[stream.style]\nmodel = \"" + model + "\"\n";
}

// Receives the daemon's events about its stream like any client.
class Listener {
 public:
  explicit Listener(const std::string& endpoint) {
    REQUIRE(net::set_option(socket_.get(), ZMQ_RCVHWM, 0));
    REQUIRE(net::set_option(socket_.get(), ZMQ_SUBSCRIBE, "event/walker"));
    REQUIRE(net::set_option(socket_.get(), ZMQ_SUBSCRIBE, "pose/walker"));
    REQUIRE(net::connect_socket(socket_.get(), endpoint));
  }

  // Listens until `wanted` has arrived `times` times.
  void until(v1::Event::Kind wanted, int times) {
    const auto end = steady_clock::now() + std::chrono::seconds(30);
    while (count(wanted) < times && steady_clock::now() < end) {
      zmq_pollitem_t wait{socket_.get(), 0, ZMQ_POLLIN, 0};
      if (zmq_poll(&wait, 1, 100) > 0) take();
    }
    CHECK(count(wanted) >= times);
  }

  [[nodiscard]] int count(v1::Event::Kind kind) const {
    return static_cast<int>(
        std::ranges::count_if(events, [kind](const auto& event) { return event.kind() == kind; }));
  }

  std::vector<v1::Event> events;
  std::vector<v1::Frame> frames;

 private:
  void take() {
    net::Message topic, body;
    if (!topic.receive(socket_.get()) || !body.receive(socket_.get(), 0)) return;
    const auto bytes = body.bytes();
    const auto size = static_cast<int>(bytes.size());
    if (topic.text() == "event/walker") {
      REQUIRE(events.emplace_back().ParseFromArray(bytes.data(), size));
    } else {
      REQUIRE(frames.emplace_back().ParseFromArray(bytes.data(), size));
    }
  }

  net::Context context_ = *net::open_context();
  net::Socket socket_ = *net::open_socket(context_.get(), ZMQ_SUB);
};

// The largest angle between a joint as it was published and as a file has it in the same frame.
double distance_rad(const v1::Frame& live, const clip::Clip& offline) {
  const Frame frame = offline.frame(static_cast<int>(live.sequence()) - 1);
  REQUIRE(live.rotation_xyzw_size() == 4 * frame.joint_count);
  double largest = 0.0;
  for (int j = 0; j < frame.joint_count; ++j) {
    const Eigen::Quaterniond rotation(live.rotation_xyzw(4 * j + 3), live.rotation_xyzw(4 * j),
                                      live.rotation_xyzw(4 * j + 1), live.rotation_xyzw(4 * j + 2));
    const auto expected = to_eigen_double(frame.rotation_xyzw[static_cast<std::size_t>(j)]);
    const double angle_rad = rotation.normalized().angularDistance(expected.normalized());
    REQUIRE(std::isfinite(angle_rad));
    largest = std::max(largest, angle_rad);
  }
  return largest;
}

double largest_distance_rad(const std::vector<v1::Frame>& live, const clip::Clip& offline) {
  double largest = 0.0;
  for (const v1::Frame& frame : live) largest = std::max(largest, distance_rad(frame, offline));
  return largest;
}

// The styled frames of a log, as they were published.
std::vector<v1::Frame> published(const log::Reader& reader) {
  auto rows = reader.frames(0, false);
  REQUIRE(rows);
  std::vector<v1::Frame> frames;
  for (auto row = rows->next(); row && *row; row = rows->next()) {
    const auto bytes = (*row)->bytes;
    REQUIRE(frames.emplace_back().ParseFromArray(bytes.data(), static_cast<int>(bytes.size())));
    CHECK(frames.back().sequence() == (*row)->sequence);
  }
  return frames;
}

// An overloaded machine sheds (skips) frames; from there on the live filter has had a different
// input.
std::uint64_t first_shed(const log::Reader& reader) {
  const auto decisions = reader.decisions();
  REQUIRE(decisions);
  for (const auto& row : *decisions) {
    const auto decision = record::decision_of(row, reader.file());
    REQUIRE(decision);
    if (decision->kind == pipeline::Decision::Kind::kShed) return decision->sequence;
  }
  return kClipFrames + 1;
}

clip::Clip applied_cold(const Served& served) {
  const ProgramOutcome apply =
      posed({"apply", "--cold", "--root", "off", "--model", served.path("one.style"),
             served.path("walk.bvh"), "--out", served.path("offline.bvh")});
  INFO(apply.err);
  REQUIRE(apply.code == 0);
  auto offline = clip::read_clip(served.path("offline.bvh"));
  REQUIRE(offline);
  REQUIRE(offline->frames() == kClipFrames);
  return std::move(*offline);
}

// The same body with other names for its limbs.
clip::Clip renamed_walk() {
  clip::Clip walk = toy_walk(kClipFrames, 120.0);
  Skeleton skeleton = toy_skeleton();
  skeleton.joints[3].name = "Wheel";
  skeleton.joints[4].name = "Wing";
  skeleton.finish().value();
  walk.skeleton = std::make_shared<const Skeleton>(skeleton);
  return walk;
}

void write_bad_files(const Served& served) {
  std::ifstream whole(served.path("walk.bvh"));
  std::string text{std::istreambuf_iterator<char>(whole), {}};
  served.folder.write("short.bvh", text.substr(0, text.size() / 2));
  served.folder.write("foreign.style", "a song, not a model");
  served.folder.write("take.plog", "somebody's");
  REQUIRE(clip::write_bvh(renamed_walk(), served.folder.path() / "renamed.bvh"));
}

// The text on stderr without log lines, which begin with their time (a warning about the clip's
// unit).
std::string without_log(const std::string& errors) {
  std::istringstream lines(errors);
  std::string said;
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with("[")) said += line + "\n";
  }
  return said;
}

}  // namespace

TEST_CASE("live is offline: a clip played once equals what apply --cold writes") {
  Served served;
  const clip::Clip offline = applied_cold(served);
  const auto input = clip::read_clip(served.path("walk.bvh"));
  REQUIRE(input);
  for (const char* pace : {"0.0", "1.0"}) {  // as fast as possible, and by the clip's own clock
    INFO("pace " << pace);
    const std::string file = std::string("path = \"walk.bvh\"\nloop = false\npace = ") + pace;
    served.folder.write("once.toml", config_of("", file));
    const ProgramOutcome record =
        posed({"record", "--config", served.path("once.toml"), "--out", served.path("take.plog"),
               "--frames", "--force", "--until-end"});
    INFO(record.err);
    REQUIRE(record.code == 0);
    const auto reader = log::Reader::open(served.path("take.plog"));
    REQUIRE(reader);
    const std::uint64_t end = first_shed(*reader);
    if (*pace == '0') CHECK(end == kClipFrames + 1);  // a lossless source is never shed
    std::vector<v1::Frame> live = published(*reader);
    std::erase_if(live, [end](const v1::Frame& frame) { return frame.sequence() >= end; });
    // A recorder that gets no time while an unpaced clip runs leaves frames to the replay, and says
    // how many.
    const std::size_t missing = end - 1 - live.size();
    if (missing > 0) {
      CHECK(record.err.contains("lacks " + std::to_string(missing) + " published frames"));
    }
    REQUIRE_FALSE(live.empty());
    for (std::size_t i = 1; i < live.size(); ++i)
      CHECK(live[i].sequence() > live[i - 1].sequence());
    WARN("pace " << pace << ": " << live.size() << " frames, at most "
                 << largest_distance_rad(live, offline) << " rad from apply --cold");
    CHECK(largest_distance_rad(live, offline) <= kSame_rad);
    if (end > kClipFrames / 2)
      CHECK(largest_distance_rad(live, *input) > 0.1);  // the style had an effect
  }
}

TEST_CASE("a log that was recorded with a style is styled anew as its device sent it") {
  Served served;
  const clip::Clip offline = applied_cold(served);
  served.folder.write("once.toml", config_of("", "path = \"walk.bvh\"\nloop = false\npace = 0.0"));
  const std::string log = served.path("take.plog");
  REQUIRE(
      posed({"record", "--config", served.path("once.toml"), "--out", log, "--until-end"}).code ==
      0);
  const auto largest_rad = [&](const std::vector<std::string>& command,
                               const clip::Clip& expected) {
    std::vector<std::string> words = command;
    words.insert(words.end(), {"--overwrite", "--out", served.path("out.bvh")});
    const ProgramOutcome made = posed(words);
    INFO(made.err);
    REQUIRE(made.code == 0);
    if (command[0] == "apply") CHECK(has(made.err, "as they came in"));
    const auto clip = clip::read_clip(served.path("out.bvh"));
    REQUIRE(clip);
    REQUIRE(clip->frames() == expected.frames());
    double largest = 0.0;
    for (int i = 0; i < clip->frames(); ++i) {
      const Frame made_frame = clip->frame(i), frame = expected.frame(i);
      for (std::size_t j = 0; j < frame.joint_count; ++j) {
        largest = std::max(largest, angle_between_rad(to_eigen_double(made_frame.rotation_xyzw[j]),
                                                      to_eigen_double(frame.rotation_xyzw[j])));
      }
    }
    return largest;
  };
  const auto input = clip::read_clip(served.path("walk.bvh"));
  REQUIRE(input);
  const std::vector<std::string> apply{
      "apply", "--cold", "--root", "off", "--model", served.path("one.style"), log};
  CHECK(largest_rad(apply, offline) <= 10.0 * kSame_rad);  // a frame has its angles as floats
  CHECK(largest_rad({"convert", log, "--stream", "walker-raw"}, *input) <= kSame_rad);
  CHECK(largest_rad({"convert", log}, *input) > 0.1);
  std::vector<std::string> refused = apply;
  refused.insert(refused.end(), {"--stream", "waver", "--out", served.path("no.bvh")});
  CHECK(has(posed(refused).err, "has no stream 'waver' with a skeleton, but walker"));
}

TEST_CASE("run --until-end ends with 0, and a client receives the last frame and the end") {
  Served served;
  const clip::Clip offline = applied_cold(served);
  served.folder.write("posed.toml", config_of("", "path = \"walk.bvh\"\nloop = false"));
  served.start({"--until-end"});
  Listener listener(served.publish);
  listener.until(v1::Event::KIND_ENDED, 1);
  CHECK(served.daemon->exit_code() == 0);
  CHECK(has(served.daemon->errors(), "ended"));
  CHECK(listener.count(v1::Event::KIND_ENDED) == 1);
  REQUIRE(!listener.events.empty());
  CHECK(listener.events.back().sequence() == kClipFrames);
  REQUIRE(!listener.frames.empty());
  CHECK(listener.frames.back().sequence() == kClipFrames);
  // Frames that an overloaded machine sheds are reported; without them live and offline had the
  // same input.
  if (listener.count(v1::Event::KIND_SHED) == 0) {
    CHECK(largest_distance_rad(listener.frames, offline) <= kSame_rad);
  }
}

TEST_CASE("a source that falls silent turns stale, holds its pose and recovers") {
  Served served;
  // 120 frames per second at 1/48 of the speed: 0.4 s of silence after each frame.
  served.folder.write("posed.toml", config_of("stale_after_s = 0.1\npublish_raw = false",
                                              "path = \"walk.bvh\"\npace = 0.0208333"));
  served.start();
  Listener listener(served.publish);
  listener.until(v1::Event::KIND_RECOVERED, 3);
  served.daemon->send(SIGTERM);
  CHECK(served.daemon->exit_code() == 0);

  // Events of silence and recovery alternate, each at its frame.
  const v1::Event* before = nullptr;
  for (const v1::Event& event : listener.events) {
    if (event.kind() == v1::Event::KIND_STARTED) continue;
    if (before != nullptr) {
      CHECK(event.kind() != before->kind());
      const bool recovered = event.kind() == v1::Event::KIND_RECOVERED;
      CHECK(event.sequence() == before->sequence() + (recovered ? 1 : 0));
      CHECK(event.time_ns() > before->time_ns());
    }
    before = &event;
  }
  std::map<std::uint64_t, v1::Frame> measured;
  int held = 0;
  for (const v1::Frame& frame : listener.frames) {
    if (frame.quality() == v1::QUALITY_MEASURED) measured[frame.sequence()] = frame;
    if (frame.quality() != v1::QUALITY_STALE) continue;
    const auto same = measured.find(frame.sequence());
    if (same == measured.end()) continue;  // measured before the client subscribed
    ++held;
    for (int i = 0; i < frame.rotation_xyzw_size(); ++i) {
      CHECK(frame.rotation_xyzw(i) == same->second.rotation_xyzw(i));
    }
  }
  CHECK(held >= 2);
}

TEST_CASE("bad input gives one error message that states what to do, and a matching exit code") {
  Served served;
  write_bad_files(served);
  served.start();
  struct Row {
    std::string config;
    int code;
    std::vector<std::string> says;
  };
  const std::string walk = "path = \"walk.bvh\"";
  const std::vector<Row> rows{
      {config_of("", walk, "one.style", served.publish), 1, {served.publish, "is in use"}},
      {config_of("", "path = \"none.bvh\""), 1, {"none.bvh: ", "walker"}},
      {config_of("", "path = \"short.bvh\""), 1, {"short.bvh:", "walker"}},
      {config_of("", walk, "none.style"), 1, {"none.style: ", "cannot read"}},
      {config_of("", walk, "foreign.style"), 1, {"foreign.style: ", "walker"}},
      {config_of("", "path = \"renamed.bvh\""), 1, {"no joint LeftLeg, RightLeg", "train with"}},
      {config_of("stale_after = 1.0", walk), 2, {"bad.toml:9: ", "stale_after_s"}},
      {config_of("", walk), 2, {"take.plog: exists already"}},
  };
  for (const Row& row : rows) {
    served.folder.write("bad.toml", row.config);
    const ProgramOutcome outcome =
        posed({"record", "--config", served.path("bad.toml"), "--out",
               served.path(&row == &rows.back() ? "take.plog" : "new.plog"), "--seconds", "1"});
    INFO(row.config << outcome.err);
    CHECK(outcome.code == row.code);
    CHECK(outcome.out.empty());
    const std::string said = without_log(outcome.err);
    CHECK(std::ranges::count(said, '\n') == 1);
    CHECK(said.starts_with("posed: "));
    for (const std::string& part : row.says) CHECK(said.find(part) != std::string::npos);
    CHECK(!std::filesystem::exists(served.path("new.plog")));
  }
}

}  // namespace posed::test
