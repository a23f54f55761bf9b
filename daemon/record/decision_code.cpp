#include "daemon/record/decision_code.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <string_view>
#include <variant>

#include "models/stage_type.hpp"
#include "models/stages/registry.hpp"
#include "posed/v1/log.pb.h"
#include "proto/log/reader.hpp"

namespace posed::record {
namespace {

using pipeline::Decision;
using pipeline::StageChange;
using Value = v1::DecisionValue;
namespace words = log::words;

// The names of the engine's own decisions. A change to a stage is stored under the names of the
// stage and of its parameter, its command or "model".
struct EngineWord {
  Decision::Kind kind;
  std::string_view name;
  bool has_range;
};
constexpr std::array kEngineWords{
    EngineWord{Decision::Kind::kShed, words::kShed, true},
    EngineWord{Decision::Kind::kShedSamples, words::kShedSamples, true},
    EngineWord{Decision::Kind::kTick, words::kTick, false},
    EngineWord{Decision::Kind::kEnd, words::kEnd, false},
};

std::string_view name_of(const StageChange& change) {
  switch (change.kind) {
    case StageChange::Kind::kSet:
      return change.type->parameters[change.index].name;
    case StageChange::Kind::kCommand:
      return change.type->commands[change.index].name;
    case StageChange::Kind::kModel:
      break;
  }
  return words::kModel;
}

void write_change(const Decision& decision, Value& value) {
  const StageChange& change = decision.change;
  switch (change.kind) {
    case StageChange::Kind::kSet:
      if (std::holds_alternative<bool>(change.type->parameters[change.index].default_value)) {
        value.set_flag(change.value != 0.0);
      } else {
        value.set_number(change.value);
      }
      return;
    case StageChange::Kind::kModel:
      value.set_sha256(decision.model_hash.data());
      return;
    case StageChange::Kind::kCommand:
      if (const auto to_log = change.type->commands[change.index].to_log) {
        to_log(decision.command, value);
      }
      return;
  }
}

// Each of the following reads one kind of value; false if no pipeline can have written it.
bool read_set(const ParameterSpec& spec, const Value& value, Decision& decision) {
  const bool flag = std::holds_alternative<bool>(spec.default_value);
  if (value.value_case() != (flag ? Value::kFlag : Value::kNumber)) return false;
  decision.change.value = flag ? (value.flag() ? 1.0 : 0.0) : value.number();
  return spec.live && takes_number(spec, decision.change.value);
}

bool read_hash(const Value& value, Decision& decision) {
  const std::string& sha256 = value.sha256();
  const bool none = sha256.empty();  // the model was taken away
  if (value.value_case() != Value::kSha256 ||
      (!none && sha256.size() + 1 != decision.model_hash.size())) {
    return false;
  }
  std::ranges::copy(sha256, decision.model_hash.begin());
  return true;
}

bool read_command(const StageCommandType& type, const Value& value, Decision& decision) {
  if (type.from_log == nullptr) return value.value_case() == Value::VALUE_NOT_SET;
  const auto command = type.from_log(value);
  if (command) decision.command = *command;
  return command.has_value();
}

bool read_change(const StageType& type, std::string_view name, const Value& value,
                 Decision& decision) {
  decision.kind = Decision::Kind::kChange;
  StageChange& change = decision.change;
  change.type = &type;
  if (name == words::kModel && type.has_model()) {
    change.kind = StageChange::Kind::kModel;
    return read_hash(value, decision);
  }
  for (std::size_t i = 0; i < type.parameters.size(); ++i) {
    if (type.parameters[i].name != name) continue;
    if (text_command(type, type.parameters[i])) break;
    change.index = static_cast<std::uint8_t>(i);
    return read_set(type.parameters[i], value, decision);
  }
  change.kind = StageChange::Kind::kCommand;
  for (std::size_t i = 0; i < type.commands.size(); ++i) {
    if (type.commands[i].name != name) continue;
    change.index = static_cast<std::uint8_t>(i);
    return read_command(type.commands[i], value, decision);
  }
  return false;
}

bool read_engine(std::string_view name, const Value& value, Decision& decision) {
  const auto word = std::ranges::find(kEngineWords, name, &EngineWord::name);
  if (word == kEngineWords.end()) return false;
  decision.kind = word->kind;
  if (!word->has_range) return value.value_case() == Value::VALUE_NOT_SET;
  decision.sequence = value.range().first();
  decision.count = value.range().count();
  return decision.sequence > 0 &&
         decision.count <= std::numeric_limits<std::uint64_t>::max() - decision.sequence;
}

}  // namespace

log::DecisionRow row_of(const Decision& decision) {
  log::DecisionRow row;
  row.item = decision.item;
  row.stream = decision.stream;
  row.now_ns = decision.now_ns;
  Value value;
  if (decision.kind == Decision::Kind::kChange) {
    row.stage = decision.change.type->name;
    row.name = name_of(decision.change);
    write_change(decision, value);
  } else {
    const auto word = std::ranges::find(kEngineWords, decision.kind, &EngineWord::kind);
    row.stage = words::kEngine;
    row.name = word->name;
    if (word->has_range) {
      value.mutable_range()->set_first(decision.sequence);
      value.mutable_range()->set_count(decision.count);
    }
  }
  row.value = value.SerializeAsString();
  return row;
}

Result<Decision> decision_of(const log::DecisionRow& row, const std::string& file) {
  Decision decision{.stream = row.stream, .item = row.item, .now_ns = row.now_ns};
  Value value;
  bool valid = value.ParseFromString(row.value);
  if (valid && row.stage == words::kEngine) {
    valid = read_engine(row.name, value, decision);
  } else if (valid) {
    const StageType* type = find_stage_type(row.stage);
    valid = type != nullptr && read_change(*type, row.name, value, decision);
  }
  if (!valid) return log::damaged_row(file, "decision", row.id, "makes no sense");
  return decision;
}

}  // namespace posed::record
