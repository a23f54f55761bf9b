// Modifies a finished device log. After run_sql() alone the rows' checksums reveal the change;
// after reseal() they are right again, and only the content is wrong.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <sqlite3.h>
#include <catch2/catch.hpp>

#include "proto/log/database.hpp"

namespace posed::test {

// Runs `each` with an open connection.
template <typename Each>
void with_log(const std::filesystem::path& path, Each&& each) {
  sqlite3* handle = nullptr;
  REQUIRE(sqlite3_open(path.c_str(), &handle) == SQLITE_OK);
  each(handle);
  sqlite3_close(handle);
}

inline void run_sql(sqlite3* handle, const std::string& sql) {
  INFO(sql);
  REQUIRE(sqlite3_exec(handle, sql.c_str(), nullptr, nullptr, nullptr) == SQLITE_OK);
}

inline void run_sql(const std::filesystem::path& path, const std::string& sql) {
  with_log(path, [&](sqlite3* handle) { run_sql(handle, sql); });
}

// Recomputes the checksum of every row of a table whose last column is `crc`.
inline void reseal(sqlite3* handle, const std::string& table) {
  sqlite3_stmt* select = nullptr;
  REQUIRE(sqlite3_prepare_v2(handle, ("SELECT * FROM " + table).c_str(), -1, &select, nullptr) ==
          SQLITE_OK);
  std::vector<std::pair<std::int64_t, std::int64_t>> sums;  // id, crc
  while (sqlite3_step(select) == SQLITE_ROW) {
    log::Checksum sum;
    for (int i = 0; i < sqlite3_column_count(select) - 1; ++i) {
      if (sqlite3_column_type(select, i) == SQLITE_INTEGER) {
        sum.add(sqlite3_column_int64(select, i));
        continue;
      }
      const auto* data = static_cast<const std::byte*>(sqlite3_column_blob(select, i));
      sum.add(std::span(data, static_cast<std::size_t>(sqlite3_column_bytes(select, i))));
    }
    sums.emplace_back(sqlite3_column_int64(select, 0), sum.value());
  }
  sqlite3_finalize(select);
  for (const auto& [id, crc] : sums) {
    run_sql(handle, "UPDATE " + table + " SET crc=" + std::to_string(crc) +
                        " WHERE id=" + std::to_string(id));
  }
}

// Changes the content and recomputes the checksums, as if the writer had written it so.
inline void forge(const std::filesystem::path& path, const std::string& sql) {
  with_log(path, [&](sqlite3* handle) {
    run_sql(handle, sql);
    for (const char* table : {"source", "stream", "chunk", "decision", "frame", "gap", "take"}) {
      reseal(handle, table);
    }
  });
}

}  // namespace posed::test
