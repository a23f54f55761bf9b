// Wraps SQLite for the log's writer and reader, with Result for errors. One thread; cold.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "proto/frame/result.hpp"
#include "proto/log/checksum.hpp"

struct sqlite3;
struct sqlite3_stmt;

namespace posed::log {

// A prepared statement; must not outlive its Database. Bound text and bytes are not copied and must
// stay valid until the next reset().
class Statement {
 public:
  Statement(sqlite3_stmt* statement, std::string file);

  // Binds the next parameter; the first one after each reset().
  Statement& bind(std::int64_t value);
  Statement& bind(std::string_view text);
  Statement& bind(std::span<const std::byte> bytes);
  // Binds the checksum of all parameters bound since the last reset().
  Statement& bind_checksum();

  // True: a row is available. False: there are no more rows, until reset().
  Result<bool> step();
  // For statements without rows: runs step(), then reset().
  Result<> execute();
  void reset();

  // Columns of the current row; views are valid until the next step() or reset().
  [[nodiscard]] std::int64_t integer(int column) const;
  [[nodiscard]] double real(int column) const;
  [[nodiscard]] std::string_view text(int column) const;
  [[nodiscard]] std::span<const std::byte> bytes(int column) const;
  // True when the row's last column is the checksum of all columns before it. Call it before
  // reading the columns: SQLite converts them in place to the requested type.
  [[nodiscard]] bool checksum_matches() const;

 private:
  struct Finalize {
    void operator()(sqlite3_stmt* statement) const;
  };
  std::unique_ptr<sqlite3_stmt, Finalize> statement_;
  std::string file_;
  int next_parameter_ = 1;
  Checksum bound_;
  bool done_ = false;
};

class Database {
 public:
  enum class Mode : std::uint8_t { kCreate, kReadWrite, kRead };
  static Result<Database> open(const std::filesystem::path& path, Mode mode);

  // Runs any number of statements without parameters and discards their rows.
  Result<> run(const char* sql);
  Result<Statement> prepare(std::string_view sql);
  // Returns the first column of the first row of `sql`, as SQLite prints it.
  Result<std::string> value(std::string_view sql);

  [[nodiscard]] std::int64_t last_insert_id() const;
  // Sets how long to wait for another process that holds the file.
  void set_busy_timeout_ms(int patience_ms);
  // Discards everything written since the last commit; harmless when there is nothing.
  void rollback();

 private:
  struct Close {
    void operator()(sqlite3* handle) const;
  };
  Database(sqlite3* handle, std::string file) : handle_(handle), file_(std::move(file)) {}

  std::unique_ptr<sqlite3, Close> handle_;
  std::string file_;
};

}  // namespace posed::log
