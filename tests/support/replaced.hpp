// A small file's text with one mistake in it.
#pragma once

#include <string>

#include <catch2/catch.hpp>

namespace posed::test {

// `text` with the first `from` replaced by `to`.
inline std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  REQUIRE(at != std::string::npos);
  return text.replace(at, from.size(), to);
}

}  // namespace posed::test
