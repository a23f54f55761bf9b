// How streams are named, on the wire and everywhere else.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace posed {

inline constexpr std::size_t kMaxStreamName = 32;  // bytes

// Behind the name of a stream: its input, as it was before all stages.
inline constexpr std::string_view kRawSuffix = "-raw";

[[nodiscard]] inline std::string raw_name(std::string_view stream) {
  return std::string(stream) + std::string(kRawSuffix);
}

}  // namespace posed
