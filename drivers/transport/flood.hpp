// Flood: notices that a connection brings so much of what the decoder has no use for that it must
// end. Host time. The reader thread calls it; the supervisor's may ask has_ended().
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <string>

#include "drivers/transport/paused_hosts.hpp"
#include "proto/frame/rt_safe.hpp"
#include "proto/frame/time.hpp"

namespace posed::drivers {

class Flood {
 public:
  RT_SAFE void read(std::size_t bytes, std::int64_t now_ns) noexcept {
    read_ = bytes;
    read_ns_ = now_ns;
  }
  RT_SAFE void decoded(bool used) noexcept {
    if (used || read_ns_ - since_ns_ > kWithin_ns) {
      of_no_use_ = 0;
      since_ns_ = read_ns_;
    }
    if (!used) of_no_use_ += read_;
    if (of_no_use_ > kMaxOfNoUse) end();
  }
  RT_SAFE void end() noexcept { ended_.store(true); }
  [[nodiscard]] bool has_ended() const noexcept { return ended_.load(); }

  [[nodiscard]] static std::string words(const std::string& name) {
    return name +
           " has sent too much of nothing usable (3 MB within 3 s, or all that a recording takes of"
           " that): it is cut, and its address is heard again after " +
           std::to_string(PausedHosts::kPause.count()) + " s";
  }

 private:
  // A sender that never says its name is of no use for a second, until it is described.
  static constexpr std::size_t kMaxOfNoUse = 3 * 1024 * 1024;  // bytes in kWithin_ns
  static constexpr std::int64_t kWithin_ns = 3 * kNanosPerSecond;

  std::int64_t read_ns_ = 0, since_ns_ = 0;
  std::size_t read_ = 0, of_no_use_ = 0;  // bytes: of the last read, and in a row since since_ns_
  std::atomic<bool> ended_{false};
};

}  // namespace posed::drivers
