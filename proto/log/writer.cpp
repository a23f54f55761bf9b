#include "proto/log/writer.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <optional>
#include <utility>

#include "proto/log/database.hpp"
#include "proto/log/digest.hpp"
#include "proto/log/schema.hpp"

namespace posed::log {
namespace {

// Merging the -wal takes a reader less time than this, and the recorder's memory lasts longer.
constexpr int kPatience_ms = 4000;
// What is written is read again up to this size, bytes: it takes a second.
constexpr std::uintmax_t kMaxReadAgain = 1024UL * 1024 * 1024;
constexpr std::int64_t kMaxMark = 0x7FFFFFFF;
constexpr std::string_view kTakenWords =
    "exists already, or a -wal or -journal of this name does; choose another name or say "
    "--overwrite";

// The tables whose ids the writer assigns, in the order of the row types.
enum Table : std::size_t { kChunk, kDecision, kFrame, kGap, kNumbered };
constexpr std::array<const char*, kNumbered> kNames{"chunk", "decision", "frame", "gap"};
using Ids = std::array<std::int64_t, kNumbered>;

// The writer's other statements.
enum Sql : std::size_t { kSource = kNumbered, kStream, kTake, kBlob, kBegin, kCommit, kSqlCount };
constexpr std::array<std::string_view, kSqlCount> kSql{
    "INSERT INTO chunk VALUES(?,?,?,?,?,?,?,?,?)",
    "INSERT INTO decision VALUES(?,?,?,?,?,?,?,?)",
    "INSERT INTO frame VALUES(?,?,?,?,?,?)",
    "INSERT INTO gap VALUES(?,?,?,?,?,?,?)",
    "INSERT INTO source VALUES(?,?,?,?,?,?,?)",
    "INSERT OR REPLACE INTO stream VALUES(?,?,?,?,?,?,?)",
    "INSERT OR REPLACE INTO take VALUES(?,?,?,?,?,?)",
    "INSERT OR IGNORE INTO blob VALUES(?,?)",
    "BEGIN IMMEDIATE",
    "COMMIT",
};

// SQLite has only signed integers; the bits of a sequence number are kept.
std::int64_t stored(std::uint64_t value) { return static_cast<std::int64_t>(value); }

Statement& bind(Statement& insert, const SourceRow& row) {
  return insert.bind(std::int64_t{row.id})
      .bind(row.name)
      .bind(row.driver)
      .bind(row.text)
      .bind(row.identity)
      .bind(row.config)
      .bind_checksum();
}

Result<> write_sources(Database& database, const std::vector<SourceRow>& sources) {
  auto insert = TRY(database.prepare(kSql[kSource]));
  for (const SourceRow& row : sources) {
    TRY(bind(insert, row).execute());
  }
  return {};
}

Result<> write_meta(Database& database, const std::map<std::string, std::string>& meta) {
  auto insert = TRY(database.prepare("INSERT INTO meta VALUES(?,?)"));
  for (const auto& [key, value] : meta) {
    TRY(insert.bind(key).bind(value).execute());
  }
  return {};
}

// Writes tables, marks and beginning in one transaction, so that a log exists complete or not at
// all.
Result<> write_birth(Database& database, const Beginning& beginning) {
  const std::string tables = "BEGIN;" + std::string(kSchema) +
                             "PRAGMA application_id=" + std::to_string(kApplicationId) +
                             ";PRAGMA user_version=" + std::to_string(kFormatVersion) + ";";
  TRY(database.run(tables.c_str()));
  TRY(write_meta(database, beginning.meta));
  TRY(write_sources(database, beginning.sources));
  Checksum mark;
  for (const auto& [key, value] : beginning.meta) mark.add(std::as_bytes(std::span(value)));
  TRY(database.mark(static_cast<std::uint32_t>(mark.value() & kMaxMark)));
  return database.run("COMMIT");
}

// Another log may have got the name while this one was closed.
Result<> check_meta(Database& database, const Beginning& beginning, const std::string& file) {
  auto select = TRY(database.prepare("SELECT key, value FROM meta"));
  std::map<std::string, std::string> meta;
  for (;;) {
    const auto row = TRY(select.step());
    if (!row) break;
    meta.emplace(select.text(0), select.text(1));
  }
  if (meta == beginning.meta) return {};
  return fail("another recording has this name now; end this one and begin it again", file);
}

Result<Ids> last_ids(Database& database) {
  Ids ids{};
  for (std::size_t table = 0; table < kNumbered; ++table) {
    const auto last =
        TRY(database.value("SELECT ifnull(max(id),0) FROM " + std::string(kNames[table])));
    ids[table] = std::stoll(last);
  }
  return ids;
}

// Whether all that was committed can be read back. Somebody may have cut the log or its -wal, and
// SQLite takes an older state for whole.
Result<> check_written(Database& database, const Ids& committed, const std::string& file) {
  std::error_code error;
  const bool is_short = std::filesystem::file_size(file, error) <= kMaxReadAgain && !error;
  if (is_short) TRY(database.check_content());
  const Ids found = TRY(last_ids(database));
  for (std::size_t table = 0; table < kNumbered; ++table) {
    if (found[table] < committed[table]) return damaged(file, "its last rows have gone");
  }
  return {};
}

}  // namespace

// An open log. SQLite closes its files only after the statements, which stand behind them.
struct Writer::Connection {
  Database database;
  std::vector<Statement> statements{};
  bool in_transaction = false;
  Ids last_id{};

