// The descriptors and memory of a process, to check that a replug leaks nothing.
#pragma once

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

namespace posed::lab {

inline constexpr long kMemorySlack_kb = 128;  // heap pages that are touched late

struct Resources {
  long descriptors = 0;
  long memory_kb = 0;  // resident

  static Resources of(const std::string& process) {
    const std::filesystem::path folder = std::filesystem::path("/proc") / process;
    Resources found;
    for ([[maybe_unused]] const auto& fd : std::filesystem::directory_iterator(folder / "fd")) {
      ++found.descriptors;
    }
    long ignored = 0;
    std::ifstream(folder / "statm") >> ignored >> found.memory_kb;
    found.memory_kb *= ::sysconf(_SC_PAGESIZE) / 1024;
    return found;
  }
  static Resources now() { return of("self"); }
};

}  // namespace posed::lab
