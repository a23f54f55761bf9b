#include "proto/text/findings.hpp"

#include <algorithm>
#include <ranges>

#include "proto/text/clean.hpp"
#include "proto/text/nearest_word.hpp"

namespace posed {
namespace {

bool is_within(std::string_view table, std::string_view top) {
  return table.starts_with(top) && (table.size() == top.size() || table[top.size()] == '.');
}

// "stream.style" for "source.style"; empty for a table of another name.
std::string replace_top(std::string_view table, std::string_view from, std::string_view to) {
  if (!is_within(table, from)) return {};
  return std::string(to) + std::string(table.substr(from.size()));
}

}  // namespace

void Findings::add_error(int line, std::string_view message) {
  if (errors.size() > kMaxErrors) return;
  const bool last = errors.size() == kMaxErrors;
  errors.push_back({last ? "and there are more mistakes; fix these first" : clean(message), file,
                    line, exit_code});
}

const Error& Findings::first_error() const {
  // Without the error that says that there are more.
  return *std::ranges::min_element(errors | std::views::take(kMaxErrors), {}, &Error::line);
}

std::vector<std::string> Findings::places_of(std::string_view table, std::string_view key) const {
  std::set<std::string> tables;
  for (const std::string& path : all_keys) {
    const std::size_t dot = path.rfind('.');
    if (dot == std::string::npos || path.substr(dot + 1) != key) continue;
    if (path.substr(0, dot) != table) tables.insert(path.substr(0, dot));
  }
  std::vector<std::string> places;
  const bool in_copy = is_within(table, twins.copy);
  for (const std::string& place : tables) {
    const bool of_copy = is_within(place, twins.copy);
    const std::string twin = of_copy ? replace_top(place, twins.copy, twins.original)
                                     : replace_top(place, twins.original, twins.copy);
    if (of_copy == in_copy || !tables.contains(twin)) places.push_back("[" + place + "]");
  }
  return places;
}

std::string Findings::advice(std::string_view table, std::string_view key,
                             const std::set<std::string>& known_here) const {
  constexpr std::size_t kMaxPlaces = 3;
  const std::vector<std::string> places = places_of(table, key);
  // If several tables can have such a key, prefer those that this file has.
  std::vector<std::string> present = places;
  std::erase_if(present, [this](const std::string& place) {
    const std::string within = place.substr(1, place.size() - 2) + ".";
    const auto next = known.lower_bound(within);
    return next == known.end() || !next->starts_with(within);
  });
  const auto& meant = present.empty() ? places : present;
  if (!meant.empty() && meant.size() <= kMaxPlaces) {
    return "it belongs in " + listed(meant, " or ");
  }
  const std::string near = nearest(key, known_here);
  if (!near.empty()) return "the nearest known one here is '" + near + "'";
  return "known here: " + listed(known_here, ", ");
}

}  // namespace posed