  static Result<Connection> on(Database database);

  // Returns the table's statement with the id of the next row bound.
  Statement& numbered(Table table) { return statements[table].bind(last_id[table] + 1); }

  // Runs a bound statement; the first row opens a transaction.
  Result<> insert(Statement& bound) {
    if (!in_transaction) {
      if (auto begun = statements[kBegin].execute(); !begun) {
        bound.reset();
        return begun;
      }
      in_transaction = true;
    }
    return bound.execute();
  }

  Result<> insert(Table table) {
    auto done = insert(statements[table].bind_checksum());
    if (done) ++last_id[table];
    return done;
  }
};

Result<Writer::Connection> Writer::Connection::on(Database database) {
  Connection connection{.database = std::move(database)};
  for (const std::string_view sql : kSql) {
    auto statement = TRY(connection.database.prepare(sql));
    connection.statements.push_back(std::move(statement));
  }
  connection.last_id = TRY(last_ids(connection.database));
  return connection;
}

struct Writer::State {
  std::filesystem::path path;
  Beginning beginning;
  bool reserved = false, begun = false;
  bool kept = false;  // something was committed after the beginning, or it was closed
  std::optional<Connection> open{};
  Ids committed{};
  std::vector<std::byte> sequences{};  // of the chunk being written

  Result<Connection> connect();
};

Result<Writer::Connection> Writer::State::connect() {
  if (!reserved) {
    const auto name = TRY(reserve(path));
    if (name == Reserved::kNoRoom) return fail("no room left on the disk", path.string());
    if (name == Reserved::kTaken) return fail(std::string(kTakenWords), path.string());
    reserved = true;
  }
  auto database = TRY(Database::open(path, Database::Mode::kReadWrite));
  database.set_busy_timeout_ms(kPatience_ms);
  // An attempt to begin it may have failed, as it seemed, and yet have been kept.
  const auto version = TRY(database.value("PRAGMA user_version"));
  if (version == "0" && !begun) {
    TRY(write_birth(database, beginning));
  } else {
    TRY(check_meta(database, beginning, path.string()));
    TRY(check_written(database, committed, path.string()));
  }
  begun = true;
  TRY(database.run("PRAGMA journal_mode=WAL; PRAGMA synchronous=FULL;"));
  return Connection::on(std::move(database));
}

Result<Reserved> reserve(const std::filesystem::path& path) {
  const int file = ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644);
  if (file < 0) {
    if (errno == EEXIST) return Reserved::kTaken;
    if (errno == ENOSPC || errno == EDQUOT) return Reserved::kNoRoom;
    return fail("cannot be written: " + errno_text(), path.string());
  }
  ::close(file);
  // SQLite would take what lies beside for parts of this log, and remove it.
  for (const char* suffix : kFileSuffixes) {
    std::error_code ignored;
    if (*suffix == '\0' || !std::filesystem::exists(path.string() + suffix, ignored)) continue;
    std::filesystem::remove(path, ignored);
    return Reserved::kTaken;
  }
  return Reserved::kYes;
}

Writer::Writer(std::filesystem::path path, Beginning beginning, bool reserved)
    : state_(std::make_unique<State>(State{
          .path = std::move(path), .beginning = std::move(beginning), .reserved = reserved})) {}
Writer::Writer(Writer&&) noexcept = default;
Writer& Writer::operator=(Writer&&) noexcept = default;

Writer::~Writer() {
  if (state_ == nullptr || !state_->reserved || state_->kept) return;
  const bool is_own = is_in_place();
  state_->open.reset();
  std::error_code error;
  const bool is_empty = std::filesystem::file_size(state_->path, error) == 0 && !error;
  if (is_own || (is_empty && !state_->begun)) std::filesystem::remove(state_->path, error);
}

Result<Writer> Writer::create(const std::filesystem::path& path, Beginning beginning) {
  Writer writer(path, std::move(beginning), false);
  TRY(writer.resume());
  return writer;
}

Result<> Writer::resume() {
  auto connection = TRY(state_->connect());
  state_->open.emplace(std::move(connection));
  return {};
}

