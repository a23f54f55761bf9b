#include "proto/log/reader.hpp"

#include <algorithm>
#include <limits>

#include "proto/log/database.hpp"
#include "proto/log/digest.hpp"
#include "proto/log/schema.hpp"

namespace posed::log {
namespace {

constexpr const char* kSelectChunks =
    "SELECT id, source, socket, direction, arrival_ns, first_item, sequences, bytes, crc FROM "
    "chunk";

constexpr int kReadPatience_ms = 2000;

// Checks the format of the log before reading anything else in it.
Result<> check_marks(Database& database, const std::string& file) {
  const auto application = TRY(database.value("PRAGMA application_id"));
  if (application != std::to_string(kApplicationId)) {
    return fail("not a device log (empty, or a database that is not posed's)", file);
  }
  const auto version = TRY(database.value("PRAGMA user_version"));
  const int format = std::stoi(version);
  if (format > kFormatVersion) {
    return fail("written by a newer posed (log format " + version + ", this one reads up to " +
                    std::to_string(kFormatVersion) + "); update posed",
                file);
  }
  if (format < kMinFormatVersion) {
    return fail("written by a development version of posed (log format " + version +
                    ", this one reads " + std::to_string(kMinFormatVersion) + " and newer)",
                file);
  }
  return {};
}

// After a crash the -wal file is part of the log; this merges it into the main file. That fails
// at once when somebody else has the log open or the file is read-only; reading works all the same.
// It must not lock a log that is being written: whoever reads with the lowest priority would make
// the recorder wait.
void merge_wal(Database& database) {
  database.set_busy_timeout_ms(0);
  const auto merged = database.run("PRAGMA journal_mode=DELETE;");
  static_cast<void>(merged);
  database.set_busy_timeout_ms(kReadPatience_ms);
}

Result<> check_length(Database& database, const std::string& file) {
  const auto page = TRY(database.value("PRAGMA page_size"));
  std::error_code error;
  const auto size = std::filesystem::file_size(file, error);
  // SQLite itself reads a truncated last page as if it ended in zeros.
  if (error || size % std::stoul(page) != 0) return damaged(file, "cut short");
  return {};
}

// A -wal may be of another recording that once had the name: merged, it would destroy this one.
// Returns whether there is one.
Result<bool> check_wal(Database& database, const std::string& file) {
  std::error_code none;
  if (std::filesystem::file_size(file + "-wal", none) == 0 || none) return false;
  const bool is_own = TRY(database.wal_is_own());
  if (is_own) return true;
  return fail("the file " + file +
                  "-wal beside it is of another recording; move that away, and the log is what it "
                  "was without it",
              file);
}

// SQLite would undo with a -journal whatever the log has, if it is of another file of that name.
Result<> check_journal(const std::string& file) {
  std::error_code none;
  if (std::filesystem::file_size(file + "-journal", none) == 0 || none) return {};
  return fail("the file " + file +
                  "-journal lies beside it: if another posed is just opening or ending this log, "
                  "try again; else keep both, and open a copy without the -journal",
              file);
}

// Opens the file of a log: checks that it is one, of a format that is known, and not damaged, and
// merges what a crash has left beside it.
Result<Database> open_whole(const std::filesystem::path& path) {
  const std::string file = path.string();
  TRY(check_journal(file));
  auto database = TRY(Database::open(path, Database::Mode::kReadWrite));
  database.merge_at_end(false);
  TRY(check_marks(database, file));
  const bool has_wal = TRY(check_wal(database, file));
  TRY(database.check_schema());
  database.set_busy_timeout_ms(kReadPatience_ms);
  if (has_wal) TRY(database.check_content());
  merge_wal(database);
  TRY(check_length(database, file));
  if (!has_wal) TRY(database.check_content());
  return database;
}

std::uint64_t unsigned_of(std::int64_t stored) { return static_cast<std::uint64_t>(stored); }

Result<std::map<std::string, std::string>> read_meta(Database& database) {
  auto select = TRY(database.prepare("SELECT key, value FROM meta"));
  std::map<std::string, std::string> meta;
  for (;;) {
    const auto row = TRY(select.step());
    if (!row) return meta;
    meta.emplace(select.text(0), select.text(1));
  }
}

// Steps to the next row of a table whose first column is its id and whose last is its checksum.
Result<bool> step_checked(Statement& select, const char* table, const std::string& file) {
  auto row = select.step();
  if (!row || !*row || select.checksum_matches()) return row;
  return damaged_row(file, table, select.integer(0), "does not match its checksum");
}

Result<std::vector<SourceRow>> read_sources(Database& database, const std::string& file) {
  auto select = TRY(database.prepare(
      "SELECT id, name, driver, text, identity, config, crc FROM source ORDER BY id"));
  std::vector<SourceRow> sources;
  for (;;) {
    const auto row = TRY(step_checked(select, "source", file));
    if (!row) return sources;
    const auto text = [&](int column) { return std::string(select.text(column)); };
    sources.push_back({static_cast<std::uint32_t>(select.integer(0)), text(1), text(2), text(3),
                       text(4), text(5)});
  }
}

Result<std::vector<StreamRow>> read_streams(Database& database, const std::string& file) {
  auto select = TRY(database.prepare(
      "SELECT id, source, body, name, stages_json, first_item, crc FROM stream ORDER BY id"));
  std::vector<StreamRow> streams;
  for (;;) {
    const auto row = TRY(step_checked(select, "stream", file));
    if (!row) return streams;
    const auto text = [&](int column) { return std::string(select.text(column)); };
    streams.push_back({static_cast<std::uint32_t>(select.integer(0)),
                       static_cast<std::uint32_t>(select.integer(1)), text(2), text(3), text(4),
                       unsigned_of(select.integer(5))});
  }
}

}  // namespace

std::unexpected<Error> damaged_row(const std::string& file, const char* table, std::int64_t id,
                                   const std::string& how) {
  return fail("the log is damaged: row " + std::to_string(id) + " of table " + table + " " + how +
                  "; use another copy of it",
              file);
}

struct Reader::State {
  Database database;
  std::string file;
  std::map<std::string, std::string> meta;
  std::vector<SourceRow> sources;
  std::vector<StreamRow> streams;
  std::optional<Statement> chunks;
  std::vector<StreamPosition> places;  // from the last chunk

