#include "drivers/described/toml_reader.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "proto/clip/text.hpp"
#include "proto/text/clean.hpp"

namespace posed::drivers::described {
namespace {

std::string listed(std::span<const std::string_view> words) {
  std::string all;
  for (const std::string_view word : words) {
    if (!all.empty()) all += ", ";
    all += word;
  }
  return all;
}

}  // namespace

void TomlReader::allow(const toml::table& table, std::string_view what,
                       std::span<const std::string_view> keys) {
  for (const auto& [key, node] : table) {
    if (std::ranges::find(keys, key.str()) == keys.end()) {
      add_error(node, in_quotes(key.str()) + " is not known in " + std::string(what) +
                          "; allowed: " + listed(keys));
    }
  }
}

std::string TomlReader::text(const toml::table& table, std::string_view key,
                             const std::string& without) {
  const toml::node* const node = table.get(key);
  if (node == nullptr) return without;
  if (!node->is_string()) add_error(*node, in_quotes(key) + " is a text in quotes");
  return node->value_or(std::string(without));
}

std::int64_t TomlReader::whole(const toml::table& table, std::string_view key, std::int64_t without,
                               std::int64_t low, std::int64_t high) {
  const toml::node* const node = table.get(key);
  if (node == nullptr) return without;
  const auto value = node->is_integer() ? node->value<std::int64_t>() : std::nullopt;
  if (value && *value >= low && *value <= high) return *value;
  add_error(*node, in_quotes(key) + " is a whole number from " + std::to_string(low) + " to " +
                       std::to_string(high));
  return without;
}

double TomlReader::number(const toml::table& table, std::string_view key, double without,
                          double low, double high) {
  const toml::node* const node = table.get(key);
  if (node == nullptr) return without;
  const auto value = node->is_number() ? node->value<double>() : std::nullopt;
  if (value && *value >= low && *value <= high) return *value;
  add_error(*node, in_quotes(key) + " is a number from " + clip::number_text(low) + " to " +
                       clip::number_text(high));
  return without;
}

std::size_t TomlReader::word(const toml::table& table, std::string_view key,
                             std::span<const std::string_view> words, std::size_t without) {
  const toml::node* const node = table.get(key);
  if (node == nullptr) return without;
  const auto at = std::ranges::find(words, node->value_or(std::string_view()));
  if (at != words.end()) return static_cast<std::size_t>(at - words.begin());
  add_error(*node, in_quotes(key) + " is one of: " + listed(words));
  return without;
}

std::vector<std::byte> TomlReader::hex(const toml::table& table, std::string_view key,
                                       std::size_t most) {
  std::vector<std::byte> bytes;
  const toml::node* const node = table.get(key);
  if (node == nullptr) return bytes;
  const std::string digits = node->value_or(std::string("?"));
  const char* at = digits.data();
  const char* const end = at + digits.size();
  bool good = true;
  while (good && at != end) {
    if (*at == ' ') {
      ++at;
      continue;
    }
    unsigned value = 0;
    const auto [stop, error] = std::from_chars(at, std::min(at + 2, end), value, 16);
    good = error == std::errc() && stop == at + 2;
    bytes.push_back(static_cast<std::byte>(value));
    at = stop;
  }
  if (good && bytes.size() <= most) return bytes;
  add_error(*node, in_quotes(key) + " is up to " + std::to_string(most) +
                       " bytes of two hexadecimal digits each, as \"24 0a 57\"");
  return {};
}

std::optional<std::pair<double, double>> TomlReader::pair(const toml::table& table,
                                                          std::string_view key) {
  const toml::node* const node = table.get(key);
  if (node == nullptr) return std::nullopt;
  if (const toml::array* const array = node->as_array(); array != nullptr && array->size() == 2) {
    const auto low = (*array)[0].value<double>();
    const auto high = (*array)[1].value<double>();
    if (low && high && std::abs(*low) <= 1e12 && std::abs(*high) <= 1e12 && *low != *high) {
      return std::pair(*low, *high);
    }
  }
  add_error(*node, in_quotes(key) + " is two different numbers, as [0, 1000]");
  return std::nullopt;
}

const toml::table* TomlReader::table(const toml::table& in, std::string_view key) {
  const toml::node* const node = in.get(key);
  if (node == nullptr) return nullptr;
  if (!node->is_table()) add_error(*node, in_quotes(key) + " is a table");
  return node->as_table();
}

}  // namespace posed::drivers::described