void Writer::interrupt() {
  if (!state_->open) return;
  state_->open->statements.clear();
  state_->open->database.rollback();
  // What lies at the name now may be of somebody else, and stays. The log gets all that is in its
  // -wal, so that whoever has moved it away has it whole. But from a -wal that was cut it would get
  // nonsense.
  Database& database = state_->open->database;
  if (!database.is_in_place()) database.leave_files();
  if (database.has_shrunk()) database.merge_at_end(false);
  state_->open.reset();
}

bool Writer::is_open() const { return state_->open.has_value(); }

bool Writer::is_in_place() const {
  return state_->open && state_->open->database.is_in_place() &&
         !state_->open->database.has_shrunk();
}

Result<> Writer::add(const SourceRow& row) {
  return state_->open->insert(bind(state_->open->statements[kSource], row));
}

Result<> Writer::add(const StreamRow& row) {
  return state_->open->insert(state_->open->statements[kStream]
                                  .bind(std::int64_t{row.id})
                                  .bind(std::int64_t{row.source})
                                  .bind(row.body)
                                  .bind(row.name)
                                  .bind(row.stages_json)
                                  .bind(stored(row.first_item))
                                  .bind_checksum());
}

Result<> Writer::add(const ChunkRow& row) {
  pack_positions(row.places, state_->sequences);
  state_->open->numbered(kChunk)
      .bind(std::int64_t{row.source})
      .bind(std::int64_t{row.socket})
      .bind(std::int64_t{row.direction})
      .bind(row.arrival_ns)
      .bind(stored(row.first_item))
      .bind(std::span<const std::byte>(state_->sequences))
      .bind(row.bytes);
  return state_->open->insert(kChunk);
}

Result<> Writer::add(const DecisionRow& row) {
  state_->open->numbered(kDecision)
      .bind(stored(row.item))
      .bind(std::int64_t{row.stream})
      .bind(row.stage)
      .bind(row.name)
      .bind(std::as_bytes(std::span(row.value)))
      .bind(row.now_ns);
  return state_->open->insert(kDecision);
}

Result<> Writer::add(const FrameRow& row) {
  state_->open->numbered(kFrame)
      .bind(std::int64_t{row.stream})
      .bind(stored(row.sequence))
      .bind(std::int64_t{row.raw})
      .bind(row.bytes);
  return state_->open->insert(kFrame);
}

Result<> Writer::add(const GapRow& row) {
  state_->open->numbered(kGap)
      .bind(static_cast<std::int64_t>(row.kind))
      .bind(std::int64_t{row.owner})
      .bind(row.after_chunk)
      .bind(stored(row.lost))
      .bind(row.time_ns);
  return state_->open->insert(kGap);
}

Result<> Writer::add(const TakeRow& row) {
  return state_->open->insert(state_->open->statements[kTake]
                                  .bind(row.id)
                                  .bind(row.name)
                                  .bind(stored(row.first_item))
                                  .bind(stored(row.last_item))
                                  .bind(row.timecode)
                                  .bind_checksum());
}

Result<std::string> Writer::add_blob(std::span<const std::byte> bytes) {
  std::string hash = sha256_hex(bytes);
  TRY(state_->open->insert(state_->open->statements[kBlob].bind(hash).bind(bytes)));
  return hash;
}

Result<std::int64_t> Writer::chunk_before_frame(std::uint32_t source, std::uint32_t stream,
                                                std::uint64_t frame) const {
  auto backwards = TRY(state_->open->database.prepare(
      "SELECT id, sequences FROM chunk WHERE source=? ORDER BY id DESC"));
  backwards.bind(std::int64_t{source});
  std::vector<StreamPosition> places;
  for (bool holds_frame = false;;) {
    const auto row = TRY(backwards.step());
    if (!row) return 0;
    if (holds_frame) return backwards.integer(0);
    if (!unpack_positions(backwards.bytes(1), places)) continue;
    const auto place = std::ranges::find(places, stream, &StreamPosition::stream);
    holds_frame = place != places.end() && place->next_frame <= frame;
  }
}

std::int64_t Writer::last_chunk_id() const {
  return state_->open ? state_->open->last_id[kChunk] : 0;
}

Result<> Writer::commit() {
  if (!state_->open->in_transaction) return {};
  auto done = state_->open->statements[kCommit].execute();
  if (!done) return done;
  state_->open->in_transaction = false;
  state_->kept = true;
  state_->open->database.note_sizes();
  state_->committed = state_->open->last_id;
  return {};
}

Result<> Writer::close() {
  TRY(commit());
  state_->kept = true;
  state_->open->statements.clear();  // an open statement would keep the log in WAL mode
  TRY(state_->open->database.run("PRAGMA wal_checkpoint(TRUNCATE); PRAGMA journal_mode=DELETE;"));
  auto written = TRY(Database::open(state_->path, Database::Mode::kRead));
  return check_written(written, state_->committed, state_->path.string());
}

}  // namespace posed::log
