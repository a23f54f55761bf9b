// The time of day, to print beside an event.
#pragma once

#include <chrono>
#include <ctime>
#include <string>

#include <spdlog/fmt/fmt.h>

namespace posed::tools {

// "17:04:09.250", in this machine's time zone.
inline std::string clock_time() {
  const auto now = std::chrono::system_clock::now();
  const std::time_t whole = std::chrono::system_clock::to_time_t(now);
  const auto ms =
      std::chrono::duration_cast<std::chrono::milliseconds>(now.time_since_epoch()).count() % 1000;
  std::tm local{};
  localtime_r(&whole, &local);
  return fmt::format("{:02}:{:02}:{:02}.{:03}", local.tm_hour, local.tm_min, local.tm_sec, ms);
}

}  // namespace posed::tools
