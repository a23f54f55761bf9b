// Lists in sentences. Cold.
#pragma once

#include <functional>
#include <iterator>
#include <ranges>
#include <string>
#include <string_view>

namespace posed {

// Appends a word to a list: "a", "a, b".
inline void add_word(std::string& list, std::string_view word, std::string_view between = ", ") {
  if (!list.empty()) list += between;
  list += word;
}

// "a, b, c". `name` gives the word of an element; by default the element is the word.
template <std::ranges::input_range Range, typename Name = std::identity>
[[nodiscard]] std::string joined(const Range& range, std::string_view between = ", ",
                                 const Name& name = {}) {
  std::string list;
  std::string_view before;  // an empty word keeps its place
  for (const auto& element : range) {
    list += before;
    list += std::invoke(name, element);
    before = between;
  }
  return list;
}

// "a, b or c".
template <std::ranges::forward_range Range>
[[nodiscard]] std::string alternatives(const Range& words) {
  std::string list;
  for (auto at = words.begin(); at != words.end(); ++at) {
    add_word(list, *at, std::next(at) == words.end() ? " or " : ", ");
  }
  return list;
}

}  // namespace posed
