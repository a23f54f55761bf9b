#include "proto/log/reader.hpp"

#include "proto/log/database.hpp"
#include "proto/log/digest.hpp"
#include "proto/log/schema.hpp"

namespace posed::log {
namespace {

constexpr int kPatience_ms = 2000;

std::uint64_t sequence_of(std::int64_t value) { return static_cast<std::uint64_t>(value); }

// Says whether the file is a log of a format we know, before anything in it is touched.
Result<> check_marks(Database& database, const std::string& file) {
  const auto application = database.value("PRAGMA application_id");
  if (!application) return std::unexpected(application.error());
  if (*application != std::to_string(kApplicationId)) {
    return fail("not a device log (empty, or a database that is not posed's)", file);
  }
  const auto version = database.value("PRAGMA user_version");
  if (!version) return std::unexpected(version.error());
  if (std::stoi(*version) > kFormatVersion) {
    return fail("written by a newer posed (log format " + *version + ", this one reads up to " +
                    std::to_string(kFormatVersion) + "); update posed",
                file);
  }
  return {};
}

// After a crash the -wal belongs to the log. Folding it in fails while another process has the log
// open or the file may only be read; reading works all the same.
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
  // SQLite itself reads a cut last page as if it ended in zeros.
  if (error || size % std::stoul(*page) != 0) return damaged("cut short");
  const auto verdict = database.value("PRAGMA quick_check(1)");
  if (!verdict) return std::unexpected(verdict.error());
  if (*verdict != "ok") return damaged(*verdict);
  return {};
}

Result<std::map<std::string, std::string>> read_meta(Database& database) {
  auto select = database.prepare("SELECT key, value FROM meta");
  if (!select) return std::unexpected(select.error());
  std::map<std::string, std::string> meta;
  for (;;) {
    const auto row = select->step();
    if (!row) return std::unexpected(row.error());
    if (!*row) return meta;
    meta.emplace(select->text(0), select->text(1));
  }
}

Result<std::vector<StreamRow>> read_streams(Database& database, const std::string& file) {
  auto select = database.prepare(
      "SELECT id, name, driver, text, identity, config, model FROM stream ORDER BY id");
  if (!select) return std::unexpected(select.error());
  std::vector<StreamRow> streams;
  for (;;) {
    const auto row = select->step();
    if (!row) return std::unexpected(row.error());
    if (!*row) return streams;
    if (select->integer(0) != static_cast<std::int64_t>(streams.size())) {
      return fail("the log is damaged (its streams are not numbered 0, 1, 2, ...)", file);
    }
    const auto text = [&](int column) { return std::string(select->text(column)); };
    streams.push_back({static_cast<std::uint32_t>(streams.size()), text(1), text(2), text(3),
                       text(4), text(5), text(6)});
  }
}

}  // namespace

struct Reader::State {
  Database database;
  std::string file;
  std::map<std::string, std::string> meta;
  std::vector<StreamRow> streams;
  std::optional<Statement> chunks;
  bool has_labels = true;  // nothing could be played when format 1 was written

  // A row may name only a stream that the log describes.
  Result<std::uint32_t> stream_of(std::int64_t id) const {
    if (id >= 0 && id < static_cast<std::int64_t>(streams.size())) {
      return static_cast<std::uint32_t>(id);
    }
    return fail("the log is damaged (a row names stream " + std::to_string(id) + " of " +
                    std::to_string(streams.size()) + ")",
                file);
  }
};

Reader::Reader(std::unique_ptr<State> state) : state_(std::move(state)) {}
Reader::Reader(Reader&&) noexcept = default;
Reader& Reader::operator=(Reader&&) noexcept = default;
Reader::~Reader() = default;

Result<Reader> Reader::open(const std::filesystem::path& path) {
  const std::string file = path.string();
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) return fail("is a folder, not a log", file);
  auto database = Database::open(path, Database::Mode::kReadWrite);
  if (!database) return std::unexpected(database.error());
  if (auto done = check_marks(*database, file); !done) return std::unexpected(done.error());
  fold_in_wal(*database);
  database->set_patience_ms(kPatience_ms);
  if (auto done = check_whole(*database, file); !done) return std::unexpected(done.error());
  auto meta = read_meta(*database);
  if (!meta) return std::unexpected(meta.error());
  auto streams = read_streams(*database, file);
  if (!streams) return std::unexpected(streams.error());
  auto chunks = database->prepare(
      "SELECT id, stream, direction, arrival_ns, next_sequence, bytes FROM chunk ORDER BY id");
  if (!chunks) return std::unexpected(chunks.error());
  const auto labels =
      database->value("SELECT count(*) FROM pragma_table_info('decision') WHERE name='labels'");
  if (!labels) return std::unexpected(labels.error());
  return Reader(
      std::make_unique<State>(State{std::move(*database), file, std::move(*meta),
                                    std::move(*streams), std::move(*chunks), *labels == "1"}));
}

