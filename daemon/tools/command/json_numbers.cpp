#include "daemon/tools/command/json_numbers.hpp"

#include <algorithm>
#include <string>

#include <spdlog/fmt/fmt.h>
#include <nlohmann/json.hpp>

#include "proto/text/json_text.hpp"

namespace posed::tools {
namespace {

void collect(const std::string& prefix, const nlohmann::ordered_json& figures,
             const std::vector<std::string_view>& without,
             std::vector<report::NamedNumber>& numbers) {
  for (const auto& [name, value] : figures.items()) {
    if (std::ranges::find(without, name) != without.end()) continue;
    if (value.is_object()) collect(prefix + name + ".", value, without, numbers);
    if (!value.is_number()) continue;
    numbers.push_back({prefix + name, value.is_number_integer()
                                          ? json_text(value)
                                          : fmt::format("{:.5g}", value.get<double>())});
  }
}

}  // namespace

std::vector<report::NamedNumber> numbers_of(const nlohmann::ordered_json& figures,
                                            const std::vector<std::string_view>& without) {
  std::vector<report::NamedNumber> numbers;
  if (figures.is_object()) collect("", figures, without, numbers);
  return numbers;
}

void add_json(const nlohmann::ordered_json& figures, report::Page& page) {
  page.text("The same as --json prints it", "For programs, and to copy from.",
            json_text(figures, 2));
}

}  // namespace posed::tools
