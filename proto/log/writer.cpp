#include "proto/log/writer.hpp"

#include <array>
#include <vector>

#include "proto/log/database.hpp"
#include "proto/log/digest.hpp"
#include "proto/log/schema.hpp"

namespace posed::log {
namespace {

constexpr int kPatience_ms = 2000;  // a reader folding the -wal in is quicker than that

// The writer's statements, in the order of kSql.
enum Sql { kBegin, kCommit, kStream, kChunk, kDecision, kFrame, kGap, kBlob, kSqlCount };
constexpr std::array<std::string_view, kSqlCount> kSql{
    "BEGIN IMMEDIATE",
    "COMMIT",
    "INSERT INTO stream VALUES(?,?,?,?,?,?,?)",
    "INSERT INTO chunk VALUES(NULL,?,?,?,?,?)",
    "INSERT INTO decision VALUES(NULL,?,?,?,?,?,?,?,?)",
    "INSERT INTO frame VALUES(NULL,?,?,?,?)",
    "INSERT INTO gap VALUES(NULL,?,?,?,?,?)",
    "INSERT OR IGNORE INTO blob VALUES(?,?)",
};

// SQLite knows signed integers only; sequences keep their bits.
std::int64_t stored(std::uint64_t value) { return static_cast<std::int64_t>(value); }

Result<> make_room_for(const std::filesystem::path& path, bool overwrite) {
  std::error_code error;
  if (std::filesystem::exists(path, error) && !overwrite) {
    return fail("exists already; choose another name or say --force", path.string());
  }
  for (const char* suffix : {"", "-wal", "-shm", "-journal"}) {
    std::filesystem::remove(path.string() + suffix, error);
    if (error) return fail("cannot be replaced: " + error.message(), path.string());
  }
  return {};
}

Result<> write_meta(Database& database, const std::map<std::string, std::string>& meta) {
  auto insert = database.prepare("INSERT INTO meta VALUES(?,?)");
  if (!insert) return std::unexpected(insert.error());
  for (const auto& [key, value] : meta) {
    if (auto done = insert->bind(key).bind(value).execute(); !done) return done;
  }
  return {};
}

// Tables, marks and meta in one transaction: a log is there whole or not at all.
Result<> write_birth(Database& database, const std::map<std::string, std::string>& meta) {
  const std::string tables = "BEGIN;" + std::string(kSchema) +
                             "PRAGMA application_id=" + std::to_string(kApplicationId) +
                             ";PRAGMA user_version=" + std::to_string(kFormatVersion) + ";";
  if (auto done = database.run(tables.c_str()); !done) return done;
  if (auto done = write_meta(database, meta); !done) return done;
  return database.run("COMMIT");
}

Result<> make_durable(Database& database) {
  database.set_patience_ms(kPatience_ms);
  return database.run("PRAGMA journal_mode=WAL; PRAGMA synchronous=FULL;");
}

}  // namespace

struct Writer::State {
  Database database;
  std::vector<Statement> statements;
  bool in_transaction = false;
  std::int64_t last_chunk_id = 0;
  std::int64_t committed_chunk_id = 0;

  // Runs a bound statement in the transaction, which the first row opens.
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
};

Writer::Writer(std::unique_ptr<State> state) : state_(std::move(state)) {}
Writer::Writer(Writer&&) noexcept = default;
Writer& Writer::operator=(Writer&&) noexcept = default;
Writer::~Writer() = default;

Result<Writer> Writer::on(Database database) {
  auto state = std::make_unique<State>(State{.database = std::move(database), .statements = {}});
  for (const std::string_view sql : kSql) {
    auto statement = state->database.prepare(sql);
    if (!statement) return std::unexpected(statement.error());
    state->statements.push_back(std::move(*statement));
  }
  const auto last = state->database.value("SELECT ifnull(max(id),0) FROM chunk");
  if (!last) return std::unexpected(last.error());
  state->last_chunk_id = state->committed_chunk_id = std::stoll(*last);
  return Writer(std::move(state));
}

Result<Writer> Writer::create(const std::filesystem::path& path,
                              const std::map<std::string, std::string>& meta, bool overwrite) {
  if (auto done = make_room_for(path, overwrite); !done) return std::unexpected(done.error());
  auto database = Database::open(path, Database::Mode::kCreate);
  if (!database) return std::unexpected(database.error());
  if (auto done = make_durable(*database); !done) return std::unexpected(done.error());
  if (auto done = write_birth(*database, meta); !done) return std::unexpected(done.error());
  return on(std::move(*database));
}

Result<Writer> Writer::reopen(const std::filesystem::path& path) {
  auto database = Database::open(path, Database::Mode::kReadWrite);
  if (!database) return std::unexpected(database.error());
  if (auto done = make_durable(*database); !done) return std::unexpected(done.error());
  return on(std::move(*database));
}

Result<> Writer::add(const StreamRow& row) {
  return state_->insert(state_->statements[kStream]
                            .bind(std::int64_t{row.id})
                            .bind(row.name)
                            .bind(row.driver)
                            .bind(row.text)
                            .bind(row.identity)
                            .bind(row.config)
                            .bind(row.model));
}

Result<> Writer::add(const ChunkRow& row) {
  auto done = state_->insert(state_->statements[kChunk]
                                 .bind(std::int64_t{row.stream})
                                 .bind(std::int64_t{row.direction})
                                 .bind(row.arrival_ns)
                                 .bind(stored(row.next_sequence))
                                 .bind(row.bytes));
  if (done) state_->last_chunk_id = state_->database.last_insert_id();
  return done;
}

Result<> Writer::add(const DecisionRow& row) {
  return state_->insert(state_->statements[kDecision]
                            .bind(std::int64_t{row.stream})
                            .bind(std::int64_t{row.kind})
                            .bind(stored(row.sequence))
                            .bind(stored(row.count))
                            .bind(row.now_ns)
                            .bind(row.alpha)
                            .bind(row.model_hash)
                            .bind(row.labels));
}

Result<> Writer::add(const FrameRow& row) {
  return state_->insert(state_->statements[kFrame]
                            .bind(std::int64_t{row.stream})
                            .bind(stored(row.sequence))
                            .bind(std::int64_t{row.raw})
                            .bind(row.bytes));
}

Result<> Writer::add(const GapRow& row) {
  return state_->insert(state_->statements[kGap]
                            .bind(std::int64_t{row.stream})
                            .bind(static_cast<std::int64_t>(row.kind))
                            .bind(row.after_chunk)
                            .bind(stored(row.lost))
                            .bind(row.time_ns));
}

Result<std::string> Writer::add_blob(std::span<const std::byte> bytes) {
  std::string hash = sha256_hex(bytes);
  auto done = state_->insert(state_->statements[kBlob].bind(hash).bind(bytes));
  if (!done) return std::unexpected(done.error());
  return hash;
}

std::int64_t Writer::last_chunk_id() const { return state_->last_chunk_id; }

Result<> Writer::commit() {
  if (!state_->in_transaction) return {};
  auto done = state_->statements[kCommit].execute();
  if (done) {
    state_->in_transaction = false;
    state_->committed_chunk_id = state_->last_chunk_id;
  }
  return done;
}

void Writer::rollback() {
  state_->database.rollback();
  state_->in_transaction = false;
  state_->last_chunk_id = state_->committed_chunk_id;
}

Result<> Writer::close() {
  if (auto done = commit(); !done) return done;
  state_->statements.clear();  // an open statement would keep the log in WAL mode
  return state_->database.run("PRAGMA wal_checkpoint(TRUNCATE); PRAGMA journal_mode=DELETE;");
}

}  // namespace posed::log
