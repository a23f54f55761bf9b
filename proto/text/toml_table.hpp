// TableReader: the only way to read values of a TOML table. It checks types and ranges, and
// collects every error with its line in Findings instead of stopping at the first. It remembers
// which keys were looked up; all others are reported as unknown. Cold.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "proto/text/findings.hpp"
#include "proto/text/parameter.hpp"
#include "proto/text/toml.hpp"

namespace posed {

struct Range {
  double min, max;
};

// One table. If a value is absent or wrong, the default stays; for a wrong one an error is added.
// The tables must outlive the reader.
class TableReader {
 public:
  TableReader(const toml::table& table, std::string path, Findings& findings);

  [[nodiscard]] const std::string& path() const { return path_; }
  [[nodiscard]] bool has(std::string_view key) const { return table_.contains(key); }
  [[nodiscard]] bool has_text(std::string_view key) const;
  // All keys in alphabetical order, for a table whose keys are free.
  [[nodiscard]] std::vector<std::string> keys() const;
  [[nodiscard]] int line() const;  // where the table's header stands
  // of the key's value, or of the table if the key is absent
  [[nodiscard]] int line_of(std::string_view key) const;

  void read(std::string_view key, bool& value);
  void read(std::string_view key, int& value, Range range);
  void read(std::string_view key, double& value, Range range);
  void read(std::string_view key, std::string& value);
  // Under the name and in the unit that people use.
  void read(const ParameterSpec& spec, ParameterValue& value);
  void read(std::string_view key, std::vector<std::string>& value);
  void read(std::string_view key, std::vector<std::uint32_t>& value);
  // Adds an error if the key is absent, with what to write, and returns whether it is there.
  bool need(std::string_view key, std::string_view remedy);
  void require(std::string_view key, std::string& value);  // need() and read()

  // The place of the text among `words`; 0, that of the default, if it is absent or wrong.
  [[nodiscard]] std::size_t choice(std::string_view key, std::span<const std::string_view> words);
  // "24 0a 57": at most `most` bytes; empty if absent or wrong.
  [[nodiscard]] std::vector<std::byte> hex(std::string_view key, std::size_t most);
  // A list of so many numbers; nothing if absent or wrong.
  template <std::size_t kCount>
  [[nodiscard]] std::optional<std::array<double, kCount>> numbers(std::string_view key,
                                                                  Range range) {
    const toml::node* node = find(key);
    std::array<double, kCount> values{};
    if (node == nullptr || !read_numbers(*node, key, values, range)) return std::nullopt;
    return values;
  }
  // A list of any number of pairs, [[1, 2], [3, 4]]; nothing if absent or wrong.
  using Pairs = std::vector<std::array<double, 2>>;
  [[nodiscard]] std::optional<Pairs> pairs(std::string_view key, Range range);

  // The table or the list of tables under `key`; empty if it is absent or of another type (which
  // adds an error).
  [[nodiscard]] std::optional<TableReader> table(std::string_view key);
  // If there are more than `most` tables, adds an error and reads none.
  [[nodiscard]] std::vector<TableReader> tables(std::string_view key, std::size_t most);

  // For a key that must not stand here, if there is a better error than that it is unknown.
  void skip(std::string_view key) {
    if (has(key)) asked_.emplace(key);
  }

  void add_error(std::string_view key, std::string_view message);  // with the key's line
  // Adds an error for every key that was not looked up.
  void finish();

 private:
  // The node of a key, which becomes known; null if absent.
  const toml::node* find(std::string_view key);
  // As above for a list; null also if the value is no list, which is an error.
  const toml::array* find_list(std::string_view key, const std::string& wanted);
  // The number, or nothing and an error.
  std::optional<double> number(const toml::node& node, std::string_view key, Range range,
                               bool whole = false);
  bool read_numbers(const toml::node& node, std::string_view key, std::span<double> values,
                    Range range);
  void add_type_error(const toml::node& node, std::string_view key, const std::string& wanted);
  [[nodiscard]] std::string full(std::string_view key) const;
  [[nodiscard]] std::string shown(std::string_view key) const;  // as full(), for an error

  const toml::table& table_;
  std::string path_;  // "stream.style"; empty for the file itself
  Findings& findings_;
  std::set<std::string> asked_;
};

}  // namespace posed
