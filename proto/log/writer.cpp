#include "proto/log/writer.hpp"

#include <algorithm>
#include <array>
#include <vector>

#include "proto/log/database.hpp"
#include "proto/log/digest.hpp"
#include "proto/log/schema.hpp"

namespace posed::log {
namespace {

constexpr int kPatience_ms = 2000;  // merging the -wal takes a reader less time than this

// The tables whose ids the writer assigns, in the order of the row types.
enum Table : std::size_t { kChunk, kDecision, kFrame, kGap, kNumbered };
constexpr std::array<const char*, kNumbered> kNames{"chunk", "decision", "frame", "gap"};

// The writer's other statements.
enum Sql : std::size_t { kSource = kNumbered, kStream, kTake, kBlob, kBegin, kCommit, kSqlCount };
constexpr std::array<std::string_view, kSqlCount> kSql{
    "INSERT INTO chunk VALUES(?,?,?,?,?,?,?,?,?)",
    "INSERT INTO decision VALUES(?,?,?,?,?,?,?,?)",
    "INSERT INTO frame VALUES(?,?,?,?,?,?)",
    "INSERT INTO gap VALUES(?,?,?,?,?,?,?)",
    "INSERT INTO source VALUES(?,?,?,?,?,?,?)",
    "INSERT OR REPLACE INTO stream VALUES(?,?,?,?,?,?,?)",
    "INSERT OR REPLACE INTO take VALUES(?,?,?,?,?)",
    "INSERT OR IGNORE INTO blob VALUES(?,?)",
    "BEGIN IMMEDIATE",
    "COMMIT",
};

// SQLite has only signed integers; the bits of a sequence number are kept.
std::int64_t stored(std::uint64_t value) { return static_cast<std::int64_t>(value); }

Result<> make_room_for(const std::filesystem::path& path, bool overwrite) {
  std::error_code error;
  if (std::filesystem::exists(path, error) && !overwrite) {
    return fail("exists already; choose another name or say --overwrite", path.string());
  }
  for (const char* suffix : kFileSuffixes) {
    std::filesystem::remove(path.string() + suffix, error);
    if (error) return fail("cannot be replaced: " + error.message(), path.string());
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

// Writes tables, marks and meta in one transaction, so that a log exists complete or not at all.
Result<> write_birth(Database& database, const std::map<std::string, std::string>& meta) {
  const std::string tables = "BEGIN;" + std::string(kSchema) +
                             "PRAGMA application_id=" + std::to_string(kApplicationId) +
                             ";PRAGMA user_version=" + std::to_string(kFormatVersion) + ";";
  TRY(database.run(tables.c_str()));
  TRY(write_meta(database, meta));
  return database.run("COMMIT");
}

Result<> make_durable(Database& database) {
  database.set_busy_timeout_ms(kPatience_ms);
  return database.run("PRAGMA journal_mode=WAL; PRAGMA synchronous=FULL;");
}

}  // namespace

struct Writer::State {
  using Ids = std::array<std::int64_t, kNumbered>;

  Database database;
  std::vector<Statement> statements;
  bool in_transaction = false;
  Ids last_id{};
  Ids committed_id{};
  std::vector<std::byte> sequences;  // of the chunk being written

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

Writer::Writer(std::unique_ptr<State> state) : state_(std::move(state)) {}
Writer::Writer(Writer&&) noexcept = default;
Writer& Writer::operator=(Writer&&) noexcept = default;
Writer::~Writer() = default;

Result<Writer> Writer::on(Database database) {
  auto state = std::make_unique<State>(
      State{.database = std::move(database), .statements = {}, .sequences = {}});
  for (const std::string_view sql : kSql) {
    auto statement = TRY(state->database.prepare(sql));
    state->statements.push_back(std::move(statement));
  }
  for (std::size_t table = 0; table < kNumbered; ++table) {
    const auto last =
        TRY(state->database.value("SELECT ifnull(max(id),0) FROM " + std::string(kNames[table])));
    state->last_id[table] = state->committed_id[table] = std::stoll(last);
  }
  return Writer(std::move(state));
}

Result<Writer> Writer::create(const std::filesystem::path& path,
                              const std::map<std::string, std::string>& meta, bool overwrite) {
  TRY(make_room_for(path, overwrite));
  auto database = TRY(Database::open(path, Database::Mode::kCreate));
  TRY(make_durable(database));
  TRY(write_birth(database, meta));
  return on(std::move(database));
}

Result<Writer> Writer::reopen(const std::filesystem::path& path) {
  auto database = TRY(Database::open(path, Database::Mode::kReadWrite));
  TRY(make_durable(database));
  return on(std::move(database));
}

Result<> Writer::add(const SourceRow& row) {
  return state_->insert(state_->statements[kSource]
                            .bind(std::int64_t{row.id})
                            .bind(row.name)
                            .bind(row.driver)
                            .bind(row.text)
                            .bind(row.identity)
                            .bind(row.config)
                            .bind_checksum());
}

Result<> Writer::add(const StreamRow& row) {
  return state_->insert(state_->statements[kStream]
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
  state_->numbered(kChunk)
      .bind(std::int64_t{row.source})
      .bind(std::int64_t{row.socket})
      .bind(std::int64_t{row.direction})
      .bind(row.arrival_ns)
      .bind(stored(row.first_item))
      .bind(std::span<const std::byte>(state_->sequences))
      .bind(row.bytes);
  return state_->insert(kChunk);
}

Result<> Writer::add(const DecisionRow& row) {
  state_->numbered(kDecision)
      .bind(stored(row.item))
      .bind(std::int64_t{row.stream})
      .bind(row.stage)
      .bind(row.name)
      .bind(std::as_bytes(std::span(row.value)))
      .bind(row.now_ns);
  return state_->insert(kDecision);
}

Result<> Writer::add(const FrameRow& row) {
  state_->numbered(kFrame)
      .bind(std::int64_t{row.stream})
      .bind(stored(row.sequence))
      .bind(std::int64_t{row.raw})
      .bind(row.bytes);
  return state_->insert(kFrame);
}

Result<> Writer::add(const GapRow& row) {
  state_->numbered(kGap)
      .bind(static_cast<std::int64_t>(row.kind))
      .bind(std::int64_t{row.owner})
      .bind(row.after_chunk)
      .bind(stored(row.lost))
      .bind(row.time_ns);
  return state_->insert(kGap);
}

Result<> Writer::add(const TakeRow& row) {
  return state_->insert(state_->statements[kTake]
                            .bind(row.id)
                            .bind(row.name)
                            .bind(stored(row.first_item))
                            .bind(stored(row.last_item))
                            .bind_checksum());
}

Result<std::string> Writer::add_blob(std::span<const std::byte> bytes) {
  std::string hash = sha256_hex(bytes);
  TRY(state_->insert(state_->statements[kBlob].bind(hash).bind(bytes)));
  return hash;
}

Result<std::int64_t> Writer::chunk_before_frame(std::uint32_t source, std::uint32_t stream,
                                                std::uint64_t frame) const {
  auto backwards = TRY(
      state_->database.prepare("SELECT id, sequences FROM chunk WHERE source=? ORDER BY id DESC"));
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

std::int64_t Writer::last_chunk_id() const { return state_->last_id[kChunk]; }

Result<> Writer::commit() {
  if (!state_->in_transaction) return {};
  auto done = state_->statements[kCommit].execute();
  if (done) {
    state_->in_transaction = false;
    state_->committed_id = state_->last_id;
  }
  return done;
}

void Writer::rollback() {
  state_->database.rollback();
  state_->in_transaction = false;
  state_->last_id = state_->committed_id;
}

Result<> Writer::close() {
  TRY(commit());
  state_->statements.clear();  // an open statement would keep the log in WAL mode
  return state_->database.run("PRAGMA wal_checkpoint(TRUNCATE); PRAGMA journal_mode=DELETE;");
}

}  // namespace posed::log
