// Copies a device log that is open, or that a kill left behind, with the files beside it.
#pragma once

#include <filesystem>
#include <string>

#include "proto/log/schema.hpp"

namespace posed::test {

inline void copy_log(const std::filesystem::path& from, const std::filesystem::path& to) {
  for (const char* suffix : log::kFileSuffixes) {
    const std::string source = from.string() + suffix, target = to.string() + suffix;
    std::filesystem::remove(target);
    if (std::filesystem::exists(source)) std::filesystem::copy_file(source, target);
  }
}

}  // namespace posed::test