  Result<bool> step(Statement& select, const char* table) const {
    return step_checked(select, table, file);
  }

  // The row of the chunk table to which `select` has stepped; it refers to `positions`.
  Result<ChunkRow> chunk(const Statement& select, std::vector<StreamPosition>& positions) const;

  Result<> read_described();
  // Fails when a row names a source or stream that the log does not describe.
  Result<> check_owner(std::int64_t id, const char* table, std::int64_t row, bool is_source) const;
  Result<> check_stream(std::uint32_t id, const char* table, std::int64_t row) const {
    return check_owner(id, table, row, false);
  }
};

Result<> Reader::State::read_described() {
  sources = TRY(read_sources(database, file));
  streams = TRY(read_streams(database, file));
  for (const StreamRow& row : streams) {
    TRY(check_owner(row.source, "stream", row.id, true));
  }
  return {};
}

Result<ChunkRow> Reader::State::chunk(const Statement& select,
                                      std::vector<StreamPosition>& positions) const {
  const std::int64_t id = select.integer(0), source = select.integer(1);
  TRY(check_owner(source, "chunk", id, true));
  if (!unpack_positions(select.bytes(6), positions)) {
    return damaged_row(file, "chunk", id, "has sequences that are cut short");
  }
  constexpr std::int64_t kMaxDirection = std::numeric_limits<std::uint8_t>::max();
  return ChunkRow{.id = id,
                  .source = static_cast<std::uint32_t>(source),
                  .socket = static_cast<std::uint32_t>(select.integer(2)),
                  .direction = static_cast<std::uint8_t>(
                      std::clamp<std::int64_t>(select.integer(3), 0, kMaxDirection)),
                  .arrival_ns = select.integer(4),
                  .first_item = unsigned_of(select.integer(5)),
                  .places = positions,
                  .bytes = select.bytes(7)};
}

Result<> Reader::State::check_owner(std::int64_t id, const char* table, std::int64_t row,
                                    bool is_source) const {
  const bool known = is_source ? std::ranges::binary_search(sources, id, {}, &SourceRow::id)
                               : std::ranges::binary_search(streams, id, {}, &StreamRow::id);
  if (known) return {};
  return damaged_row(file, table, row,
                     std::string("names ") + (is_source ? "source " : "stream ") +
                         std::to_string(id) + ", which the log does not describe");
}

Reader::Reader(std::unique_ptr<State> state) : state_(std::move(state)) {}
Reader::Reader(Reader&&) noexcept = default;
Reader& Reader::operator=(Reader&&) noexcept = default;
Reader::~Reader() = default;

Result<Reader> Reader::open(const std::filesystem::path& path) {
  const std::string file = path.string();
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) return fail("is a folder, not a log", file);
  auto database = TRY(open_whole(path));
  auto meta = TRY(read_meta(database));
  auto state = std::make_unique<State>(State{.database = std::move(database),
                                             .file = file,
                                             .meta = std::move(meta),
                                             .sources = {},
                                             .streams = {},
                                             .chunks = std::nullopt,
                                             .places = {}});
  TRY(state->read_described());
  auto chunks = TRY(state->database.prepare(std::string(kSelectChunks) + " ORDER BY id"));
  state->chunks.emplace(std::move(chunks));
  return Reader(std::move(state));
}

