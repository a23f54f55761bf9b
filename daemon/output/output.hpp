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

#include "daemon/config/daemon_config.hpp"
#include "daemon/output/gathering.hpp"
#include "daemon/output/inbox.hpp"
#include "daemon/output/rate_limit.hpp"
#include "daemon/output/send_outcome.hpp"
#include "daemon/publish/frame_output.hpp"
#include "daemon/system/event_fd.hpp"
#include "proto/frame/result.hpp"

namespace posed::output {

// Tells people something: beside a stream that it concerns, if one is there.
using Notify = std::function<void(std::optional<std::uint32_t> stream, const std::string& text)>;

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

  // The newest sample of the first stream that has come in this turn.
  [[nodiscard]] const std::optional<Sample>& sample() const noexcept { return delivery_.sample; }
  void notify(const std::string& text) const;
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
