// One finding of `posed doctor`.
#pragma once

#include <string>
#include <utility>

namespace posed::doctor {

struct Check {
  std::string name;   // "usb latency"; the same in every run, for scripts
  bool ok = true;     // also when it does not apply to this machine or config
  std::string found;  // what is there, or why it does not apply
  // The line that mends it; empty if ok. A command can be pasted into a shell: words about it come
  // behind a #.
  std::string fix{};
  bool looked = true;  // false: it needs a config, and there is none; then it counts as ok
};

[[nodiscard]] inline Check right(std::string name, std::string found) {
  return {.name = std::move(name), .ok = true, .found = std::move(found)};
}
[[nodiscard]] inline Check wrong(std::string name, std::string found, std::string fix) {
  return {.name = std::move(name), .ok = false, .found = std::move(found), .fix = std::move(fix)};
}
[[nodiscard]] inline Check needs_config(std::string name) {
  return {.name = std::move(name), .found = "not looked at: give --config FILE", .looked = false};
}

// "a, b": appends a word to a list in a sentence.
inline void add_word(std::string& list, const std::string& word) {
  list += (list.empty() ? "" : ", ") + word;
}

}  // namespace posed::doctor
