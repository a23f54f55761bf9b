#include "daemon/config/toml_reader.hpp"

#include <array>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/text/clean.hpp"
#include "proto/text/nearest_word.hpp"

namespace posed::config {
namespace {

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

constexpr std::string_view kSource = "source";
constexpr std::string_view kStream = "stream";

bool is_within(std::string_view table, std::string_view top) {
  return table.starts_with(top) && (table.size() == top.size() || table[top.size()] == '.');
}

// "stream.style" for "source.style"; empty for a table of another name.
std::string replace_top(std::string_view table, std::string_view from, std::string_view to) {
  if (!is_within(table, from)) return {};
  return std::string(to) + std::string(table.substr(from.size()));
}

int line_of_node(const toml::node& node) { return static_cast<int>(node.source().begin.line); }

}  // namespace

void Findings::add_error(int line, std::string_view message) {
  if (errors.size() > kMaxErrors) return;
  const bool last = errors.size() == kMaxErrors;
  errors.push_back({last ? "and there are more mistakes; mend these first" : clean(message), file,
                    line, ExitCode::kWrongUse});
}

TableReader::TableReader(const toml::table& table, std::string path, Findings& findings)
    : table_(table), path_(std::move(path)), findings_(findings) {}

int TableReader::line() const { return line_of_node(table_); }

int TableReader::line_of(std::string_view key) const {
  const toml::node* node = table_.get(key);
  return node == nullptr ? line() : line_of_node(*node);
}

bool TableReader::has_text(std::string_view key) const {
  const toml::node* node = table_.get(key);
  return node != nullptr && node->is_string();
}

std::string TableReader::full(std::string_view key) const {
  return path_.empty() ? std::string(key) : path_ + "." + std::string(key);
}

const toml::node* TableReader::find(std::string_view key) {
  asked_.emplace(key);
  findings_.known.insert(full(key));
  return table_.get(key);
}

void TableReader::add_error(std::string_view key, const std::string& message) {
  findings_.add_error(line_of(key), message);
}

void TableReader::add_type_error(const toml::node& node, std::string_view key,
                                 const std::string& wanted) {
  findings_.add_error(line_of_node(node),
                      fmt::format("{} must be {}, not {}", full(key), wanted, kind_of(node)));
}

void TableReader::read(const char* key, bool& value) {
  const toml::node* node = find(key);
  if (node == nullptr) return;
  if (const auto* flag = node->as_boolean()) {
    value = flag->get();
  } else {
    add_type_error(*node, key, "true or false");
  }
}

void TableReader::read(const char* key, int& value, Range range) {
  const toml::node* node = find(key);
  if (node == nullptr) return;
  const auto* integer = node->as_integer();
  if (integer == nullptr) return add_type_error(*node, key, "an integer");
  const auto number = static_cast<double>(integer->get());
  if (number >= range.min && number <= range.max) {
    value = static_cast<int>(integer->get());
    return;
  }
  add_error(key, out_of_range(full(key), number, range.min, range.max, true));
}

void TableReader::read(const char* key, double& value, Range range) {
  const toml::node* node = find(key);
  if (node == nullptr) return;
  if (!node->is_number()) return add_type_error(*node, key, "a number" + unit_words(key));
  const double number = *node->value<double>();
  if (number >= range.min && number <= range.max) {
    value = number;
    return;
  }
  add_error(key, out_of_range(full(key), number, range.min, range.max));
}

void TableReader::read(const ParameterSpec& spec, ParameterValue& value) {
  const std::string key(spec.shown_name());
  const toml::node* node = find(key);
  if (node == nullptr) return;
  ParameterValue given;
  if (const auto* flag = node->as_boolean()) given = flag->get();
  if (const auto* integer = node->as_integer()) given = integer->get();
  if (const auto* number = node->as_floating_point()) given = number->get();
  if (const auto* text = node->as_string()) given = text->get();
  if (!node->is_value() || node->is_date() || node->is_time() || node->is_date_time()) {
    return add_type_error(*node, key, "a single value");
  }
  auto checked = from_people(spec, given, full(key));
  if (!checked) return add_error(key, checked.error().message);
  value = std::move(*checked);
}

void TableReader::read(const char* key, std::string& value) {
  const toml::node* node = find(key);
  if (node == nullptr) return;
  if (const auto* text = node->as_string()) {
    value = text->get();
  } else {
    add_type_error(*node, key, "text in quotes");
  }
}

void TableReader::read(const char* key, std::vector<std::string>& value) {
  const toml::node* node = find(key);
  if (node == nullptr) return;
  const toml::array* list = node->as_array();
  if (list == nullptr) return add_type_error(*node, key, "a list of texts");
  value.clear();
  for (const toml::node& element : *list) {
    if (const auto* text = element.as_string()) {
      value.push_back(text->get());
    } else {
      add_type_error(element, key, "a list of texts");
    }
  }
}

void TableReader::require(const char* key, std::string& value) {
  if (find(key) == nullptr) {
    findings_.add_error(line(), fmt::format("{} is missing; give it a text in quotes", full(key)));
    return;
  }
  read(key, value);
}

std::optional<TableReader> TableReader::table(const std::string& key) {
  const toml::node* node = find(key);
  if (node == nullptr) return std::nullopt;
  if (const toml::table* table = node->as_table()) return TableReader(*table, full(key), findings_);
  add_type_error(*node, key, "a table ([" + full(key) + "])");
  return std::nullopt;
}

std::vector<TableReader> TableReader::tables(const std::string& key, std::size_t most) {
  std::vector<TableReader> readers;
  const toml::node* node = find(key);
  if (node == nullptr) return readers;
  const toml::array* list = node->as_array();
  if (list == nullptr || !list->is_homogeneous<toml::table>()) {
    add_type_error(*node, key, "a list of tables ([[" + full(key) + "]])");
    return readers;
  }
  if (list->size() > most) {
    add_error(key, fmt::format("there are {} [[{}]] tables; posed takes at most {}", list->size(),
                               full(key), most));
    return readers;
  }
  for (const toml::node& element : *list) {
    readers.emplace_back(*element.as_table(), full(key), findings_);
  }
  return readers;
}

std::vector<std::string> TableReader::places_of(const std::string& key) const {
  std::set<std::string> tables;
  for (const std::string& path : findings_.all_keys) {
    const std::size_t dot = path.rfind('.');
    if (dot == std::string::npos || path.substr(dot + 1) != key) continue;
    if (path.substr(0, dot) != path_) tables.insert(path.substr(0, dot));
  }
  // A source repeats a stream's settings. A key that both know belongs to the one that this is.
  std::vector<std::string> places;
  const bool in_source = is_within(path_, kSource);
  for (const std::string& table : tables) {
    const bool of_source = is_within(table, kSource);
    const std::string twin =
        of_source ? replace_top(table, kSource, kStream) : replace_top(table, kStream, kSource);
    if (of_source == in_source || !tables.contains(twin)) places.push_back("[" + table + "]");
  }
  return places;
}

std::string TableReader::advice(const std::string& unknown_key) const {
  constexpr std::size_t kMaxPlaces = 3;
  const std::vector<std::string> places = places_of(unknown_key);
  // If several tables can have such a key, prefer those that this file has.
  std::vector<std::string> present = places;
  std::erase_if(present, [this](const std::string& place) {
    const std::string within = place.substr(1, place.size() - 2) + ".";
    const auto next = findings_.known.lower_bound(within);
    return next == findings_.known.end() || !next->starts_with(within);
  });
  const auto& meant = present.empty() ? places : present;
  if (!meant.empty() && meant.size() <= kMaxPlaces) {
    return fmt::format("it belongs into {}", fmt::join(meant, " or "));
  }
  const std::string near = nearest(unknown_key, asked_);
  if (!near.empty()) return fmt::format("the nearest known one here is '{}'", near);
  return fmt::format("known here: {}", fmt::join(asked_, ", "));
}

void TableReader::finish() {
  for (const auto& [key, node] : table_) {
    const std::string name(key.str());
    if (asked_.contains(name)) continue;
    findings_.add_error(static_cast<int>(key.source().begin.line),
                        fmt::format("unknown key {}; {}", in_quotes(full(name)), advice(name)));
  }
}

}  // namespace posed::config
