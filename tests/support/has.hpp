// Whether a text has the words that matter.
#pragma once

#include <string>
#include <string_view>

#include <catch2/catch.hpp>

namespace posed::test {

// Whether all parts of `words` stand in the text, in this order: "no stream 'nobody' ... walker".
// A message may so be worded anew as long as it names the same.
inline bool in_order(std::string_view text, std::string_view words) {
  constexpr std::string_view kBetween = " ... ";
  while (true) {
    const auto end = words.find(kBetween);
    const auto part = words.substr(0, end);
    const auto at = text.find(part);
    if (at == std::string_view::npos) return false;
    if (end == std::string_view::npos) return true;
    text.remove_prefix(at + part.size());
    words.remove_prefix(end + kBetween.size());
  }
}

// The same; the text is shown if the check around this fails.
inline bool has(const std::string& text, const std::string& words) {
  UNSCOPED_INFO(text);
  return in_order(text, words);
}

}  // namespace posed::test
