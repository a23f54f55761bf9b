// Output: the base of all outputs. It has an inbox with the frames of the wanted streams, passes
// them on at the rate that the config allows, counts, and has a way to report problems to users.
// assembly runs each output on a thread of its own.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/config/daemon_config.hpp"
#include "daemon/output/inbox.hpp"
#include "daemon/output/send_outcome.hpp"
#include "daemon/publish/frame_output.hpp"
#include "daemon/system/event_fd.hpp"
#include "proto/frame/result.hpp"
#include "proto/frame/time.hpp"

namespace posed::output {

// Tells people something: beside a stream that it concerns, if one is there.
using Notify = std::function<void(std::optional<std::uint32_t> stream, const News& news)>;

// Decides when the poses of several streams go out as one. Those of one source come one right after
// the other: they wait for each other, but not for a stream that is silent, and no longer than a
// moment. One thread.
class Gathering {
 public:
  static constexpr std::int64_t kMoment_ns = 2'000'000;

  explicit Gathering(std::size_t streams) : streams_(streams) {}

  void leaves(std::size_t stream) noexcept { streams_[stream] = {}; }

  // A pose has come. Returns whether all that are due have: then the next ones are gathered.
  [[nodiscard]] bool comes(std::size_t stream, std::int64_t now_ns) noexcept {
    if (is_late(now_ns)) sent();  // what has waited for too long goes with the next
    const bool again = streams_[stream].waits;
    streams_[stream] = {.waits = true, .came_ns = now_ns};
    if (due_ns_ == kNoTime_ns) due_ns_ = now_ns + kMoment_ns;
    if (!again && missing(now_ns)) return false;
    sent();
    return true;
  }

  // When what has come is to be sent without the rest; kNoTime_ns: nothing waits.
  [[nodiscard]] std::int64_t due_ns() const noexcept { return due_ns_; }
  [[nodiscard]] bool is_late(std::int64_t now_ns) const noexcept {
    return due_ns_ != kNoTime_ns && now_ns >= due_ns_;
  }
  void sent() noexcept {
    due_ns_ = kNoTime_ns;
    for (Stream& stream : streams_) stream.waits = false;
  }

 private:
  static constexpr std::int64_t kSilent_ns = kNanosPerSecond / 4;
  struct Stream {
    bool waits = false;
    std::int64_t came_ns = kNoTime_ns;
  };
  [[nodiscard]] bool missing(std::int64_t now_ns) const noexcept {
    for (const Stream& stream : streams_) {
      const bool live = stream.came_ns != kNoTime_ns && now_ns - stream.came_ns < kSilent_ns;
      if (live && !stream.waits) return true;
    }
    return false;
  }

  std::vector<Stream> streams_;
  std::int64_t due_ns_ = kNoTime_ns;
};

// Admits at most a given number of frames a second, evenly. A frame that comes a quarter of a
// period early is still admitted, so that a stream of exactly that rate loses none to jitter. Of
// frames that come together at most one is admitted; offer the newest.
class RateLimit {
 public:
  // With `rate_hz` 0 there is no limit.
  explicit RateLimit(double rate_hz) noexcept
      : period_ns_(rate_hz > 0.0 ? nanoseconds(1.0 / rate_hz) : 0) {}

  [[nodiscard]] bool limits() const noexcept { return period_ns_ > 0; }

  [[nodiscard]] bool admit(std::int64_t now_ns) noexcept {
    if (due_ns_ != kNoTime_ns && now_ns < due_ns_ - period_ns_ / 4) return false;
    // After a pause it begins anew, instead of making up for it.
    const bool goes_on = due_ns_ != kNoTime_ns && now_ns < due_ns_ + period_ns_;
    due_ns_ = (goes_on ? due_ns_ : now_ns) + period_ns_;
    return true;
  }

 private:
  std::int64_t period_ns_;
  std::int64_t due_ns_ = kNoTime_ns;  // when the next frame is due
};

class Output : public publish::FrameOutput {
 public:
  // `together`: the poses of all streams go out as one.
  Output(const config::OutputConfig& config, std::unique_ptr<system::EventFd> wake,
         bool together = false);

  [[nodiscard]] const std::string& name() const noexcept { return name_; }
  // Call it before the first turn.
  void set_notify(Notify notify) { notify_ = std::move(notify); }

  // The output's thread calls it. It does everything that is due at `now_ns` and never waits.
  // Returns the latest time of the next call; call it earlier if wake() is notified.
  [[nodiscard]] std::int64_t turn(std::int64_t now_ns);
  [[nodiscard]] system::EventFd& wake() noexcept { return *wake_; }
  // A descriptor that is readable when turn() should be called, too; -1: there is none.
  [[nodiscard]] virtual int poll_fd() const noexcept { return -1; }

  // publish::FrameOutput
  [[nodiscard]] bool wants(std::string_view stream) const noexcept override {
    return inbox_.wants(stream);
  }
  void stream_comes(const publish::StreamInfo& stream) override { inbox_.stream_comes(stream); }
  void frame(const Frame& frame) noexcept override { inbox_.frame(frame); }
  void sample(const Sample& sample) noexcept override { inbox_.sample(sample); }
  void stream_leaves(std::uint32_t stream) noexcept override { inbox_.stream_leaves(stream); }
  void fill(v1::OutputStats& stats) const override;

 protected:
  // What an output does in a turn, in this order. The stream of a place has come, or has another
  // skeleton; null: it has left. An error goes on "stream 'ann' ..." and is told to users.
  [[nodiscard]] virtual Result<> set_stream(std::size_t place, const LiveStream* stream) = 0;
  virtual void begin_turn(std::int64_t /*now_ns*/) {}
  // Takes a frame of a stream that has come. Returns whether it makes the output send.
  [[nodiscard]] virtual bool take(std::size_t place, const Frame& frame, std::int64_t now_ns) = 0;
  // Sends what has been taken.
  virtual void send(std::int64_t now_ns) = 0;
  // Returns when the next turn is due, if nothing comes before.
  [[nodiscard]] virtual std::int64_t end_turn(std::int64_t /*now_ns*/) {
    return system::kForever_ns;
  }

  // The newest sample of a stream that has come in this turn.
  [[nodiscard]] const std::optional<Sample>& sample(std::size_t place = 0) const noexcept {
    return delivery_.samples[place];
  }
  void notify(const News& news) const;
  // These two set the values that fill() reports.
  void count(const SendOutcome& outcome) noexcept;
  void set_receivers(std::size_t count) noexcept {
    receivers_now_ = static_cast<std::uint32_t>(count);
  }

 private:
  void update_streams();
  void pass_frames(std::int64_t now_ns);

  std::string name_, kind_, address_;
  std::unique_ptr<system::EventFd> wake_;
  Inbox inbox_;
  Delivery delivery_;
  LiveStreams known_;  // [place] what set_stream has got
  RateLimit limit_;
  std::optional<Gathering> gathering_;
  std::atomic<std::uint64_t> sent_{0}, dropped_{0}, failures_{0};
  std::atomic<std::uint32_t> receivers_now_{0};
  Notify notify_;
};

// Opens the sockets of an output. Errors name it. Cold.
Result<std::unique_ptr<Output>> open_output(const config::OutputConfig& config);

}  // namespace posed::output
