// Findings: the mistakes found in one TOML file, and what the error for an unknown key suggests.
// Cold.
#pragma once

#include <cstddef>
#include <expected>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "proto/frame/result.hpp"

namespace posed {

inline constexpr std::size_t kMaxErrors = 100;  // more of one file are not listed

struct Findings {
  // The keys of table `copy` are those of table `original`, too. Advice about a key that both have
  // names the one of the two in which the key was found.
  struct Twins {
    std::string original, copy;
  };

  std::string file;
  ExitCode exit_code = ExitCode::kFailed;  // each error gets it
  std::vector<Error> errors{};             // in the order of reading
  // dotted paths of all keys that were looked up: "stream.style.alpha"
  std::set<std::string> known{};
  // Dotted paths of all keys that can exist, if known: the error for an unknown key can then name
  // the table where the key belongs.
  std::set<std::string> all_keys{};
  Twins twins{};

  // After kMaxErrors only one more error is added, which says that there are more.
  void add_error(int line, std::string_view message);

  // For an unknown key of `table`, where the keys `known_here` were looked up: the table where it
  // belongs, the key of which it is a misspelling, or all keys of this table.
  [[nodiscard]] std::string advice(std::string_view table, std::string_view key,
                                   const std::set<std::string>& known_here) const;

  // `value` if there are no errors; otherwise the one with the smallest line, for callers that
  // report a single error.
  template <typename T>
  Result<T> result(T value) const {
    if (errors.empty()) return value;
    return std::unexpected(first_error());
  }

 private:
  [[nodiscard]] const Error& first_error() const;
  // The tables other than `table` that may have the key.
  [[nodiscard]] std::vector<std::string> places_of(std::string_view table,
                                                   std::string_view key) const;
};

}  // namespace posed
