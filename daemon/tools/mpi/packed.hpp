// The numbers of a list of tasks as the bytes of one message.
#pragma once

#include <cstddef>
#include <cstring>
#include <span>
#include <vector>

#include "models/tasks.hpp"

namespace posed::mpi {

// Of each result its length, then its numbers; all as doubles, so that their bits are kept.
[[nodiscard]] inline std::vector<double> packed(std::span<const TaskResult> results) {
  std::vector<double> numbers;
  for (const TaskResult& result : results) {
    numbers.push_back(static_cast<double>(result.size()));
    numbers.insert(numbers.end(), result.begin(), result.end());
  }
  return numbers;
}

[[nodiscard]] inline std::vector<TaskResult> unpacked(std::span<const std::byte> bytes) {
  std::vector<double> numbers(bytes.size() / sizeof(double));
  std::memcpy(numbers.data(), bytes.data(), numbers.size() * sizeof(double));
  std::vector<TaskResult> results;
  for (auto at = numbers.cbegin(); at != numbers.cend();) {
    const auto length = static_cast<std::ptrdiff_t>(*at++);
    results.emplace_back(at, at + length);
    at += length;
  }
  return results;
}

}  // namespace posed::mpi
