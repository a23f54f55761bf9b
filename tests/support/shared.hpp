// Paths that tests use: the source tree, and the optional folder ../shared with real recordings.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace posed::test {

std::filesystem::path source_dir();    // of this checkout
std::filesystem::path posed_binary();  // the program that end-to-end tests start
inline std::filesystem::path golden(const std::string& name) {
  return source_dir() / "tests/golden" / name;
}

// ../shared/<relative> if it exists. Tests that need it are skipped by name:
//   const auto clip = shared("data/cmu/07_01.amc"); if (!clip) { SKIP_WITHOUT_SHARED(); }
inline std::optional<std::filesystem::path> shared(const std::string& relative) {
  auto path = source_dir() / "../shared" / relative;
  if (!std::filesystem::exists(path)) return std::nullopt;
  return path;
}

}  // namespace posed::test

// Prints the name of the skipped test; `./run test` prints how many there were.
#define SKIP_WITHOUT_SHARED()                                                              \
  do {                                                                                     \
    WARN("SKIPPED without ../shared: " << Catch::getResultCapture().getCurrentTestName()); \
    return;                                                                                \
  } while (false)
