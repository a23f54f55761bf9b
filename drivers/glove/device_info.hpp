// The device info of a glove, stored in Description::text as "driver key=value key=value": what its
// driver learned from it at the start, enough to decode its bytes again from a log.
#pragma once

#include <map>
#include <span>
#include <string>
#include <string_view>

#include "proto/frame/hand.hpp"
#include "proto/frame/result.hpp"

namespace posed::drivers::glove {

[[nodiscard]] std::string_view side_name(Side side) noexcept;  // "right", "left"
Result<Side> parse_side(std::string_view name);

// The beginning of every device info: "driver hand=right".
[[nodiscard]] std::string hand_info(std::string_view driver, Side hand);

// Reads a device info key by key. A key that is missing, repeated, unknown or out of range is
// remembered and reported by finish(); until then it reads as its smallest allowed value. Cold.
class DeviceInfoReader {
 public:
  DeviceInfoReader(const std::string& text, std::string_view driver, std::string identity);

  [[nodiscard]] int whole(std::string_view key, int least, int most);
  [[nodiscard]] std::size_t choice(std::string_view key, std::span<const std::string_view> names);
  [[nodiscard]] Side side();  // "hand"
  [[nodiscard]] std::string word(std::string_view key);

  // Reports the first error as one sentence; a key that was never read is also an error.
  Result<> finish() const;

 private:
  void add_error(std::string what);

  std::string driver_, identity_;
  std::map<std::string, std::string, std::less<>> unread_;
  std::string wrong_;  // empty: no error so far
};

}  // namespace posed::drivers::glove
