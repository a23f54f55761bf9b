// What `record` and `replay` say of a source that has no stream in the log.
#pragma once

#include <string>

#include <spdlog/spdlog.h>

#include "proto/text/clean.hpp"

namespace posed::tools {

// It may have named some that nobody wanted or that were refused.
[[nodiscard]] inline std::string no_body_of(const std::string& source) {
  return "source " + in_quotes(source) + " named no body that became a stream";
}

inline void warn_of_no_body(const std::string& source) { spdlog::warn("{}", no_body_of(source)); }

}  // namespace posed::tools