const std::string& Reader::file() const { return state_->file; }
const std::map<std::string, std::string>& Reader::meta() const { return state_->meta; }
const std::vector<SourceRow>& Reader::sources() const { return state_->sources; }
const std::vector<StreamRow>& Reader::streams() const { return state_->streams; }

const SourceRow& Reader::source_of(const StreamRow& stream) const {
  return *std::ranges::lower_bound(state_->sources, stream.source, {}, &SourceRow::id);
}

std::optional<std::size_t> Reader::place_of_stream(std::uint32_t id) const {
  const auto found = std::ranges::lower_bound(state_->streams, id, {}, &StreamRow::id);
  if (found == state_->streams.end() || found->id != id) return std::nullopt;
  return static_cast<std::size_t>(found - state_->streams.begin());
}

Result<std::vector<std::byte>> Reader::blob(std::string_view sha256) const {
  auto select = TRY(state_->database.prepare("SELECT bytes FROM blob WHERE sha256=?"));
  const auto row = TRY(select.bind(sha256).step());
  const std::string name(sha256);
  if (!row) return fail("lacks the file with SHA-256 " + name, state_->file);
  const auto bytes = select.bytes(0);
  if (sha256_hex(bytes) != name) {
    return fail("the log is damaged (the file kept as " + name + " does not match its hash)",
                state_->file);
  }
  return std::vector<std::byte>(bytes.begin(), bytes.end());
}

Result<std::optional<ChunkRow>> Reader::next_chunk() {
  Statement& select = *state_->chunks;
  const auto stepped = TRY(state_->step(select, "chunk"));
  if (!stepped) return std::nullopt;
  auto row = TRY(state_->chunk(select, state_->places));
  return row;
}

Result<> Reader::each_description(const std::function<Result<>(const ChunkRow&)>& handle) const {
  auto select =
      TRY(state_->database.prepare(std::string(kSelectChunks) + " WHERE direction=4 ORDER BY id"));
  std::vector<StreamPosition> places;
  for (;;) {
    const auto stepped = TRY(state_->step(select, "chunk"));
    if (!stepped) return {};
    const auto row = TRY(state_->chunk(select, places));
    TRY(handle(row));
  }
}

Result<std::optional<Reader::Extent>> Reader::extent() const {
  const auto arrival = [this](const char* order) -> Result<std::optional<std::int64_t>> {
    auto select = TRY(state_->database.prepare(
        std::string("SELECT arrival_ns FROM chunk WHERE direction=0 ORDER BY id ") + order +
        " LIMIT 1"));
    const auto row = TRY(select.step());
    if (!row) return std::nullopt;
    return select.integer(0);
  };
  const auto first = arrival("ASC"), last = arrival("DESC");
  if (!first) return std::unexpected(first.error());
  if (!last) return std::unexpected(last.error());
  if (!*first || !*last) return std::nullopt;
  return Extent{**first, **last};
}

