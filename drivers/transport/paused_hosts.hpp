// PausedHosts: who flooded a device's connection and must wait before the next one, because each
// costs work and space in a recording before it is found out. One thread.
#pragma once

#include <algorithm>
#include <array>
#include <chrono>

#include "drivers/transport/address.hpp"

namespace posed::drivers {

class PausedHosts {
 public:
  static constexpr std::chrono::seconds kPause{2};
  static constexpr Host kOurs{};  // whom posed itself connects to

  // If too many are paused, the one that has waited longest is forgotten.
  void add(const Host& host) noexcept {
    auto place = std::ranges::find(hosts_, host, &Paused::host);
    if (place == hosts_.end()) place = std::ranges::min_element(hosts_, {}, &Paused::until);
    *place = {host, Clock::now() + kPause};
  }
  [[nodiscard]] bool have(const Host& host) const noexcept {
    const auto place = std::ranges::find(hosts_, host, &Paused::host);
    return place != hosts_.end() && Clock::now() < place->until;
  }

  // Connections of paused hosts, of all listeners. A link of no use gives up its place for one.
  std::size_t waiting = 0;

 private:
  using Clock = std::chrono::steady_clock;
  struct Paused {
    Host host{};
    Clock::time_point until{};
  };
  std::array<Paused, 16> hosts_{};
};

}  // namespace posed::drivers
