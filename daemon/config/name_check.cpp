#include "daemon/config/config_file.hpp"

#include <algorithm>
#include <map>

#include <spdlog/fmt/fmt.h>

#include "daemon/config/config.hpp"
#include "proto/text/clean.hpp"
#include "proto/text/stream_name.hpp"

namespace posed::config {
namespace {

const char* kind_of_table(const NamedTable& table) { return table.is_source ? "source" : "stream"; }

std::string second_of_name(const NamedTable& first, const NamedTable& second) {
  if (first.is_source != second.is_source) {
    return fmt::format(
        "a {} is named {} like the {} in line {}; streams and sources have different"
        " names",
        kind_of_table(second), in_quotes(second.name), kind_of_table(first), first.line);
  }
  return fmt::format(
      "a second {0} is named {1} (the first stands in line {2}); every {0} has its"
      " own name",
      kind_of_table(second), in_quotes(second.name), first.line);
}

}  // namespace

void check_names(std::vector<NamedTable> tables, Findings& findings) {
  std::ranges::stable_sort(tables, {}, &NamedTable::line);
  std::map<std::string, const NamedTable*> first;
  for (const NamedTable& table : tables) {
    if (table.name.empty()) continue;
    const auto [known, is_new] = first.emplace(table.name, &table);
    if (!is_new) findings.add_error(table.line, second_of_name(*known->second, table));
  }
  for (const NamedTable& stream : tables) {
    if (!stream.publish_raw) continue;
    const std::string raw = raw_name(stream.name);
    if (is_stream_name(stream.name) && !is_stream_name(raw)) {
      findings.add_error(stream.line, fmt::format("{} is longer than {} letters; shorten the name"
                                                  " or leave out publish_raw",
                                                  in_quotes(raw), kMaxStreamName));
    }
    const auto taken = first.find(raw);
    if (taken != first.end() && !taken->second->is_source) {
      findings.add_error(taken->second->line,
                         fmt::format("{} is the name under which the raw input of {} is published;"
                                     " choose another",
                                     in_quotes(raw), in_quotes(stream.name)));
    }
  }
}

}  // namespace posed::config
