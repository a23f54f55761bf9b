// Greeting: a glove's Description::text, "driver key=value key=value": what its driver learned of
// it at the start, enough to decode it again from a log.
#pragma once

#include <map>
#include <span>
#include <string>
#include <string_view>

#include "proto/frame/hand.hpp"
#include "proto/frame/result.hpp"

namespace posed::drivers::glove {

[[nodiscard]] std::string_view side_name(Side side) noexcept;  // "right", "left"
[[nodiscard]] Result<Side> parse_side(std::string_view name);

// Reads a greeting key by key. What is missing, twice there, unknown or out of range is remembered
// and told by finish(); until then a bad key reads as the least it may be. Cold.
class Greeting {
 public:
  Greeting(const std::string& text, std::string_view driver, std::string identity);

  [[nodiscard]] int whole(std::string_view key, int least, int most);
  [[nodiscard]] std::size_t choice(std::string_view key, std::span<const std::string_view> names);
  [[nodiscard]] Side side();  // "hand"
  [[nodiscard]] std::string word(std::string_view key);

  // One sentence about the first thing wrong, keys that nobody read included.
  [[nodiscard]] Result<> finish() const;

 private:
  void add_error(std::string what);

  std::string driver_, identity_;
  std::map<std::string, std::string, std::less<>> unread_;
  std::string wrong_;  // empty: nothing so far
};

}  // namespace posed::drivers::glove
