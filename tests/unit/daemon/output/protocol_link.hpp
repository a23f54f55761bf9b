// What the tests of outputs that speak a device's protocol share: the protocol's emulator, and a
// reader that decodes as a second posed does.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <catch2/catch.hpp>

#include "daemon/output/udp_receivers.hpp"
#include "drivers/driver.hpp"
#include "proto/frame/rotation.hpp"
#include "tests/support/processor_time.hpp"
#include "tests/unit/daemon/output/output_rig.hpp"
#include "tests/unit/drivers/collect_sink.hpp"

namespace posed::output {

// Uses each description at once, as the daemon does a little later.
class ProtocolReader {
 public:
  explicit ProtocolReader(const std::string& driver, const drivers::Options& options = {})
      : driver_(*drivers::find_driver(driver)),
        decoder_(driver_.make_decoder(driver_.expect(options).value()).value()) {}

  void feed(std::span<const std::byte> datagram, std::int64_t now_ns) {
    const int before = sink_.descriptions;
    sink_.clear();
    decoder_->feed(datagram, now_ns, sink_);
    for (std::size_t i = 0; i < sink_.frames.size(); ++i) {
      newest[bodies()[sink_.bodies[i]].name] = sink_.frames[i];
      ++frames;
    }
    for (const Outcome outcome : {Outcome::kShort, Outcome::kBadChecksum, Outcome::kOutOfRange,
                                  Outcome::kLate, Outcome::kDuplicate}) {
      if (sink_.count(outcome) == 0) continue;
      damage += std::string(kOutcomeNames[static_cast<std::size_t>(outcome)]) + " at frame " +
                std::to_string(frames) + ", ";
    }
    if (sink_.descriptions == before) return;
    auto layout = driver_.make_layout(sink_.described);
    if (!layout) FAIL(layout.error().text());
    layouts_.push_back(std::move(*layout));
    decoder_->use(*layouts_.back());
    newest.clear();
  }
  [[nodiscard]] drivers::Decoder& decoder() { return *decoder_; }
  [[nodiscard]] const std::vector<drivers::Body>& bodies() const {
    static const std::vector<drivers::Body> kNone;
    return layouts_.empty() ? kNone : layouts_.back()->bodies;
  }
  // Null while nobody of this name is described.
  [[nodiscard]] const drivers::Body* body(const std::string& name) const {
    const auto at = std::ranges::find(bodies(), name, &drivers::Body::name);
    return at == bodies().end() ? nullptr : &*at;
  }
  [[nodiscard]] std::shared_ptr<const Skeleton> skeleton(const std::string& name) const {
    return body(name) == nullptr ? nullptr : body(name)->skeleton;
  }

  std::map<std::string, Frame> newest;  // [body] since the last description
  int frames = 0;
  std::string damage;  // what was wrong with datagrams

 private:
  const drivers::Driver& driver_;
  std::unique_ptr<drivers::Decoder> decoder_;
  std::vector<std::unique_ptr<const drivers::SourceLayout>> layouts_;
  test::CollectSink sink_{64};
};

// How far two poses of one skeleton are apart at most.
struct Apart {
  double rad = 0.0, m = 0.0;
  int timecodes = 0;  // that differ
};

inline void compare(const Skeleton& skeleton, const Frame& a, const Frame& b, Apart& worst) {
  if (a.timecode != b.timecode) ++worst.timecodes;
  for (std::size_t j = 0; j < skeleton.joints.size(); ++j) {
    worst.rad = std::max(worst.rad, angle_between_rad(to_eigen_double(a.rotation_xyzw[j]),
                                                      to_eigen_double(b.rotation_xyzw[j])));
  }
  for (std::size_t k = 0; k < 3; ++k) {
    worst.m = std::max(worst.m, std::abs(static_cast<double>(a.root_position_m[k]) -
                                         static_cast<double>(b.root_position_m[k])));
  }
}

// Sixteen people of a system: one person's poses, each a little later than the last one's.
inline constexpr int kCrowd = 16;
class Crowd {
 public:
  // From two seconds of the protocol's emulator.
  Crowd(const std::string& driver, const drivers::Options& options) {
    const auto emulator = drivers::find_driver(driver)->emulate(options).value();
    ProtocolReader first(driver);
    while (emulator->next_due_ns() < 2 * kNanosPerSecond) {
      const std::int64_t now_ns = emulator->next_due_ns();
      std::vector<std::byte> bytes;
      emulator->emit(now_ns, bytes);
      first.feed(bytes, now_ns);
      if (first.bodies().empty()) continue;
      const std::string& name = first.bodies()[0].name;
      if (first.skeleton(name) != skeleton) poses_.clear();
      skeleton = first.skeleton(name);
      if (first.newest.contains(name)) poses_.push_back(first.newest[name]);
      first.newest.clear();
    }
    REQUIRE(poses_.size() > 30);
  }
  [[nodiscard]] Frame pose(int person, int step) const {
    Frame pose = frame_of(static_cast<std::uint32_t>(person),
                          poses_[static_cast<std::size_t>(step + 7 * person) % poses_.size()]);
    pose.header.sequence = static_cast<std::uint64_t>(step) + 1;
    return pose;
  }
  // The skeleton of a person of this name.
  [[nodiscard]] std::shared_ptr<const Skeleton> named(const std::string& name) const {
    auto copy = std::make_shared<Skeleton>(*skeleton);
    copy->name = name;
    REQUIRE(copy->finish());
    return copy;
  }
  [[nodiscard]] static std::vector<std::string> names(int people = kCrowd) {
    std::vector<std::string> all;
    for (int i = 0; i < people; ++i) all.push_back("p" + std::to_string(i));
    return all;
  }

