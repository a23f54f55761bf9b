// A take: an interval of the recording that a person or another system marks and names. Cold.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "posed/v1/posed.pb.h"
#include "proto/frame/result.hpp"

namespace posed::pipeline {

inline constexpr std::size_t kMaxTakeName = 128;  // bytes

// Begins a take, which ends the one before, or ends the one that runs.
struct TakeMark {
  bool start = true;
  std::int64_t time_ns = 0;
  std::string name{};      // of one that begins; may be empty
  std::string timecode{};  // at its beginning, where another system told it
  std::string remark{};    // a part of a sentence for the event: "the sender says FAIL"
};

struct Take {
  std::uint32_t number = 0;  // counts the recording's takes from 1
  std::string name{};
  std::int64_t start_ns = 0;
  std::string timecode{};
  std::uint64_t lost_chunks = 0;  // that the recording lost while it ran, so far
  std::string trouble{};          // why the recording cannot be written at present; empty: it can
};

// An error unless the name has at most kMaxTakeName bytes of printable UTF-8.
Result<> check_take_name(std::string_view name);

// "take 3 'walk'", or "take 3" without a name.
[[nodiscard]] std::string words_of(const Take& take);

[[nodiscard]] v1::TakeStats stats_of(const Take& take);

}  // namespace posed::pipeline
