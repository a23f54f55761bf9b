// A client of the daemon under test that records every Sample of every stream.
#pragma once

#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "tests/lab/devices.hpp"

namespace posed::lab {

struct ReceivedSample {
  std::uint64_t sequence = 0;
  Moment arrived;   // at the daemon
  Moment received;  // here
  std::optional<std::uint32_t>
      value;  // common value of all raw sensors; empty: they differ, or are too few
};

struct Received {
  std::vector<ReceivedSample> samples;
  std::vector<Moment> found, lost;  // times of posed's events
};

class Listener {
 public:
  explicit Listener(const std::string& endpoint);

  [[nodiscard]] Received received(const std::string& stream) const;
  // The number of samples so far that arrived at the daemon at or after `begin`.
  [[nodiscard]] std::size_t samples_since(const std::string& stream, Moment begin) const;
  [[nodiscard]] bool lost_since(const std::string& stream, Moment begin) const;

 private:
  [[nodiscard]] const Received& of(const std::string& stream) const;
  void listen(const std::stop_token& stop, const std::string& endpoint);
  void take_sample(std::string_view bytes);
  void take_event(std::string_view bytes);

  mutable std::mutex mutex_;
  std::map<std::string, Received> received_;
  std::jthread thread_;
};

}  // namespace posed::lab
