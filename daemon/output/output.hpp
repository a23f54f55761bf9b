// Output: the base of all outputs. It has an inbox with the frames of the wanted streams, counters,
// and a way to report problems to users. assembly runs each output on a thread of its own.
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
#include "daemon/output/inbox.hpp"
#include "daemon/output/send_outcome.hpp"
#include "daemon/publish/frame_output.hpp"
#include "daemon/system/event_fd.hpp"
#include "proto/frame/result.hpp"

namespace posed::output {

// Tells people something: beside a stream that it concerns, if one is there.
using Notify = std::function<void(std::optional<std::uint32_t> stream, const std::string& text)>;

class Output : public publish::FrameOutput {
 public:
  Output(const config::OutputConfig& config, std::unique_ptr<system::EventFd> wake);

  [[nodiscard]] const std::string& name() const noexcept { return name_; }
  // Call it before the first turn.
  void set_notify(Notify notify) { notify_ = std::move(notify); }

  // The output's thread calls it. It does everything that is due at `now_ns` and never waits.
  // Returns the latest time of the next call; call it earlier if wake() is notified.
  [[nodiscard]] virtual std::int64_t turn(std::int64_t now_ns) = 0;
  [[nodiscard]] system::EventFd& wake() noexcept { return *wake_; }

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
  // Returns everything that has come since the last call.
  [[nodiscard]] const Delivery& receive();
  // The streams as of the last receive().
  [[nodiscard]] const PartStreams& streams() const noexcept { return delivery_.streams; }
  void notify(const std::string& text) const;
  // These two set the values that fill() reports.
  void count(const SendOutcome& outcome) noexcept;
  void set_receivers(std::size_t count) noexcept {
    receivers_now_ = static_cast<std::uint32_t>(count);
  }

 private:
  std::string name_, kind_;
  std::unique_ptr<system::EventFd> wake_;
  Inbox inbox_;
  Delivery delivery_;
  std::atomic<std::uint64_t> sent_{0}, dropped_{0}, failures_{0};
  std::atomic<std::uint32_t> receivers_now_{0};
  Notify notify_;
};

// Opens the sockets of an output. Errors name it. Cold.
Result<std::unique_ptr<Output>> open_output(const config::OutputConfig& config);

}  // namespace posed::output
