#include "proto/text/toml_table.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <limits>
#include <utility>

#include "proto/text/clean.hpp"
#include "proto/text/nearest_word.hpp"

namespace posed {
namespace {

std::string kind_of(const toml::node& node) {
  switch (node.type()) {
    case toml::node_type::table:
      return "a table";
    case toml::node_type::array:
      if (node.is_array_of_tables()) return "a list of tables";
      return "a list of " + std::to_string(node.as_array()->size());
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

// The bytes of "24 0a 57"; nothing if the text is anything else.
std::optional<std::vector<std::byte>> bytes_of(std::string_view digits) {
  std::vector<std::byte> bytes;
  while (!digits.empty()) {
    if (digits[0] == ' ') {
      digits.remove_prefix(1);
      continue;
    }
    const std::string_view two = digits.substr(0, 2);
    unsigned value = 0;
    const auto [stop, error] = std::from_chars(two.data(), two.data() + two.size(), value, 16);
    if (error != std::errc() || stop != two.data() + 2) return std::nullopt;
    bytes.push_back(static_cast<std::byte>(value));
    digits.remove_prefix(2);
  }
  return bytes;
}

// "a=0.6,b=0.4" of the table {a = 0.6, b = 0.4}; nothing for a node that is none.
std::optional<std::string> named_numbers(const toml::node& node) {
  const toml::table* table = node.as_table();
  if (table == nullptr || table->empty()) return std::nullopt;
  std::string text;
  for (const auto& [name, entry] : *table) {
    const auto number = entry.value<double>();
    if (!number || !entry.is_number()) return std::nullopt;
    std::array<char, 32> digits{};
    const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), *number).ptr;
    text +=
        (text.empty() ? "" : ",") + std::string(name.str()) + "=" + std::string(digits.data(), end);
  }
  return text;
}

}  // namespace

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

std::vector<std::string> TableReader::keys() const {
  std::vector<std::string> keys;
  for (const auto& [key, node] : table_) keys.emplace_back(key.str());
  return keys;
}

std::string TableReader::full(std::string_view key) const {
  return path_.empty() ? std::string(key) : path_ + "." + std::string(key);
}

std::string TableReader::shown(std::string_view key) const { return clean_name(full(key)); }

const toml::node* TableReader::find(std::string_view key) {
  asked_.emplace(key);
  findings_.known.insert(full(key));
  return table_.get(key);
}

const toml::array* TableReader::find_list(std::string_view key, const std::string& wanted) {
  const toml::node* node = find(key);
  if (node == nullptr) return nullptr;
  if (!node->is_array()) add_type_error(*node, key, wanted);
  return node->as_array();
}

void TableReader::add_error(std::string_view key, std::string_view message) {
  findings_.add_error(line_of(key), message);
}

void TableReader::add_type_error(const toml::node& node, std::string_view key,
                                 const std::string& wanted) {
  findings_.add_error(line_of_node(node),
                      shown(key) + " must be " + wanted + ", not " + kind_of(node));
}

std::optional<double> TableReader::number(const toml::node& node, std::string_view key, Range range,
                                          bool whole) {
  if (whole ? !node.is_integer() : !node.is_number()) {
    add_type_error(node, key, whole ? "an integer" : "a number" + unit_words(key));
    return std::nullopt;
  }
  // Not value<double>(), which gives nothing for an integer that a double cannot hold exactly.
  const double number = node.is_integer() ? static_cast<double>(node.as_integer()->get())
                                          : node.as_floating_point()->get();
  if (number >= range.min && number <= range.max) return number;
  findings_.add_error(line_of_node(node),
                      out_of_range(shown(key), number, range.min, range.max, whole));
  return std::nullopt;
}

bool TableReader::read_numbers(const toml::node& node, std::string_view key,
                               std::span<double> values, Range range) {
  const toml::array* list = node.as_array();
  if (list == nullptr || list->size() != values.size()) {
    add_type_error(node, key, "a list of " + std::to_string(values.size()) + " numbers");
    return false;
  }
  for (std::size_t i = 0; i < values.size(); ++i) {
    const auto read = number(*list->get(i), key, range);
    if (!read) return false;
    values[i] = *read;
  }
  return true;
}

void TableReader::read(std::string_view key, bool& value) {
  const toml::node* node = find(key);
  if (node == nullptr) return;
  if (const auto* flag = node->as_boolean()) {
    value = flag->get();
  } else {
    add_type_error(*node, key, "true or false");
  }
}

void TableReader::read(std::string_view key, int& value, Range range) {
  const toml::node* node = find(key);
  if (node == nullptr) return;
  if (const auto read = number(*node, key, range, true)) value = static_cast<int>(*read);
}

void TableReader::read(std::string_view key, double& value, Range range) {
  const toml::node* node = find(key);
  if (node == nullptr) return;
  if (const auto read = number(*node, key, range)) value = *read;
}

void TableReader::read(const ParameterSpec& spec, ParameterValue& value) {
  const std::string key(spec.shown_name());
  const toml::node* node = find(key);
  if (node == nullptr) return;
  const bool is_live_text = spec.live && !has_number(spec);
  if (const auto text = is_live_text ? named_numbers(*node) : std::nullopt) {
    value = *text;
    return;
  }
  ParameterValue given;
  if (const auto* flag = node->as_boolean()) given = flag->get();
  if (const auto* integer = node->as_integer()) given = integer->get();
  if (const auto* number = node->as_floating_point()) given = number->get();
  if (const auto* text = node->as_string()) given = text->get();
  if (!node->is_value() || node->is_date() || node->is_time() || node->is_date_time()) {
    return add_type_error(*node, key, "a single value");
  }
  auto checked = from_display(spec, given, full(key));
  if (!checked) return add_error(key, checked.error().message);
  value = std::move(*checked);
}

void TableReader::read(std::string_view key, std::string& value) {
  const toml::node* node = find(key);
  if (node == nullptr) return;
  if (const auto* text = node->as_string()) {
    value = text->get();
  } else {
    add_type_error(*node, key, "text in quotes");
  }
}

void TableReader::read(std::string_view key, std::vector<std::string>& value) {
  const toml::array* list = find_list(key, "a list of texts");
  if (list == nullptr) return;
  value.clear();
  for (const toml::node& element : *list) {
    if (const auto* text = element.as_string()) {
      value.push_back(text->get());
    } else {
      add_type_error(element, key, "a list of texts");
    }
  }
}

void TableReader::read(std::string_view key, std::vector<std::uint32_t>& value) {
  const toml::array* list = find_list(key, "a list of integers");
  if (list == nullptr) return;
  value.clear();
  for (const toml::node& element : *list) {
    const auto read = number(element, key, {0, std::numeric_limits<std::uint32_t>::max()}, true);
    if (read) value.push_back(static_cast<std::uint32_t>(*read));
  }
}

bool TableReader::need(std::string_view key, std::string_view remedy) {
  if (find(key) != nullptr) return true;
  findings_.add_error(line(), shown(key) + " is missing; " + std::string(remedy));
  return false;
}

void TableReader::require(std::string_view key, std::string& value) {
  if (need(key, "give it a text in quotes")) read(key, value);
}

std::size_t TableReader::choice(std::string_view key, std::span<const std::string_view> words) {
  const toml::node* node = find(key);
  if (node == nullptr) return 0;
  const auto found = std::ranges::find(words, node->value_or(std::string_view()));
  if (found != words.end()) return found - words.begin();
  add_error(key, shown(key) + " must be one of these words in quotes: " + listed(words, ", "));
  return 0;
}

std::vector<std::byte> TableReader::hex(std::string_view key, std::size_t most) {
  const toml::node* node = find(key);
  if (node == nullptr) return {};
  auto bytes = bytes_of(node->value_or(std::string_view("no text")));
  if (bytes && bytes->size() <= most) return std::move(*bytes);
  add_error(key, shown(key) + " must be up to " + std::to_string(most) +
                     " bytes of two hexadecimal digits each, as \"24 0a 57\"");
  return {};
}

std::optional<TableReader::Pairs> TableReader::pairs(std::string_view key, Range range) {
  const toml::array* list = find_list(key, "a list of pairs of numbers ([[0, 1], [2, 3]])");
  if (list == nullptr) return std::nullopt;
  Pairs pairs;
  for (const toml::node& element : *list) {
    if (!read_numbers(element, key, pairs.emplace_back(), range)) return std::nullopt;
  }
  return pairs;
}

std::optional<TableReader> TableReader::table(std::string_view key) {
  const toml::node* node = find(key);
  if (node == nullptr) return std::nullopt;
  if (const toml::table* table = node->as_table()) return TableReader(*table, full(key), findings_);
  add_type_error(*node, key, "a table ([" + shown(key) + "])");
  return std::nullopt;
}

std::vector<TableReader> TableReader::tables(std::string_view key, std::size_t most) {
  std::vector<TableReader> readers;
  const toml::node* node = find(key);
  if (node == nullptr) return readers;
  const toml::array* list = node->as_array();
  if (list == nullptr || !(list->empty() || list->is_array_of_tables())) {
    add_type_error(*node, key, "a list of tables ([[" + shown(key) + "]])");
    return readers;
  }
  if (list->size() > most) {
    add_error(key, "there are " + std::to_string(list->size()) + " [[" + shown(key) +
                       "]] tables; posed takes at most " + std::to_string(most));
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
    findings_.add_error(
        static_cast<int>(key.source().begin.line),
        "unknown key " + in_quotes(full(name)) + "; " + findings_.advice(path_, name, asked_));
  }
}

}  // namespace posed