Result<std::vector<DecisionRow>> Reader::decisions() const {
  auto select = TRY(state_->database.prepare(
      "SELECT id, item, stream, stage, name, value, now_ns, crc FROM decision ORDER BY id"));
  std::vector<DecisionRow> decisions;
  for (;;) {
    const auto stepped = TRY(state_->step(select, "decision"));
    if (!stepped) return decisions;
    const auto value = select.bytes(5);
    decisions.push_back({.id = select.integer(0),
                         .item = unsigned_of(select.integer(1)),
                         .stream = static_cast<std::uint32_t>(select.integer(2)),
                         .stage = std::string(select.text(3)),
                         .name = std::string(select.text(4)),
                         .value = {reinterpret_cast<const char*>(value.data()), value.size()},
                         .now_ns = select.integer(6)});
    const DecisionRow& row = decisions.back();
    TRY(state_->check_stream(row.stream, "decision", row.id));
  }
}

Result<std::vector<GapRow>> Reader::gaps() const {
  auto select = TRY(state_->database.prepare(
      "SELECT id, kind, owner, after_chunk, lost, time_ns, crc FROM gap ORDER BY id"));
  std::vector<GapRow> gaps;
  for (;;) {
    const auto stepped = TRY(state_->step(select, "gap"));
    if (!stepped) return gaps;
    gaps.push_back({.kind = static_cast<GapRow::Kind>(select.integer(1)),
                    .owner = static_cast<std::uint32_t>(select.integer(2)),
                    .after_chunk = select.integer(3),
                    .lost = unsigned_of(select.integer(4)),
                    .time_ns = select.integer(5)});
    const GapRow& row = gaps.back();
    const bool is_source = row.kind == GapRow::Kind::kChunks;
    TRY(state_->check_owner(row.owner, "gap", select.integer(0), is_source));
  }
}

Result<std::vector<TakeRow>> Reader::takes() const {
  const std::string version = TRY(state_->database.value("PRAGMA user_version"));
  const bool timed = version != "3";
  auto select = TRY(state_->database.prepare(
      timed ? "SELECT id, name, first_item, last_item, timecode, crc FROM take ORDER BY id"
            : "SELECT id, name, first_item, last_item, crc FROM take ORDER BY id"));
  std::vector<TakeRow> takes;
  for (;;) {
    const auto stepped = TRY(state_->step(select, "take"));
    if (!stepped) return takes;
    if (const std::int64_t id = select.integer(0); id < 1 || id > kMaxTakes) {
      return damaged_row(state_->file, "take", id, "has a number that no recording gives");
    }
    takes.push_back({select.integer(0), std::string(select.text(1)), unsigned_of(select.integer(2)),
                     unsigned_of(select.integer(3)),
                     timed ? std::string(select.text(4)) : std::string()});
  }
}

struct Reader::Frames::State {
  Statement select;
  std::uint32_t stream = 0;
  bool raw = false;
  std::string file;
};

Reader::Frames::Frames(std::unique_ptr<State> state) : state_(std::move(state)) {}
Reader::Frames::Frames(Frames&&) noexcept = default;
Reader::Frames& Reader::Frames::operator=(Frames&&) noexcept = default;
Reader::Frames::~Frames() = default;

Result<std::optional<FrameRow>> Reader::Frames::next() {
  Statement& select = state_->select;
  const auto row = TRY(step_checked(select, "frame", state_->file));
  if (!row) return std::nullopt;
  return FrameRow{state_->stream, unsigned_of(select.integer(2)), state_->raw, select.bytes(4)};
}

Result<Reader::Frames> Reader::frames(std::uint32_t stream, bool raw) const {
  auto select =
      TRY(state_->database.prepare("SELECT id, stream, sequence, raw, bytes, crc FROM frame "
                                   "WHERE stream=? AND raw=? ORDER BY id"));
  select.bind(std::int64_t{stream}).bind(std::int64_t{raw});
  return Frames(
      std::make_unique<Frames::State>(Frames::State{std::move(select), stream, raw, state_->file}));
}

Result<bool> Reader::has_frames() const {
  const auto any = TRY(state_->database.value("SELECT EXISTS(SELECT 1 FROM frame)"));
  return any == "1";
}

Result<> check_format(const std::filesystem::path& path) {
  auto database = TRY(Database::open(path, Database::Mode::kRead));
  return check_marks(database, path.string());
}

}  // namespace posed::log
