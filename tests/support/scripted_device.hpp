// A device of the VirtualDaemon: it follows a script on the virtual clock, and is plugged in again
// when the script has another link.
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <catch2/catch.hpp>

#include "daemon/pipeline/reader.hpp"
#include "daemon/system/event_fd.hpp"
#include "drivers/driver.hpp"
#include "drivers/glove/calibrated_decoder.hpp"
#include "tests/support/file_text.hpp"
#include "tests/support/virtual_daemon.hpp"

namespace posed::test {

inline constexpr std::int64_t kVirtualBegin_ns = 1'000'000'000'000;
inline thread_local std::int64_t virtual_now_ns = kVirtualBegin_ns;

inline std::int64_t virtual_clock() noexcept { return virtual_now_ns; }

inline std::int64_t at_ns(double at_s) {
  return at_s == kNever_s ? system::kForever_ns : kVirtualBegin_ns + nanoseconds(at_s);
}

// Plays one link of the script, `later_s` after the times that it has.
class ScriptedTransport final : public drivers::Transport {
 public:
  ScriptedTransport(const ScriptedLink& link, double later_s) : link_(link), later_s_(later_s) {}

  [[nodiscard]] int poll_fd() const noexcept override { return -1; }
  [[nodiscard]] std::int64_t next_due_ns() const noexcept override {
    if (!link_.flood.empty()) return at_ns(link_.from_s + later_s_);
    const std::int64_t chunk_ns = next_ < link_.chunks.size()
                                      ? at_ns(link_.chunks[next_].at_s + later_s_)
                                      : system::kForever_ns;
    return std::min(chunk_ns, at_ns(link_.until_s + later_s_));
  }
  Result<> start(std::int64_t /*now_ns*/) override { return {}; }
  [[nodiscard]] drivers::Chunk read(std::int64_t now_ns) noexcept override {
    if (now_ns >= at_ns(link_.until_s + later_s_))
      return {.bytes = {}, .end = link_.ends, .lost = !link_.ends};
    if (now_ns < next_due_ns()) return {};
    const std::string& bytes = link_.flood.empty() ? link_.chunks[next_++].bytes : link_.flood;
    return {.bytes = bytes_of(bytes)};
  }
  [[nodiscard]] bool send(std::span<const std::byte> /*bytes*/,
                          std::uint8_t /*socket*/) noexcept override {
    return true;
  }

 private:
  const ScriptedLink& link_;
  double later_s_;
  std::size_t next_ = 0;
};

class ScriptedDevice {
 public:
  // Every `repeat_s` seconds the script of links begins again.
  ScriptedDevice(drivers::Description description, std::vector<ScriptedLink> links, double repeat_s,
                 drivers::Poll poll = {})
      : description_(std::move(description)),
        links_(std::move(links)),
        repeat_s_(repeat_s),
        poll_(std::move(poll)) {
    slot_.supervisor = system::EventFd::open().value();
  }

  [[nodiscard]] const drivers::Description& description() const { return description_; }
  [[nodiscard]] pipeline::DeviceSlot& slot() { return slot_; }

  // The device of the next link, if it is connected by now; otherwise null.
  [[nodiscard]] drivers::Device* next() {
    if (device_ || is_over() || at_ns(next_from_s()) > virtual_now_ns) return nullptr;
    const ScriptedLink& link = links_[next_link_];
    const drivers::Driver* driver = drivers::find_driver(description_.driver);
    device_ = std::make_unique<drivers::Device>();
    device_->description = description_;
    device_->transport = std::make_unique<ScriptedTransport>(link, later_s_);
    device_->decoder = driver->make_decoder(description_).value();
    device_->calibrated = drivers::glove::calibrated_decoder(*device_->decoder);
    device_->poll = poll_;
    if (++next_link_ == links_.size() && repeat_s_ != kNever_s) {
      next_link_ = 0;
      later_s_ += repeat_s_;
    }
    return device_.get();
  }

  // When a supervisor has something to do.
  [[nodiscard]] std::int64_t due_ns() const {
    if (!slot_.out.empty()) return virtual_now_ns;
    return device_ || is_over() ? system::kForever_ns : at_ns(next_from_s());
  }
  void supervise(pipeline::Reader& reader) {
    while (slot_.out.consume([this](drivers::Device*) { device_.reset(); })) {
    }
    if (drivers::Device* const device = next(); device != nullptr) {
      REQUIRE(slot_.in.push(device));
      reader.call();
    }
  }

 private:
  [[nodiscard]] bool is_over() const { return next_link_ == links_.size(); }
  [[nodiscard]] double next_from_s() const { return links_[next_link_].from_s + later_s_; }

  drivers::Description description_;
  std::vector<ScriptedLink> links_;
  double repeat_s_, later_s_ = 0.0;
  drivers::Poll poll_;
  pipeline::DeviceSlot slot_;
  std::unique_ptr<drivers::Device> device_;  // of the link in use
  std::size_t next_link_ = 0;
};

}  // namespace posed::test
