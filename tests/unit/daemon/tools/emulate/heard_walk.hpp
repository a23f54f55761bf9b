// A recorded walk that goes out of a mocap system's emulator and in through its driver.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <catch2/catch.hpp>

#include "daemon/tools/emulate/motions.hpp"
#include "drivers/driver.hpp"
#include "models/motion/interpolate.hpp"
#include "proto/clip/clip.hpp"
#include "tests/unit/drivers/collect_sink.hpp"

namespace posed::test {

// The clip's pose at a time, between its frames.
inline Frame pose_at(const clip::Clip& clip, std::int64_t at_ns) {
  const double at = seconds(at_ns) * clip.frame_rate_hz;
  const int index = static_cast<int>(at);
  Frame pose = clip.frame(index);
  motion::interpolate(*clip.skeleton, clip.frame(index), clip.frame(index + 1), at - index, pose);
  return pose;
}

struct ReceivedPose {
  std::string body;
  std::shared_ptr<const Skeleton> skeleton;
  Frame frame;
  // When the emulator was posed last, and before that: a driver may learn only from the next frame
  // that one was complete.
  std::int64_t posed_ns = 0, posed_before_ns = 0;
};

// What a host sees of an emulated system.
class EmulatedHost {
 public:
  explicit EmulatedHost(const drivers::Driver& driver)
      : driver_(driver), decoder_(driver.make_decoder(driver.expect({}).value()).value()) {}

  void receive(std::uint8_t socket, const std::vector<std::byte>& bytes, std::int64_t now_ns) {
    const int before = sink.descriptions;
    decoder_->feed_socket(socket, bytes, now_ns, sink);
    if (sink.descriptions == before) return;
    auto layout = driver_.make_layout(sink.described);
    if (!layout) FAIL(layout.error().text());
    layouts_.push_back(std::move(*layout));
    decoder_->use(*layouts_.back());
  }
  [[nodiscard]] const drivers::Body& body(std::size_t i) const {
    return layouts_.back()->bodies[i];
  }

  CollectSink sink;

 private:
  const drivers::Driver& driver_;
  std::unique_ptr<drivers::Decoder> decoder_;
  std::vector<std::unique_ptr<const drivers::SourceLayout>> layouts_;
};

// The frames of all bodies during this time; nothing may be damaged or out of order.
inline std::vector<ReceivedPose> receive_walk(const drivers::Driver& driver,
                                              const std::vector<std::filesystem::path>& clips,
                                              std::int64_t length_ns) {
  const auto emulator = driver.emulate({}).value();
  const emulate::Motion motion = emulate::clip_motion(clips, *emulator).value();
  EmulatedHost host(driver);
  std::vector<ReceivedPose> all;
  std::int64_t posed_ns = 0, posed_before_ns = 0;
  while (posed_ns < length_ns) {
    const std::int64_t due_ns = emulator->next_due_ns();
    REQUIRE(due_ns != kNoTime_ns);
    if (due_ns > posed_ns) posed_before_ns = std::exchange(posed_ns, due_ns);
    motion(seconds(due_ns), *emulator);
    std::vector<std::byte> bytes;
    const std::uint8_t socket = emulator->next_socket();
    emulator->emit(due_ns, bytes);
    host.receive(socket, bytes, due_ns);
    for (std::size_t i = 0; i < host.sink.frames.size(); ++i) {
      const drivers::Body& body = host.body(host.sink.bodies[i]);
      all.push_back({body.name, body.skeleton, host.sink.frames[i], posed_ns, posed_before_ns});
    }
    for (const Outcome wrong : {Outcome::kShort, Outcome::kBadChecksum, Outcome::kOutOfRange,
                                Outcome::kLate, Outcome::kDuplicate}) {
      CHECK(host.sink.count(wrong) == 0);  // foreign is a frame before its layout
    }
    host.sink.clear();
  }
  return all;
}

}  // namespace posed::test
