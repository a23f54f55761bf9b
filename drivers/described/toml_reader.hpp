// TomlReader: reads checked values out of a TOML table; the first mistake is told with its line and
// what would have been right. Cold.
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

  // Blames the first key of `table` that is not among `keys`; `what` the table is ("a packet").
  void allow(const toml::table& table, std::string_view what,
             std::span<const std::string_view> keys);

  // The value of a key, or `without` when the key is not there or wrong (then blamed).
  [[nodiscard]] std::string text(const toml::table& table, std::string_view key,
                                 const std::string& without = {});
  [[nodiscard]] std::int64_t whole(const toml::table& table, std::string_view key,
                                   std::int64_t without, std::int64_t low, std::int64_t high);
  [[nodiscard]] double number(const toml::table& table, std::string_view key, double without,
                              double low, double high);
  // A word of a list; its place there.
  [[nodiscard]] std::size_t word(const toml::table& table, std::string_view key,
                                 std::span<const std::string_view> words, std::size_t without);
  // "24 0a 57": at most `most` bytes.
  [[nodiscard]] std::vector<std::byte> hex(const toml::table& table, std::string_view key,
                                           std::size_t most);
  // [low, high], the first below the second; nothing when the key is not there.
  [[nodiscard]] std::optional<std::pair<double, double>> pair(const toml::table& table,
                                                              std::string_view key);
  // The table of a key; null when it is not there.
  [[nodiscard]] const toml::table* table(const toml::table& in, std::string_view key);
};

}  // namespace posed::drivers::described
