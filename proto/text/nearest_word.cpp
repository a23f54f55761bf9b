#include "proto/text/nearest_word.hpp"

#include <algorithm>
#include <numeric>
#include <utility>
#include <vector>

namespace posed {
namespace {

// Levenshtein distance where two neighbours that are swapped are one mistake, too (optimal string
// alignment), computed one row at a time.
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> before(b.size() + 1);  // row i - 1
  std::vector<std::size_t> row(b.size() + 1);     // row i
  std::vector<std::size_t> next(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    next[0] = i + 1;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t replaced = row[j] + (a[i] == b[j] ? 0 : 1);
      next[j + 1] = std::min({replaced, next[j] + 1, row[j + 1] + 1});
      const bool swapped = i > 0 && j > 0 && a[i] == b[j - 1] && a[i - 1] == b[j];
      if (swapped) next[j + 1] = std::min(next[j + 1], before[j - 1] + 1);
    }
    std::swap(before, row);
    std::swap(row, next);
  }
  return row.back();
}

}  // namespace

std::string nearest(std::string_view word, const std::set<std::string>& known) {
  constexpr std::size_t kMaxLetters = 64;  // longer words match nothing; the cost is n^2
  const std::string_view start = word.substr(0, kMaxLetters);
  const auto best = std::ranges::min_element(
      known, {}, [&](const std::string& candidate) { return edit_distance(start, candidate); });
  if (best == known.end()) return {};
  const std::size_t mistakes = edit_distance(start, *best);
  return mistakes <= 1 + best->size() / 4 ? *best : std::string{};
}

}  // namespace posed
