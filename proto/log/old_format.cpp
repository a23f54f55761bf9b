#include "proto/log/old_format.hpp"

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <limits>
#include <utility>

#include <nlohmann/json.hpp>

#include "posed/v1/log.pb.h"
#include "proto/text/json_text.hpp"

namespace posed::log::old_format {
namespace {

using nlohmann::ordered_json;

// The values of the column `kind` in the old decision table.
enum class Kind : std::int64_t {
  kAlpha = 1,
  kModel = 2,
  kShed = 3,
  kTick = 4,
  kGesture = 5,
  kPlay = 6,
  kStopPlaying = 7
};

// A number that does not fit a one-byte column becomes a value that no valid row has.
std::uint8_t byte_of(std::int64_t stored) {
  constexpr std::int64_t kMost = std::numeric_limits<std::uint8_t>::max();
  return static_cast<std::uint8_t>(stored < 0 ? kMost : std::min(stored, kMost));
}

std::uint64_t unsigned_of(std::int64_t stored) { return static_cast<std::uint64_t>(stored); }

// In the old formats the stages were members of a stream's settings and the style model a column.
ordered_json stages_of(const ordered_json& old, const std::string& style_model) {
  ordered_json stages = ordered_json::array();
  const std::string name = old.value("model_name", "");
  if (old.contains("style")) {
    stages.push_back({{"stage", words::kStyle},
                      {"model", style_model},
                      {"model_name", name},
                      {"parameters", old.at("style")}});
  }
  if (old.contains("generate")) {
    ordered_json parameters = old.at("generate");
    const std::string model = parameters.value("model", "");
    parameters.erase("model");
    stages.push_back({{"stage", words::kGenerate},
                      {"model", model},
                      {"model_name", stages.empty() ? name : ""},
                      {"parameters", std::move(parameters)}});
  }
  if (old.value("constrain", false)) {
    stages.push_back({{"stage", words::kConstrain}, {"parameters", ordered_json::object()}});
  }
  return stages;
}

Result<std::string> stages_json(const std::string& config, const std::string& style_model,
                                const std::string& file) {
  try {
    const auto old = ordered_json::parse(config);
    return json_text(ordered_json{{"publish_raw", old.at("publish_raw")},
                                  {"stale_after_s", old.at("stale_after_s")},
                                  {"rate_hz", old.at("rate_hz")},
                                  {"stages", stages_of(old, style_model)}});
  } catch (const nlohmann::json::exception& error) {
    return fail("the log is damaged (a stream's settings: " + std::string(error.what()) + ")",
                file);
  }
}

// "0 4 1" means labels 0, 4 and 1. An invalid word empties the list; no valid play order is empty.
void read_labels(std::string_view text, v1::DecisionValue::PlayOrder& order) {
  while (!text.empty()) {
    std::uint16_t label = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), label);
    if (error != std::errc()) return order.clear_label();
    order.add_label(label);
    text.remove_prefix(static_cast<std::size_t>(end - text.data()));
    text.remove_prefix(std::min(text.find_first_not_of(' '), text.size()));
  }
}

}  // namespace

Result<Streams> read_streams(Database& database, const std::string& file) {
  auto select = database.prepare(
      "SELECT id, name, driver, text, identity, config, model FROM stream ORDER BY id");
  if (!select) return std::unexpected(select.error());
  Streams found;
  for (;;) {
    const auto row = select->step();
    if (!row) return std::unexpected(row.error());
    if (!*row) return found;
    const auto text = [&](int column) { return std::string(select->text(column)); };
    const auto id = static_cast<std::uint32_t>(found.sources.size());
    if (select->integer(0) != std::int64_t{id}) {
      return fail("the log is damaged (its streams are not numbered 0, 1, 2, ...)", file);
    }
    auto stages = stages_json(text(5), text(6), file);
    if (!stages) return std::unexpected(stages.error());
    found.sources.push_back({id, text(1), text(2), text(3), text(4), "{}"});
    found.streams.push_back({id, id, "", text(1), std::move(*stages), 0});
  }
}

Result<Statement> select_chunks(Database& database) {
  return database.prepare(
      "SELECT id, stream, direction, arrival_ns, next_sequence, bytes FROM chunk ORDER BY id");
}

ChunkRow chunk(const Statement& row, std::vector<StreamPosition>& places) {
  const auto stream = static_cast<std::uint32_t>(row.integer(1));
  places.assign(1, {stream, unsigned_of(row.integer(4)), 0});
  return {.id = row.integer(0),
          .source = stream,
          .socket = 0,
          .direction = byte_of(row.integer(2)),
          .arrival_ns = row.integer(3),
          .first_item = 0,
          .places = places,
          .bytes = row.bytes(5)};
}

Result<Statement> select_decisions(Database& database) {
  const auto labels =
      database.value("SELECT count(*) FROM pragma_table_info('decision') WHERE name='labels'");
  if (!labels) return std::unexpected(labels.error());
  // Format 1 had no play command, so its rows have no labels.
  return database.prepare("SELECT id, stream, kind, sequence, count, now_ns, alpha, model_hash, " +
                          std::string(*labels == "1" ? "labels" : "''") +
                          " FROM decision ORDER BY id");
}

DecisionRow decision(const Statement& row) {
  v1::DecisionValue value;
  DecisionRow decision{.id = row.integer(0),
                       .item = 0,
                       .stream = static_cast<std::uint32_t>(row.integer(1)),
                       .stage = words::kEngine,
                       .name = {},
                       .value = {},
                       .now_ns = row.integer(5),
                       .before_frame = unsigned_of(row.integer(3))};
  const auto say = [&](const char* stage, const char* name) {
    decision.stage = stage;
    decision.name = name;
  };
  switch (static_cast<Kind>(row.integer(2))) {
    case Kind::kAlpha:
      say(words::kStyle, words::kAlpha);
      value.set_number(row.real(6));
      break;
    case Kind::kModel:
      say(words::kStyle, words::kModel);
      value.set_sha256(std::string(row.text(7)));
      break;
    case Kind::kShed:
      say(words::kEngine, words::kShed);
      value.mutable_range()->set_first(decision.before_frame);
      value.mutable_range()->set_count(unsigned_of(row.integer(4)));
      break;
    case Kind::kTick:
      say(words::kEngine, words::kTick);
      break;
    case Kind::kGesture:
      say(words::kGenerate, words::kModel);
      value.set_sha256(std::string(row.text(7)));
      break;
    case Kind::kPlay:
      say(words::kGenerate, words::kPlay);
      read_labels(row.text(8), *value.mutable_play());
      value.mutable_play()->set_tempo(static_cast<float>(row.real(6)));
      value.mutable_play()->set_loop(row.integer(4) != 0);
      break;
    case Kind::kStopPlaying:
      say(words::kGenerate, words::kStopPlaying);
      break;
    default:
      say(words::kEngine, "unknown");
  }
  decision.value = value.SerializeAsString();
  return decision;
}

Result<Statement> select_gaps(Database& database) {
  return database.prepare(
      "SELECT id, kind, stream, after_chunk, lost, time_ns FROM gap ORDER BY id");
}

GapRow gap(const Statement& row) {
  return {.kind = static_cast<GapRow::Kind>(byte_of(row.integer(1))),
          .owner = static_cast<std::uint32_t>(row.integer(2)),
          .after_chunk = row.integer(3),
          .lost = unsigned_of(row.integer(4)),
          .time_ns = row.integer(5)};
}

}  // namespace posed::log::old_format
