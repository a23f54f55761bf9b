#include "daemon/config/words.hpp"

#include <algorithm>
#include <numeric>
#include <utility>
#include <vector>

namespace posed::config {
namespace {

// Levenshtein, one row at a time.
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i + 1);
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({replaced, row[j] + 1, diagonal + 1});
    }
  }
  return row.back();
}

}  // namespace

std::string nearest(std::string_view word, const std::set<std::string>& known) {
  constexpr std::size_t kLongest = 64;  // longer words are near to nothing, and cost n^2
  const std::string_view start = word.substr(0, kLongest);
  const auto best = std::ranges::min_element(
      known, {}, [&](const std::string& candidate) { return edit_distance(start, candidate); });
  return best == known.end() ? std::string{} : *best;
}

std::string without_controls(std::string text) {
  for (char& c : text) {
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = '?';
  }
  return text;
}

std::string printable(std::string_view text) {
  constexpr std::size_t kLongest = 60;
  std::size_t length = std::min(text.size(), kLongest);
  while (length < text.size() && length > 0 && (text[length] & 0xc0) == 0x80) --length;  // UTF-8
  std::string out = without_controls(std::string(text.substr(0, length)));
  return length < text.size() ? out + "..." : out;
}

}  // namespace posed::config
