#include "daemon/config/toml_reader.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>

#include <spdlog/fmt/fmt.h>

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

// What a key's last letters say about its unit, so that a wrong value is told the right one.
std::string unit_of(std::string_view key) {
  constexpr std::array<std::pair<std::string_view, const char*>, 7> kUnits{{
      {"_per_s", " per second"},
      {"_ms", " of milliseconds"},
      {"_s", " of seconds"},
      {"_hz", " of hertz"},
      {"_deg", " of degrees"},
      {"_rad", " of radians"},
      {"_m", " of metres"},
  }};
  for (const auto& [suffix, words] : kUnits) {
    if (key.ends_with(suffix)) return words;
  }
  return {};
}

const char* kind_of(const toml::node& node) {
  switch (node.type()) {
    case toml::node_type::table:
      return "a table";
    case toml::node_type::array:
      return node.is_array_of_tables() ? "a list of tables" : "a list";
    case toml::node_type::string:
      return "text";
    case toml::node_type::integer:
      return "an integer";
    case toml::node_type::floating_point:
      return "a number";
    case toml::node_type::boolean:
      return "true or false";
    default:
      return "a date or time";
  }
}

int line_of_node(const toml::node& node) { return static_cast<int>(node.source().begin.line); }

// Keys come from the file: what a terminal would obey is not printed.
std::string printable(std::string_view text) {
  constexpr std::size_t kLongest = 60;
  std::string out(text.substr(0, kLongest));
  for (char& c : out) {
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = '?';
  }
  return text.size() > kLongest ? out + "..." : out;
}

}  // namespace

std::string nearest(std::string_view word, const std::set<std::string>& known) {
  constexpr std::size_t kLongest = 64;  // longer words are near to nothing, and cost n^2
  const std::string_view start = word.substr(0, kLongest);
  const auto best = std::ranges::min_element(
      known, {}, [&](const std::string& candidate) { return edit_distance(start, candidate); });
  return best == known.end() ? std::string{} : *best;
}

void Findings::blame(int line, std::string message) {
  errors.push_back({std::move(message), file, line, ExitCode::kWrongUse});
}

TableReader::TableReader(const toml::table& table, std::string path, Findings& findings)
    : table_(table), path_(std::move(path)), findings_(findings) {}

int TableReader::line() const { return line_of_node(table_); }

int TableReader::line_of(std::string_view key) const {
  const toml::node* node = table_.get(key);
  return node == nullptr ? line() : line_of_node(*node);
}

std::string TableReader::full(std::string_view key) const {
  return path_.empty() ? std::string(key) : path_ + "." + std::string(key);
}

const toml::node* TableReader::find(std::string_view key) {
  asked_.emplace(key);
  findings_.known.insert(full(key));
  return table_.get(key);
}

void TableReader::blame(std::string_view key, const std::string& message) {
  findings_.blame(line_of(key), message);
}

void TableReader::blame_type(const toml::node& node, std::string_view key,
                             const std::string& wanted) {
  findings_.blame(line_of_node(node),
                  fmt::format("{} must be {}, not {}", full(key), wanted, kind_of(node)));
}

void TableReader::read(const char* key, bool& value) {
  const toml::node* node = find(key);
  if (node == nullptr) return;
  if (const auto* flag = node->as_boolean()) {
    value = flag->get();
  } else {
    blame_type(*node, key, "true or false");
  }
}

void TableReader::read(const char* key, std::int64_t& value) {
  const toml::node* node = find(key);
  if (node == nullptr) return;
  if (const auto* integer = node->as_integer()) {
    value = integer->get();
  } else {
    blame_type(*node, key, "an integer");
  }
}

void TableReader::read(const char* key, double& value, Range range) {
  const toml::node* node = find(key);
  if (node == nullptr) return;
  if (!node->is_number()) return blame_type(*node, key, "a number" + unit_of(key));
  const double number = *node->value<double>();
  if (number >= range.min && number <= range.max) {
    value = number;
    return;
  }
  const bool bounded = std::isfinite(range.min) && std::isfinite(range.max);
  const std::string wanted =
      bounded ? fmt::format("from {} to {}", range.min, range.max) : std::string("finite");
  blame(key, fmt::format("{} = {} is out of range: it takes a number{} {}", full(key), number,
                         unit_of(key), wanted));
}

void TableReader::read(const char* key, std::string& value) {
  const toml::node* node = find(key);
  if (node == nullptr) return;
  if (const auto* text = node->as_string()) {
    value = text->get();
  } else {
    blame_type(*node, key, "text in quotes");
  }
}

void TableReader::read(const char* key, std::vector<std::string>& value) {
  const toml::node* node = find(key);
  if (node == nullptr) return;
  const toml::array* list = node->as_array();
  if (list == nullptr) return blame_type(*node, key, "a list of texts");
  value.clear();
  for (const toml::node& element : *list) {
    if (const auto* text = element.as_string()) {
      value.push_back(text->get());
    } else {
      blame_type(element, key, "a list of texts");
    }
  }
}

void TableReader::require(const char* key, std::string& value) {
  if (find(key) == nullptr) {
    findings_.blame(line(), fmt::format("{} is missing; give it a text in quotes", full(key)));
    return;
  }
  read(key, value);
}

std::optional<TableReader> TableReader::table(const std::string& key) {
  const toml::node* node = find(key);
  if (node == nullptr) return std::nullopt;
  if (const toml::table* table = node->as_table()) return TableReader(*table, full(key), findings_);
  blame_type(*node, key, "a table ([" + full(key) + "])");
  return std::nullopt;
}

std::vector<TableReader> TableReader::tables(const std::string& key) {
  std::vector<TableReader> readers;
  const toml::node* node = find(key);
  if (node == nullptr) return readers;
  const toml::array* list = node->as_array();
  if (list == nullptr || !list->is_homogeneous<toml::table>()) {
    blame_type(*node, key, "a list of tables ([[" + full(key) + "]])");
    return readers;
  }
  for (const toml::node& element : *list) {
    readers.emplace_back(*element.as_table(), full(key), findings_);
  }
  return readers;
}

void TableReader::finish() {
  for (const auto& [key, node] : table_) {
    const std::string name(key.str());
    if (asked_.contains(name)) continue;
    findings_.blame(static_cast<int>(key.source().begin.line),
                    fmt::format("unknown key '{}'; the nearest known one here is '{}'",
                                printable(full(name)), nearest(name, asked_)));
  }
}

}  // namespace posed::config
