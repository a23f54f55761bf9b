#include "proto/log/open_whole.hpp"

#include <string>
#include <utility>

#include "proto/log/schema.hpp"

namespace posed::log {
namespace {

constexpr int kReadPatience_ms = 2000;

// Checks the format of the log before reading anything else in it.
Result<int> check_marks(Database& database, const std::string& file) {
  const auto application = database.value("PRAGMA application_id");
  if (!application) return std::unexpected(application.error());
  if (*application != std::to_string(kApplicationId)) {
    return fail("not a device log (empty, or a database that is not posed's)", file);
  }
  const auto version = database.value("PRAGMA user_version");
  if (!version) return std::unexpected(version.error());
  const int format = std::stoi(*version);
  if (format > kFormatVersion) {
    return fail("written by a newer posed (log format " + *version + ", this one reads up to " +
                    std::to_string(kFormatVersion) + "); update posed",
                file);
  }
  if (format < 1) return fail("not a device log (log format " + *version + ")", file);
  return format;
}

// After a crash the -wal file is part of the log; this merges it into the main file. That fails
// when another process has the log open or the file is read-only; reading works all the same.
void fold_in_wal(Database& database) {
  const auto folded = database.run("PRAGMA wal_checkpoint(TRUNCATE); PRAGMA journal_mode=DELETE;");
  static_cast<void>(folded);
}

Result<> check_whole(Database& database, const std::string& file) {
  const auto damaged = [&](const std::string& how) {
    return fail("the log is damaged (" + how + "); `sqlite3 FILE .recover` may save what is left",
                file);
  };
  const auto page = database.value("PRAGMA page_size");
  if (!page) return std::unexpected(page.error());
  std::error_code error;
  const auto size = std::filesystem::file_size(file, error);
  // SQLite itself reads a truncated last page as if it ended in zeros.
  if (error || size % std::stoul(*page) != 0) return damaged("cut short");
  const auto verdict = database.value("PRAGMA quick_check(1)");
  if (!verdict) return std::unexpected(verdict.error());
  if (*verdict != "ok") return damaged(*verdict);
  return {};
}

}  // namespace

Result<OpenedLog> open_whole(const std::filesystem::path& path) {
  const std::string file = path.string();
  auto database = Database::open(path, Database::Mode::kReadWrite);
  if (!database) return std::unexpected(database.error());
  const auto format = check_marks(*database, file);
  if (!format) return std::unexpected(format.error());
  fold_in_wal(*database);
  database->set_busy_timeout_ms(kReadPatience_ms);
  if (auto done = check_whole(*database, file); !done) return std::unexpected(done.error());
  return OpenedLog{std::move(*database), *format};
}

Result<int> format_of(const std::filesystem::path& path) {
  auto database = Database::open(path, Database::Mode::kRead);
  if (!database) return std::unexpected(database.error());
  return check_marks(*database, path.string());
}

}  // namespace posed::log
