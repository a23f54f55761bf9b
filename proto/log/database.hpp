// SQLite behind Result: what the log's writer and reader share. One thread; cold.
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

// A prepared statement; must not outlive its Database. Bound text and bytes are not copied: they
// must live until the next reset().
class Statement {
 public:
  Statement(sqlite3_stmt* statement, std::string file);

  // Binds the next parameter, from the first after each reset().
  Statement& bind(std::int64_t value);
  Statement& bind(std::string_view text);
  Statement& bind(std::span<const std::byte> bytes);
  // The checksum of what was bound since the last reset().
  Statement& bind_checksum();

  // True: a row stands ready. False: done, and so for every call until reset().
  [[nodiscard]] Result<bool> step();
  // For statements without rows: step, then reset.
  [[nodiscard]] Result<> execute();
  void reset();

  // Columns of the row that stands ready; views are valid until the next step() or reset().
  [[nodiscard]] std::int64_t integer(int column) const;
  [[nodiscard]] double real(int column) const;
  [[nodiscard]] std::string_view text(int column) const;
  [[nodiscard]] std::span<const std::byte> bytes(int column) const;
  // Whether the row's last column is the checksum of all before it. Call it before the columns are
  // read: SQLite converts them in place to what is asked for.
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
  [[nodiscard]] static Result<Database> open(const std::filesystem::path& path, Mode mode);

  // Any number of statements without parameters; their rows are thrown away.
  [[nodiscard]] Result<> run(const char* sql);
  [[nodiscard]] Result<Statement> prepare(std::string_view sql);
  // The first column of the first row of `sql`, as SQLite prints it.
  [[nodiscard]] Result<std::string> value(std::string_view sql);

  [[nodiscard]] std::int64_t last_insert_id() const;
  // How long to wait for another process that holds the file.
  void set_patience_ms(int patience_ms);
  // Undoes what was written since the last commit; fine when there is nothing.
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
