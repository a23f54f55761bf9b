// Sentences about a stream or a source name it first. Cold.
#pragma once

#include <expected>
#include <string>
#include <string_view>
#include <utility>

#include "proto/frame/result.hpp"
#include "proto/text/clean.hpp"

namespace posed::devices {

[[nodiscard]] inline std::string about_stream(const std::string& name, std::string_view sentence) {
  return "stream " + in_quotes(name) + ": " + std::string(sentence);
}

// The error, with the stream's name in its message.
[[nodiscard]] inline std::unexpected<Error> in_stream(const std::string& name, Error error) {
  error.message = about_stream(name, error.message);
  return std::unexpected(std::move(error));
}

[[nodiscard]] inline std::unexpected<Error> in_source(const std::string& name, Error error) {
  error.message = "source " + in_quotes(name) + ": " + error.message;
  return std::unexpected(std::move(error));
}

}  // namespace posed::devices
