#include "daemon/record/decision_code.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string_view>

#include "models/style/style_filter.hpp"
#include "posed/v1/log.pb.h"
#include "proto/log/reader.hpp"

namespace posed::record {
namespace {

using Kind = pipeline::Decision::Kind;
using Value = v1::DecisionValue;
namespace words = log::words;

// The stage and name under which a decision is stored, and the type of its value.
struct Spelling {
  Kind kind;
  std::string_view stage, name;
  Value::ValueCase value;
};
constexpr std::array kSpellings{
    Spelling{Kind::kAlpha, words::kStyle, words::kAlpha, Value::kNumber},
    Spelling{Kind::kModel, words::kStyle, words::kModel, Value::kSha256},
    Spelling{Kind::kShed, words::kEngine, words::kShed, Value::kRange},
    Spelling{Kind::kShedSamples, words::kEngine, words::kShedSamples, Value::kRange},
    Spelling{Kind::kTick, words::kEngine, words::kTick, Value::VALUE_NOT_SET},
    Spelling{Kind::kEnd, words::kEngine, words::kEnd, Value::VALUE_NOT_SET},
    Spelling{Kind::kGesture, words::kGenerate, words::kModel, Value::kSha256},
    Spelling{Kind::kPlay, words::kGenerate, words::kPlay, Value::kPlay},
    Spelling{Kind::kStopPlaying, words::kGenerate, words::kStopPlaying, Value::VALUE_NOT_SET},
};

const Spelling* find(std::string_view stage, std::string_view name) {
  const auto found = std::ranges::find_if(kSpellings, [&](const Spelling& spelling) {
    return spelling.stage == stage && spelling.name == name;
  });
  return found == kSpellings.end() ? nullptr : &*found;
}

// Each reads one kind of value; false if no pipeline can have written it.
bool read_alpha(double alpha, pipeline::Decision& decision) {
  decision.alpha = static_cast<float>(alpha);
  return std::abs(alpha) <= style::kMaxAlpha;  // false for NaN
}

bool read_range(const Value::Range& range, pipeline::Decision& decision) {
  decision.sequence = range.first();
  decision.count = range.count();
  return range.first() > 0 &&
         range.count() <= std::numeric_limits<std::uint64_t>::max() - range.first();
}

bool read_hash(const std::string& sha256, pipeline::Decision& decision) {
  if (sha256.size() + 1 != decision.model_hash.size()) return false;
  std::ranges::copy(sha256, decision.model_hash.begin());
  return true;
}

bool read_play(const Value::PlayOrder& play, pipeline::Decision& decision) {
  constexpr std::uint32_t kMaxLabelIndex = std::numeric_limits<std::uint16_t>::max();
  gesture::PlayOrder& order = decision.play;
  const auto count = static_cast<std::size_t>(play.label_size());
  if (count == 0 || count > order.label.size()) return false;
  for (const std::uint32_t label : play.label()) {
    if (label > kMaxLabelIndex) return false;
    order.label[order.size++] = static_cast<std::uint16_t>(label);
  }
  order.tempo = play.tempo();
  order.loop = play.loop();
  return order.tempo >= static_cast<float>(gesture::kMinTempo) &&
         order.tempo <= static_cast<float>(gesture::kMaxTempo);
}

bool read_value(const Value& value, pipeline::Decision& decision) {
  switch (value.value_case()) {
    case Value::kNumber:
      return read_alpha(value.number(), decision);
    case Value::kRange:
      return read_range(value.range(), decision);
    case Value::kSha256:
      return read_hash(value.sha256(), decision);
    case Value::kPlay:
      return read_play(value.play(), decision);
    default:
      return true;
  }
}

}  // namespace

log::DecisionRow row_of(const pipeline::Decision& decision) {
  const Spelling& spelling =
      *std::ranges::find(kSpellings, decision.kind, [](const Spelling& one) { return one.kind; });
  Value value;
  switch (spelling.value) {
    case Value::kNumber:
      value.set_number(decision.alpha);
      break;
    case Value::kRange:
      value.mutable_range()->set_first(decision.sequence);
      value.mutable_range()->set_count(decision.count);
      break;
    case Value::kSha256:
      value.set_sha256(decision.model_hash.data());
      break;
    case Value::kPlay:
      for (const std::uint16_t label : decision.play.labels()) {
        value.mutable_play()->add_label(label);
      }
      value.mutable_play()->set_tempo(decision.play.tempo);
      value.mutable_play()->set_loop(decision.play.loop);
      break;
    default:
      break;
  }
  return {.item = decision.item,
          .stream = decision.stream,
          .stage = std::string(spelling.stage),
          .name = std::string(spelling.name),
          .value = value.SerializeAsString(),
          .now_ns = decision.now_ns};
}

Result<pipeline::Decision> decision_of(const log::DecisionRow& row, const std::string& file) {
  pipeline::Decision decision{
      .stream = row.stream, .item = row.item, .sequence = row.before_frame, .now_ns = row.now_ns};
  Value value;
  const Spelling* spelling = find(row.stage, row.name);
  if (spelling != nullptr) decision.kind = spelling->kind;
  if (spelling == nullptr || !value.ParseFromString(row.value) ||
      value.value_case() != spelling->value || !read_value(value, decision)) {
    return log::damaged_row(file, "decision", row.id, "makes no sense");
  }
  return decision;
}

}  // namespace posed::record
