// Events of a daemon, as `posed monitor --topic event --json` prints them.
#pragma once

#include <cstdint>
#include <string>

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "tests/support/process.hpp"

namespace posed::test {

// Waits for the next event of this kind and returns its time.
inline std::int64_t wait_for(Process& events, const std::string& kind) {
  while (const auto line = events.line()) {
    const auto event = nlohmann::json::parse(*line);
    if (event.at("kind") == kind) return std::stoll(event.at("timeNs").get<std::string>());
  }
  FAIL("no event " << kind);
  return 0;
}

}  // namespace posed::test
