// Any text as any TOML that posed reads: the guarded entry point, and each reader behind it. Text
// that passes the guard nests no deeper than the limit; a mistake gives an error message without
// terminal escapes. Run with a small stack (ulimit -s 256) to check that no deep nesting gets
// through.
#include <algorithm>
#include <cstdint>
#include <string>

#include <sys/mman.h>
#include <unistd.h>

#include "daemon/config/config.hpp"
#include "daemon/tools/gesture/question_file.hpp"
#include "daemon/tools/style/experiment.hpp"
#include "drivers/described/device_file.hpp"
#include "drivers/glove/calibration_file.hpp"
#include "proto/frame/hand_shape.hpp"
#include "proto/frame/profile.hpp"
#include "proto/text/toml.hpp"
#include "tests/fuzz/demand.hpp"

namespace {

using posed::TomlLimits;
using posed::fuzz::demand;

void check_sentence(const posed::Error& error) {
  demand(!error.message.empty() && error.line >= 0);
  const std::string text = error.text();
  demand(text.size() < 10'000);
  demand(std::ranges::none_of(text, [](unsigned char c) { return c < 0x20 || c == 0x7F; }));
}

template <typename T>
void check_result(const posed::Result<T>& result) {
  if (!result) check_sentence(result.error());
}

// Depth of nested containers, the node itself included.
int depth_of(const toml::node& node) {
  int deepest = 0;
  if (const toml::table* table = node.as_table()) {
    for (const auto& [key, value] : *table) deepest = std::max(deepest, depth_of(value));
  } else if (const toml::array* array = node.as_array()) {
    for (const toml::node& value : *array) deepest = std::max(deepest, depth_of(value));
  } else {
    return 0;
  }
  return deepest + 1;
}

void try_guard(const std::string& text, const TomlLimits& limits) {
  const auto table = posed::parse_toml(text, "fuzz.toml", limits);
  if (!table) return check_sentence(table.error());
  // Each part of a header may be an array with a table in it, that is two levels.
  demand(depth_of(*table) <= 2 * limits.depth + 1);
}

// The text as an in-memory file, for readers that take a path.
class MemoryFile {
 public:
  explicit MemoryFile(const std::string& text) : fd_(memfd_create("fuzz", MFD_CLOEXEC)) {
    demand(fd_ >= 0 && write(fd_, text.data(), text.size()) == std::ssize(text));
  }
  ~MemoryFile() { close(fd_); }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

  [[nodiscard]] std::string path() const { return "/proc/self/fd/" + std::to_string(fd_); }

 private:
  int fd_;
};

void try_config(const std::string& text) {
  using posed::drivers::OptionSpec;
  static const std::vector<posed::drivers::Driver> drivers{
      {.name = "file",
       .summary = "a clip",
       .options = {OptionSpec{"path", std::string(), true, true, "the clip to play"},
                   OptionSpec{"loop", false, false, false, ""},
                   OptionSpec{"pace", 1.0, false, false, ""},
                   OptionSpec{"first", std::int64_t{1}, false, false, ""}},
       .open = nullptr,
       .make_decoder = nullptr,
       .describe = nullptr}};
  const auto reading = posed::config::read_config(text, "/nowhere/fuzz.toml", drivers);
  for (const posed::Error& error : reading.errors) check_sentence(error);
  demand(reading.errors.size() <= 101 && reading.config.streams.size() <= 256);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 1) return 0;
  const std::string text(reinterpret_cast<const char*>(data + 1), size - 1);
  switch (data[0] % 8) {
    case 0:
      try_guard(text, {});
      break;
    case 1:
      try_guard(text, {.what = "note", .bytes = 100'000, .depth = 2, .items = 50});
      break;
    case 2:
      try_config(text);
      break;
    case 3:
      check_result(posed::drivers::glove::parse_calibration(text, "fuzz.toml"));
      break;
    case 4:
      check_result(posed::drivers::described::parse_device(text, "fuzz.toml"));
      break;
    case 5:
      check_result(posed::parse_profile(text, "fuzz.toml"));
      check_result(posed::parse_hand_shape(text, "fuzz.toml"));
      break;
    case 6:
      check_result(posed::tools::read_experiment(MemoryFile(text).path()));
      break;
    default:
      check_result(posed::tools::read_questions(MemoryFile(text).path()));
      break;
  }
  return 0;
}
