// Wraps SQLite for the log's writer and reader, with Result for errors. One thread; cold.
//
// A log is data from anywhere. What SQLite could run of it is off or refused, no statement may take
// longer than the size of the file explains, and the memory of all logs of the process is limited.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include <zlib.h>

#include "proto/frame/result.hpp"

struct sqlite3;
struct sqlite3_stmt;

namespace posed::log {

std::unexpected<Error> damaged(const std::string& file, const std::string& how);

// The work that one step of a statement, or one run of statements, may cost: what the size of the
// file explains.
class Budget {
 public:
  explicit Budget(std::string file) : file_(std::move(file)) {}
  void renew() { spent_ = 0; }
  // SQLite's progress handler; not 0: too much.
  static int spend(void* budget);

 private:
  std::string file_;
  std::uint64_t spent_ = 0;  // calls of the handler
};

// Checksum of a row in a log: zlib's CRC-32 over its columns in order, without the crc column
// itself. An integer counts as 8 little-endian bytes; a text or blob as its length, in 8
// little-endian bytes, followed by its bytes. Any tool can therefore compute it from what SQLite
// shows.
class Checksum {
 public:
  void add(std::int64_t value) {
    std::array<Bytef, 8> bytes{};
    for (std::size_t i = 0; i < bytes.size(); ++i) {
      bytes[i] = static_cast<Bytef>(static_cast<std::uint64_t>(value) >> (8 * i));
    }
    crc_ = crc32_z(crc_, bytes.data(), bytes.size());
  }

  void add(std::span<const std::byte> bytes) {
    add(static_cast<std::int64_t>(bytes.size()));
    // zlib treats a null pointer as a request to start anew.
    if (!bytes.empty()) {
      crc_ = crc32_z(crc_, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size());
    }
  }

  // 0 to 2^32 - 1, as stored in the column `crc`.
  [[nodiscard]] std::int64_t value() const { return static_cast<std::int64_t>(crc_); }

 private:
  uLong crc_ = crc32_z(0, nullptr, 0);
};

// A prepared statement; must not outlive its Database. Bound text and bytes are not copied and must
// stay valid until the next reset().
class Statement {
 public:
  Statement(sqlite3_stmt* statement, std::string file, Budget& budget);

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
  Budget* budget_;
  int next_parameter_ = 1;
  Checksum bound_;
  bool done_ = false;
};

class Database {
 public:
  enum class Mode : std::uint8_t { kReadWrite, kRead };
  // The file must be there.
  static Result<Database> open(const std::filesystem::path& path, Mode mode);

  // Refuses a file whose tables are not exactly those of its format: a view, a trigger or a
  // constraint would be a program that a log brings along. Call it before anything is read of a
  // table.
  Result<> check_schema();

  // Runs any number of statements without parameters and discards their rows.
  Result<> run(const char* sql);
  Result<Statement> prepare(std::string_view sql);
  // Returns the first column of the first row of `sql`, as SQLite prints it.
  Result<std::string> value(std::string_view sql);

  // Sets how long to wait for another process that holds the file.
  void set_busy_timeout_ms(int patience_ms);
  // Discards everything written since the last commit; harmless when there is nothing.
  void rollback();
  // Gives the file a mark that each page of its -wal which counts the pages carries, too: SQLite
  // takes whatever -wal has the file's name for a part of it.
  Result<> mark(std::uint32_t mark);
  // Whether the mark in the file itself is that which its -wal shows.
  Result<bool> wal_is_own();
  // Whether what is in the -wal moves into the file when this is destroyed; it does at first.
  void merge_at_end(bool on);
  // False when the file was deleted, moved or replaced since it was opened.
  [[nodiscard]] bool is_in_place() const;
  // Call it after each commit: the file and its -wal only grow while this is open.
  void note_sizes() { sizes_ = sizes(); }
  // Whether one of them was cut short since then.
  [[nodiscard]] bool has_shrunk() const;
  // Reads the whole file: a second for each GB. The error says what is damaged.
  Result<> check_content();
  // Moves what is in the -wal into the file, and then leaves all files where they are when this is
  // destroyed.
  void leave_files();

 private:
  struct Close {
    void operator()(sqlite3* handle) const;
  };
  Database(sqlite3* handle, std::string file);
  Result<std::string> schema();
  using Sizes = std::array<std::uintmax_t, 2>;
  [[nodiscard]] Sizes sizes() const;

  std::unique_ptr<Budget> budget_;  // SQLite has its address
  std::unique_ptr<sqlite3, Close> handle_;
  std::string file_;
  Sizes sizes_{};
};

}  // namespace posed::log
