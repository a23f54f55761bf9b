#include "proto/text/named_numbers.hpp"

#include <algorithm>

#include "proto/text/clean.hpp"
#include "proto/text/number.hpp"

namespace posed {
namespace {

constexpr std::size_t kMaxText = 2048;  // bytes: sixteen names of any sensible length

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t") - first + 1);
}

Result<double> number_in(std::string_view text, std::string_view entry, std::string_view what,
                         double low, double high) {
  const auto number = exact_number<double>(text);
  if (number && *number >= low && *number <= high) return *number;  // false for NaN
  const auto whole_text = [](double limit) { return std::to_string(static_cast<int>(limit)); };
  return misuse(std::string(what) + ": " + in_quotes(std::string(entry)) + " needs a number from " +
                whole_text(low) + " to " + whole_text(high) + " after the '='");
}

}  // namespace

Result<std::vector<NamedNumber>> parse_named_numbers(std::string_view text, std::string_view what,
                                                     double low, double high) {
  if (text.size() > kMaxText) {
    return misuse(std::string(what) + ": the text has more than " + std::to_string(kMaxText) +
                  " bytes");
  }
  std::vector<NamedNumber> found;
  if (trimmed(text).empty()) return found;
  while (true) {
    const auto comma = text.find(',');
    const std::string_view entry = trimmed(text.substr(0, comma));
    const auto equals = entry.rfind('=');
    const std::string name(trimmed(entry.substr(0, equals)));
    if (equals == std::string_view::npos || name.empty()) {
      return misuse(std::string(what) + ": " + in_quotes(std::string(entry)) +
                    " is not NAME=NUMBER; write, for example, one=0.6,other=0.4");
    }
    const auto number = TRY(number_in(trimmed(entry.substr(equals + 1)), entry, what, low, high));
    if (std::ranges::find(found, name, &NamedNumber::name) != found.end()) {
      return misuse(std::string(what) + ": " + in_quotes(name) + " is named twice");
    }
    found.push_back({name, number});
    if (comma == std::string_view::npos) return found;
    text.remove_prefix(comma + 1);
  }
}

}  // namespace posed
