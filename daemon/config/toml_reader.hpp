// Typed reading of a TOML table that collects every mistake with its line instead of stopping at
// the first, and knows each key it was asked for: what it was never asked for is an unknown key.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "proto/frame/result.hpp"
#include "proto/text/toml.hpp"

namespace posed::config {

inline constexpr std::size_t kMaxErrors = 100;  // of one file

// What the reading of one file found out.
struct Findings {
  std::string file;
  std::vector<Error> errors;    // in the order of reading
  std::set<std::string> known;  // dotted paths of all keys asked for: "stream.style.alpha"
  // Dotted paths of every key there can be, where they are known: an unknown key that stands in the
  // wrong table is then told the right one.
  std::set<std::string> all_keys = {};

  // Beyond kMaxErrors only the first one counts, as "and more".
  void add_error(int line, std::string_view message);
};

struct Range {
  double min, max;
};

// One table. Values that are absent leave the default, wrong ones leave it too and are blamed. The
// tables must outlive the reader.
class TableReader {
 public:
  TableReader(const toml::table& table, std::string path, Findings& findings);

  [[nodiscard]] bool has(std::string_view key) const { return table_.contains(key); }
  [[nodiscard]] int line() const;                         // of the table's header
  [[nodiscard]] int line_of(std::string_view key) const;  // of the key's value, else the table's

  void read(const char* key, bool& value);
  void read(const char* key, std::int64_t& value);
  void read(const char* key, double& value, Range range);
  void read(const char* key, std::string& value);
  void read(const char* key, std::vector<std::string>& value);
  // The same, and blames the table when the key is not there.
  void require(const char* key, std::string& value);

  // The table or the array of tables under `key`; nothing when absent or of another type (blamed).
  [[nodiscard]] std::optional<TableReader> table(const std::string& key);
  // More than `most` tables are blamed and none is read.
  [[nodiscard]] std::vector<TableReader> tables(const std::string& key, std::size_t most);

  void add_error(std::string_view key, const std::string& message);  // at the key's line
  // Blames every key that was never asked for, with the table that it belongs to, the key that it
  // is a misspelling of, or all keys of this table.
  void finish();

 private:
  // The node of a key, noted as known; null when absent.
  const toml::node* find(std::string_view key);
  void add_type_error(const toml::node& node, std::string_view key, const std::string& wanted);
  [[nodiscard]] std::string full(std::string_view key) const;
  [[nodiscard]] std::string advice(const std::string& unknown_key) const;

  const toml::table& table_;
  std::string path_;  // "stream.style"; empty for the file itself
  Findings& findings_;
  std::set<std::string> asked_;
};

}  // namespace posed::config
