// NatNetScene: people and props as Motive streams them: bones relative to their parents, Y up, and
// the description of the bodies.
#pragma once

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "daemon/output/fit.hpp"
#include "daemon/output/inbox.hpp"
#include "drivers/natnet/encode.hpp"
#include "proto/frame/frame.hpp"
#include "proto/frame/result.hpp"

namespace posed::output {

// One thread.
class NatNetScene {
 public:
  // The server's clock, at the zero of monotonic time, shows 0 ticks.
  static constexpr std::uint64_t kClock_hz = 10'000'000;
  [[nodiscard]] static std::uint64_t ticks_at(std::int64_t time_ns) noexcept;

  explicit NatNetScene(std::size_t places) : bodies_(places), names_(places) {}

  // The stream of a place comes, or has another skeleton; null: has left. A skeleton that Motive
  // could have, or a prop, goes out as it is; anybody else as Motive's figure. Cold.
  Result<> set_stream(std::size_t place, const LiveStream* stream);
  // Returns false, and does nothing, for an empty place.
  [[nodiscard]] bool take(std::size_t place, const Frame& frame);

  [[nodiscard]] const drivers::natnet::ModelDef& model() const noexcept { return model_; }
  [[nodiscard]] double rate_hz() const noexcept { return rate_hz_; }
  // Makes the next frame of the poses that have been taken, valid until the next call.
  [[nodiscard]] const drivers::natnet::FramePacket& next_frame(std::int64_t now_ns);

 private:
  struct Body {
    Body(Fit fitted, bool is_own) : fit(std::move(fitted)), own(is_own) {}
    Fit fit;
    bool own;
    double rate_hz = 0.0;
    drivers::natnet::BodyDef described{};
    drivers::natnet::SkeletonPacket packet{};  // of a prop its one bone
    bool posed = false;
  };
  void describe();

  std::vector<std::optional<Body>> bodies_;  // [place]
  std::vector<std::string> names_;           // the same
  drivers::natnet::ModelDef model_;
  drivers::natnet::FramePacket packet_{.invented = false};
  double rate_hz_ = 0.0;
  bool changed_ = false;                              // the bodies, since the last frame
  std::int64_t time_ns_ = 0, begin_ns_ = kNoTime_ns;  // of the newest pose, of the first
  Timecode timecode_{};
};

}  // namespace posed::output
