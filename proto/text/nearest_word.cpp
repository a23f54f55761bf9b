#include "proto/text/nearest_word.hpp"

#include <algorithm>
#include <numeric>
#include <utility>
#include <vector>

namespace posed {
namespace {

// Levenshtein distance, computed one row at a time.
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
  constexpr std::size_t kLongest = 64;  // longer words match nothing; the cost is n^2
  const std::string_view start = word.substr(0, kLongest);
  const auto best = std::ranges::min_element(
      known, {}, [&](const std::string& candidate) { return edit_distance(start, candidate); });
  if (best == known.end()) return {};
  const std::size_t mistakes = edit_distance(start, *best);
  return mistakes <= 1 + best->size() / 4 ? *best : std::string{};
}

}  // namespace posed
