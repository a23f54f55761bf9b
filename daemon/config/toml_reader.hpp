// Typed reading of a TOML table. It collects every error with its line instead of stopping at the
// first. It remembers which keys were looked up; all others are reported as unknown.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "proto/frame/result.hpp"
#include "proto/text/parameter.hpp"
#include "proto/text/toml.hpp"

namespace posed::config {

inline constexpr std::size_t kMaxErrors = 100;  // of one file

// The results of reading one file.
struct Findings {
  std::string file;
  std::vector<Error> errors;  // in the order of reading
  // dotted paths of all keys that were looked up: "stream.style.alpha"
  std::set<std::string> known;
  // Dotted paths of all keys that can exist, if known: the error for an unknown key can then name
  // the table where the key belongs.
  std::set<std::string> all_keys = {};

  // After kMaxErrors only one more error is added: "and more".
  void add_error(int line, std::string_view message);
};

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
  [[nodiscard]] int line() const;  // of the table's header
  // of the key's value, or of the table if the key is absent
  [[nodiscard]] int line_of(std::string_view key) const;

  void read(const char* key, bool& value);
  void read(const char* key, int& value, Range range);
  void read(const char* key, double& value, Range range);
  void read(const char* key, std::string& value);
  // Under the name and in the unit that people use.
  void read(const ParameterSpec& spec, ParameterValue& value);
  void read(const char* key, std::vector<std::string>& value);
  // The same, but adds an error if the key is absent.
  void require(const char* key, std::string& value);

  // The table or the array of tables under `key`; empty if it is absent or of another type (which
  // adds an error).
  [[nodiscard]] std::optional<TableReader> table(const std::string& key);
  // If there are more than `most` tables, adds an error and reads none.
  [[nodiscard]] std::vector<TableReader> tables(const std::string& key, std::size_t most);

  // For a key that must not stand here, if there is a better error than that it is unknown.
  void skip(std::string_view key) {
    if (has(key)) asked_.emplace(key);
  }

  void add_error(std::string_view key, const std::string& message);  // with the key's line
  // Adds an error for every key that was not looked up. It names the table where the key belongs,
  // the key of which it is a misspelling, or all keys of this table.
  void finish();

 private:
  // The node of a key, which becomes known; null if absent.
  const toml::node* find(std::string_view key);
  void add_type_error(const toml::node& node, std::string_view key, const std::string& wanted);
  [[nodiscard]] std::string full(std::string_view key) const;
  // The other tables that may have a key of this name.
  [[nodiscard]] std::vector<std::string> places_of(const std::string& key) const;
  [[nodiscard]] std::string advice(const std::string& unknown_key) const;

  const toml::table& table_;
  std::string path_;  // "stream.style"; empty for the file itself
  Findings& findings_;
  std::set<std::string> asked_;
};

}  // namespace posed::config
