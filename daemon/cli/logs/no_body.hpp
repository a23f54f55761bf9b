// What `record` and `replay` say of a source that has no stream in the log.
#pragma once

#include <string>

#include <spdlog/spdlog.h>

#include "proto/text/clean.hpp"

namespace posed::cli {

// It may have named some that nobody wanted or that were refused.
inline void warn_of_no_body(const std::string& source) {
  spdlog::warn("source {} named no body that became a stream", in_quotes(source));
}

}  // namespace posed::cli