const std::map<std::string, std::string>& Reader::meta() const { return state_->meta; }
const std::vector<StreamRow>& Reader::streams() const { return state_->streams; }

Result<std::vector<std::byte>> Reader::blob(std::string_view sha256) const {
  auto select = state_->database.prepare("SELECT bytes FROM blob WHERE sha256=?");
  if (!select) return std::unexpected(select.error());
  const auto row = select->bind(sha256).step();
  if (!row) return std::unexpected(row.error());
  const std::string name(sha256);
  if (!*row) return fail("lacks the file with SHA-256 " + name, state_->file);
  const auto bytes = select->bytes(0);
  if (sha256_hex(bytes) != name) {
    return fail("the log is damaged (the file kept as " + name + " does not match its hash)",
                state_->file);
  }
  return std::vector<std::byte>(bytes.begin(), bytes.end());
}

Result<std::optional<ChunkRow>> Reader::next_chunk() {
  Statement& select = *state_->chunks;
  const auto row = select.step();
  if (!row) return std::unexpected(row.error());
  if (!*row) return std::nullopt;
  const auto stream = state_->stream_of(select.integer(1));
  if (!stream) return std::unexpected(stream.error());
  return ChunkRow{select.integer(0),
                  *stream,
                  static_cast<std::uint8_t>(select.integer(2)),
                  select.integer(3),
                  sequence_of(select.integer(4)),
                  select.bytes(5)};
}

Result<std::vector<DecisionRow>> Reader::decisions(std::uint32_t stream) const {
  auto select =
      state_->database.prepare("SELECT kind, sequence, count, now_ns, alpha, model_hash, " +
                               std::string(state_->has_labels ? "labels" : "''") +
                               " FROM decision WHERE stream=? ORDER BY id");
  if (!select) return std::unexpected(select.error());
  select->bind(std::int64_t{stream});
  std::vector<DecisionRow> decisions;
  for (;;) {
    const auto row = select->step();
    if (!row) return std::unexpected(row.error());
    if (!*row) return decisions;
    decisions.push_back({stream, static_cast<std::uint8_t>(select->integer(0)),
                         sequence_of(select->integer(1)), sequence_of(select->integer(2)),
                         select->integer(3), select->real(4), std::string(select->text(5)),
                         std::string(select->text(6))});
  }
}

Result<std::vector<GapRow>> Reader::gaps() const {
  auto select = state_->database.prepare(
      "SELECT stream, kind, after_chunk, lost, time_ns FROM gap "
      "ORDER BY id");
  if (!select) return std::unexpected(select.error());
  std::vector<GapRow> gaps;
  for (;;) {
    const auto row = select->step();
    if (!row) return std::unexpected(row.error());
    if (!*row) return gaps;
    const auto stream = state_->stream_of(select->integer(0));
    if (!stream) return std::unexpected(stream.error());
    gaps.push_back({*stream, static_cast<GapRow::Kind>(select->integer(1)), select->integer(2),
                    sequence_of(select->integer(3)), select->integer(4)});
  }
}

struct Reader::Frames::State {
  Statement select;
  std::uint32_t stream = 0;
  bool raw = false;
};

Reader::Frames::Frames(std::unique_ptr<State> state) : state_(std::move(state)) {}
Reader::Frames::Frames(Frames&&) noexcept = default;
Reader::Frames& Reader::Frames::operator=(Frames&&) noexcept = default;
Reader::Frames::~Frames() = default;

Result<std::optional<FrameRow>> Reader::Frames::next() {
  const auto row = state_->select.step();
  if (!row) return std::unexpected(row.error());
  if (!*row) return std::nullopt;
  return FrameRow{state_->stream, sequence_of(state_->select.integer(0)), state_->raw,
                  state_->select.bytes(1)};
}

Result<Reader::Frames> Reader::frames(std::uint32_t stream, bool raw) const {
  auto select = state_->database.prepare(
      "SELECT sequence, bytes FROM frame WHERE stream=? AND raw=? ORDER BY id");
  if (!select) return std::unexpected(select.error());
  select->bind(std::int64_t{stream}).bind(std::int64_t{raw});
  return Frames(std::make_unique<Frames::State>(Frames::State{std::move(*select), stream, raw}));
}

Result<bool> Reader::has_frames() const {
  const auto any = state_->database.value("SELECT EXISTS(SELECT 1 FROM frame)");
  if (!any) return std::unexpected(any.error());
  return *any == "1";
}

}  // namespace posed::log
