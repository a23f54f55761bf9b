// TomlReader: reads checked values from a TOML table. Reports the first error with its line and the
// allowed values. Cold.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "proto/text/toml.hpp"

namespace posed::drivers::described {

class TomlReader : public FirstError {
 public:
  using FirstError::FirstError;

  // Reports the first key of `table` that is not among `keys`; `what` names the table ("a packet").
  void allow(const toml::table& table, std::string_view what,
             std::span<const std::string_view> keys);

  // The value of a key, or `without` when the key is missing or invalid (which is reported).
  [[nodiscard]] std::string text(const toml::table& table, std::string_view key,
                                 const std::string& without = {});
  [[nodiscard]] std::int64_t whole(const toml::table& table, std::string_view key,
                                   std::int64_t without, std::int64_t low, std::int64_t high);
  [[nodiscard]] double number(const toml::table& table, std::string_view key, double without,
                              double low, double high);
  // Reads one word of a list and returns its index in the list.
  [[nodiscard]] std::size_t word(const toml::table& table, std::string_view key,
                                 std::span<const std::string_view> words, std::size_t without);
  // "24 0a 57": at most `most` bytes.
  [[nodiscard]] std::vector<std::byte> hex(const toml::table& table, std::string_view key,
                                           std::size_t most);
  // [low, high], the first below the second; empty when the key is missing.
  [[nodiscard]] std::optional<std::pair<double, double>> pair(const toml::table& table,
                                                              std::string_view key);
  // The table under a key; null when it is missing.
  [[nodiscard]] const toml::table* table(const toml::table& in, std::string_view key);
};

}  // namespace posed::drivers::described
