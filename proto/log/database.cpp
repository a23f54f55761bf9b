#include "proto/log/database.hpp"

#include <sqlite3.h>

#include <array>
#include <utility>

#include "proto/log/schema.hpp"

namespace posed::log {
namespace {

constexpr int kMaxValue = 256 * 1024 * 1024;  // bytes; a log's largest value is a model file
constexpr std::int64_t kMaxHeap = 1024LL * 1024 * 1024;  // bytes, of all logs of the process

// A statement that reads or checks a whole log needs about 3 operations of SQLite's machine for
// each byte.
constexpr int kOperationsACall = 1000;
constexpr std::uint64_t kFreeCalls = 1000;
constexpr std::uint64_t kBytesACall = 60;

// Logs need little of what SQLite can do.
constexpr std::array<std::pair<int, int>, 8> kLimits{{{SQLITE_LIMIT_LENGTH, kMaxValue},
                                                      {SQLITE_LIMIT_SQL_LENGTH, 10'000},
                                                      {SQLITE_LIMIT_COLUMN, 20},
                                                      {SQLITE_LIMIT_EXPR_DEPTH, 20},
                                                      {SQLITE_LIMIT_COMPOUND_SELECT, 2},
                                                      {SQLITE_LIMIT_ATTACHED, 0},
                                                      {SQLITE_LIMIT_TRIGGER_DEPTH, 1},
                                                      {SQLITE_LIMIT_WORKER_THREADS, 0}}};

// Turns an SQLite failure into one sentence, with advice where there is some.
std::unexpected<Error> failure(sqlite3* handle, const std::string& file) {
  const int code = handle == nullptr ? SQLITE_NOMEM : sqlite3_errcode(handle);
  const int place = handle == nullptr ? 0 : sqlite3_system_errno(handle);
  const std::string why = place != 0 ? errno_text(place) : sqlite3_errstr(code);
  switch (code) {
    case SQLITE_NOTADB:
      return fail("not a device log (not an SQLite file)", file);
    case SQLITE_CORRUPT:
      return fail("the log is damaged or cut short; `sqlite3 FILE .recover` may save what is left",
                  file);
    case SQLITE_FULL:
      return fail("no room left on the disk", file);
    case SQLITE_CANTOPEN:
      return fail("cannot be opened: " + why, file);
    case SQLITE_IOERR:
      return fail("reading or writing failed: " + why, file);
    case SQLITE_READONLY:
      return fail("may only be read; give it, and its folder, write permission", file);
    case SQLITE_INTERRUPT:
      return fail("takes longer to read than its size explains; use another copy of it", file);
    case SQLITE_BUSY:
      return fail("in use by another process", file);
    default:
      return fail(handle == nullptr ? why : sqlite3_errmsg(handle), file);
  }
}

}  // namespace

std::unexpected<Error> damaged(const std::string& file, const std::string& how) {
  return fail("the log is damaged (" + how + "); `sqlite3 FILE .recover` may save what is left",
              file);
}

int Budget::spend(void* budget) {
  auto& self = *static_cast<Budget*>(budget);
  if (++self.spent_ <= kFreeCalls) return 0;
  std::uint64_t bytes = 0;
  for (const char* suffix : kFileSuffixes) {
    std::error_code gone;
    const auto size = std::filesystem::file_size(self.file_ + suffix, gone);
    if (!gone) bytes += size;
  }
  return self.spent_ > kFreeCalls + bytes / kBytesACall ? 1 : 0;
}

Statement::Statement(sqlite3_stmt* statement, std::string file, Budget& budget)
    : statement_(statement), file_(std::move(file)), budget_(&budget) {}

void Statement::Finalize::operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }

Statement& Statement::bind(std::int64_t value) {
  bound_.add(value);
  sqlite3_bind_int64(statement_.get(), next_parameter_++, value);
  return *this;
}

Statement& Statement::bind(std::string_view text) {
  bound_.add(std::as_bytes(std::span(text)));
  const char* data = text.empty() ? "" : text.data();  // a null pointer would bind NULL
  sqlite3_bind_text64(statement_.get(), next_parameter_++, data, text.size(), SQLITE_STATIC,
                      SQLITE_UTF8);
  return *this;
}

Statement& Statement::bind(std::span<const std::byte> bytes) {
  bound_.add(bytes);
  const void* data = bytes.empty() ? static_cast<const void*>("") : bytes.data();
  sqlite3_bind_blob64(statement_.get(), next_parameter_++, data, bytes.size(), SQLITE_STATIC);
  return *this;
}

Statement& Statement::bind_checksum() {
  sqlite3_bind_int64(statement_.get(), next_parameter_++, bound_.value());
  return *this;
}

Result<bool> Statement::step() {
  if (done_) return false;
  budget_->renew();
  switch (sqlite3_step(statement_.get())) {
    case SQLITE_ROW:
      return true;
    case SQLITE_DONE:
      done_ = true;
      return false;
    default:
      return failure(sqlite3_db_handle(statement_.get()), file_);
  }
}

Result<> Statement::execute() {
  auto row = step();
  reset();
  if (!row) return std::unexpected(std::move(row.error()));
  return {};
}

void Statement::reset() {
  sqlite3_reset(statement_.get());
  next_parameter_ = 1;
  bound_ = {};
  done_ = false;
}

std::int64_t Statement::integer(int column) const {
  return sqlite3_column_int64(statement_.get(), column);
}

std::string_view Statement::text(int column) const {
  const auto* data = reinterpret_cast<const char*>(sqlite3_column_text(statement_.get(), column));
  if (data == nullptr) return {};
  return {data, static_cast<std::size_t>(sqlite3_column_bytes(statement_.get(), column))};
}

std::span<const std::byte> Statement::bytes(int column) const {
  const auto* data = static_cast<const std::byte*>(sqlite3_column_blob(statement_.get(), column));
  if (data == nullptr) return {};
  return {data, static_cast<std::size_t>(sqlite3_column_bytes(statement_.get(), column))};
}

bool Statement::checksum_matches() const {
  const int last = sqlite3_column_count(statement_.get()) - 1;
  Checksum checksum;
  for (int column = 0; column < last; ++column) {
    switch (sqlite3_column_type(statement_.get(), column)) {
      case SQLITE_INTEGER:
        checksum.add(integer(column));
        break;
      case SQLITE_TEXT:
      case SQLITE_BLOB:
        checksum.add(bytes(column));
        break;
      default:
        return false;  // the columns of a log are never real numbers or NULL
    }
  }
  return checksum.value() == integer(last);
}

void Database::Close::operator()(sqlite3* handle) const { sqlite3_close_v2(handle); }

Result<Database> Database::open(const std::filesystem::path& path, Mode mode) {
  const int flags = mode == Mode::kReadWrite ? SQLITE_OPEN_READWRITE : SQLITE_OPEN_READONLY;
  sqlite3* handle = nullptr;
  const int code = sqlite3_open_v2(path.c_str(), &handle, flags | SQLITE_OPEN_NOMUTEX, nullptr);
  Database database(handle, path.string());
  if (code != SQLITE_OK) return failure(handle, path.string());
  for (const auto& [limit, value] : kLimits) sqlite3_limit(handle, limit, value);
  sqlite3_hard_heap_limit64(kMaxHeap);
  sqlite3_progress_handler(handle, kOperationsACall, Budget::spend, database.budget_.get());
  sqlite3_db_config(handle, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
  sqlite3_db_config(handle, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
  sqlite3_db_config(handle, SQLITE_DBCONFIG_ENABLE_TRIGGER, 0, nullptr);
  sqlite3_db_config(handle, SQLITE_DBCONFIG_ENABLE_VIEW, 0, nullptr);
  return database;
}

Database::Database(sqlite3* handle, std::string file)
    : budget_(std::make_unique<Budget>(file)), handle_(handle), file_(std::move(file)) {}

// One line for each table and index.
Result<std::string> Database::schema() {
  auto select =
      TRY(prepare("SELECT type, name, tbl_name, ifnull(sql,'') FROM sqlite_master"
                  " ORDER BY name"));
  std::string lines;
  for (;;) {
    const auto row = TRY(select.step());
    if (!row) return lines;
    for (int column = 0; column < 4; ++column) lines += std::string(select.text(column)) + '\t';
    lines += '\n';
  }
}

Result<> Database::check_schema() {
  auto fresh = TRY(open(":memory:", Mode::kReadWrite));
  const auto format = TRY(value("PRAGMA user_version"));
  TRY(fresh.run(schema_of(format == "3" ? 3 : kFormatVersion).c_str()));
  const auto ours = TRY(fresh.schema());
  const auto found = TRY(schema());
  if (found == ours) return {};
  return fail(
      "the log is damaged or forged (its tables are not those that posed makes); use another"
      " copy of it",
      file_);
}

Result<> Database::run(const char* sql) {
  budget_->renew();
  if (sqlite3_exec(handle_.get(), sql, nullptr, nullptr, nullptr) != SQLITE_OK) {
    return failure(handle_.get(), file_);
  }
  return {};
}

Result<Statement> Database::prepare(std::string_view sql) {
  sqlite3_stmt* statement = nullptr;
  if (sqlite3_prepare_v3(handle_.get(), sql.data(), static_cast<int>(sql.size()),
                         SQLITE_PREPARE_PERSISTENT, &statement, nullptr) != SQLITE_OK) {
    return failure(handle_.get(), file_);
  }
  return Statement(statement, file_, *budget_);
}

Result<std::string> Database::value(std::string_view sql) {
  auto statement = TRY(prepare(sql));
  const auto row = TRY(statement.step());
  return std::string(row ? statement.text(0) : std::string_view{});
}

void Database::set_busy_timeout_ms(int patience_ms) {
  sqlite3_busy_timeout(handle_.get(), patience_ms);
}

void Database::rollback() {
  // Fails when SQLite has already rolled back by itself, which has the same effect.
  if (sqlite3_get_autocommit(handle_.get()) == 0) {
    sqlite3_exec(handle_.get(), "ROLLBACK", nullptr, nullptr, nullptr);
  }
}

bool Database::is_in_place() const {
  int moved = 0;
  const int known = sqlite3_file_control(handle_.get(), "main", SQLITE_FCNTL_HAS_MOVED, &moved);
  return known != SQLITE_OK || moved == 0;
}

Database::Sizes Database::sizes() const {
  Sizes found{};
  std::error_code error;
  for (std::size_t i = 0; i < found.size(); ++i) {
    const auto size = std::filesystem::file_size(file_ + (i == 0 ? "" : "-wal"), error);
    found[i] = error ? 0 : size;
  }
  return found;
}

bool Database::has_shrunk() const {
  const Sizes now = sizes();
  return now[0] < sizes_[0] || now[1] < sizes_[1];
}

Result<> Database::check_content() {
  const auto verdict = TRY(value("PRAGMA quick_check(1)"));
  return verdict == "ok" ? Result<>{} : damaged(file_, verdict);
}

void Database::leave_files() {
  static_cast<void>(run("PRAGMA wal_checkpoint(TRUNCATE)"));
  merge_at_end(false);
}

void Database::merge_at_end(bool on) {
  sqlite3_db_config(handle_.get(), SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, on ? 0 : 1, nullptr);
}

// The mark is the "schema cookie" of SQLite's file format (sqlite.org/fileformat2.html, 1.3.9):
// any value will do, and it lies on the first page.
Result<> Database::mark(std::uint32_t mark) {
  sqlite3_db_config(handle_.get(), SQLITE_DBCONFIG_DEFENSIVE, 0, nullptr);
  auto marked = run(("PRAGMA schema_version=" + std::to_string(mark)).c_str());
  sqlite3_db_config(handle_.get(), SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
  return marked;
}

Result<bool> Database::wal_is_own() {
  constexpr sqlite3_int64 kCookieAt = 40;
  std::array<unsigned char, 4> bytes{};
  sqlite3_file* file = nullptr;
  sqlite3_file_control(handle_.get(), "main", SQLITE_FCNTL_FILE_POINTER, &file);
  if (file == nullptr || file->pMethods == nullptr ||
      file->pMethods->xRead(file, bytes.data(), bytes.size(), kCookieAt) != SQLITE_OK) {
    return fail("cannot be read", file_);
  }
  std::uint32_t cookie = 0;
  for (const unsigned char byte : bytes) cookie = cookie << 8 | byte;
  const auto shown = TRY(value("PRAGMA schema_version"));
  return shown == std::to_string(cookie);
}

}  // namespace posed::log