  std::shared_ptr<const Skeleton> skeleton;

 private:
  std::vector<Frame> poses_;
};

// What the figures print: frames that did not arrive, how far the others are off, and how long the
// output's own thread works for the pose of one person, beside what the kernel takes for the same
// datagrams.
struct CrowdCheck {
  Apart worst;
  int sent = 0, arrived = 0;
  std::vector<double> us{}, kernel_us{};
  UdpReceiver beside{};
  UdpReceivers to_beside = UdpReceivers::open({beside.endpoint()}).value();

  void show(const std::string& what) {
    std::ranges::sort(us);
    std::ranges::sort(kernel_us);
    std::printf(
        "%-24s %5d poses, %d lost, %.1g rad, %.1g m, p50 %.1f us, p99 %.1f us a pose, of which "
        "sending alone %.1f, %.1f\n",
        what.c_str(), sent, sent - arrived, worst.rad, worst.m, us[us.size() / 2],
        us[us.size() * 99 / 100], kernel_us[kernel_us.size() / 2],
        kernel_us[kernel_us.size() * 99 / 100]);
    CHECK(sent == arrived);
    CHECK(worst.rad < 1e-5);
    CHECK(worst.m < 1e-5);
  }
  // Hands over one step's poses, and counts the thread's own time.
  void pass(const OutputRig& rig, const Crowd& crowd, int people, int step, std::int64_t now_ns) {
    std::vector<Frame> poses;
    for (int i = 0; i < people; ++i) {
      poses.push_back(crowd.pose(i, step));
      poses.back().header.arrival_ns = now_ns;
    }
    for (const Frame& pose : poses) rig.output->frame(pose);  // the publisher's thread does so
    const double before_us = test::processor_time_us();
    static_cast<void>(rig.output->turn(now_ns));
    us.push_back((test::processor_time_us() - before_us) / people);
  }
  // Sends one step's datagrams once more, and counts the thread's time.
  void send_alone(const std::vector<std::vector<std::byte>>& datagrams, int people) {
    Datagrams all;
    for (const auto& datagram : datagrams) all.add(datagram);
    const double us_of_all = test::timed_us([&] { static_cast<void>(to_beside.send(all, 0)); });
    kernel_us.push_back(us_of_all / people);
    static_cast<void>(beside.received());
  }
  void compare_with(const Crowd& crowd, ProtocolReader& reader, int people, int step,
                    const std::vector<std::string>& names) {
    for (int i = 0; i < people; ++i) {
      ++sent;
      const auto& name = names[static_cast<std::size_t>(i)];
      if (!reader.newest.contains(name)) continue;
      ++arrived;
      compare(*crowd.skeleton, crowd.pose(i, step), reader.newest[name], worst);
    }
    reader.newest.clear();
  }
};

// Returns whether both have the same joints; `worst.m` grows to how far their bones differ.
inline bool same_figure(const Skeleton& a, const Skeleton& b, Apart& worst) {
  if (a.joints.size() != b.joints.size()) return false;
  for (std::size_t j = 0; j < a.joints.size(); ++j) {
    const Joint &first = a.joints[j], &second = b.joints[j];
    if (first.name != second.name || first.parent != second.parent || first.bone != second.bone) {
      return false;
    }
    if (j > 0) worst.m = std::max(worst.m, (first.offset_m - second.offset_m).norm());
  }
  return true;
}

}  // namespace posed::output
