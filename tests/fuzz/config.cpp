// Any text as a daemon's config: every mistake gives an error message with a line number; nothing
// crashes or hangs.
#include <cstdint>
#include <cstdlib>
#include <string>

#include "daemon/config/config.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  const auto reading =
      posed::config::read_config(text, "/nowhere/fuzz.toml", posed::drivers::registry());
  for (const posed::Error& error : reading.errors) {
    if (error.message.empty() || error.line < 0) std::abort();
    if (error.text().find('\x1b') != std::string::npos)
      std::abort();  // no terminal escape sequences
  }
  if (reading.errors.empty() && reading.config.streams.empty() && reading.config.sources.empty()) {
    std::abort();
  }
  return 0;
}
