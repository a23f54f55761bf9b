// Whether a text has a part.
#pragma once

#include <string>

#include <catch2/catch.hpp>

namespace posed::test {

// The text is shown if the check around this fails.
inline bool has(const std::string& text, const std::string& part) {
  UNSCOPED_INFO(text);
  return text.contains(part);
}

}  // namespace posed::test
