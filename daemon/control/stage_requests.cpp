#include "daemon/control/stage_requests.hpp"

#include <algorithm>
#include <functional>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "models/stage_type.hpp"
#include "models/stages/registry.hpp"
#include "proto/model/model_file.hpp"
#include "proto/text/clean.hpp"
#include "proto/text/list.hpp"

namespace posed::control {
namespace {

using pipeline::StageChange;
using pipeline::StreamSettings;

constexpr int kMaxWords = 256;
constexpr std::size_t kMaxWord = 64;  // bytes
constexpr int kMaxNumbers = 16;

// Splits "style.alpha"; the stage is empty for "alpha".
std::pair<std::string_view, std::string_view> split(std::string_view name) {
  const auto dot = name.find('.');
  if (dot == std::string_view::npos) return {{}, name};
  return {name.substr(0, dot), name.substr(dot + 1)};
}

// One parameter or command of one stage of a stream.
struct Place {
  std::size_t stage = 0;
  std::size_t index = 0;
};

// The names of a table's entries, read through the member `name`.
template <typename Table, typename Name>
std::vector<std::string_view> names_of(const Table& table, Name name) {
  std::vector<std::string_view> names(table.size());
  std::ranges::transform(table, names.begin(),
                         [&](const auto& entry) { return std::invoke(name, entry); });
  return names;
}

// Where `name` stands in a stage's table. `entries(type)` are the names in the table, empty ones
// for what cannot be named.
template <typename Entries>
std::optional<std::size_t> index_in(const StageType& type, const std::string& name,
                                    const Entries& entries) {
  const auto [stage_name, entry_name] = split(name);
  if (!stage_name.empty() && stage_name != type.name) return std::nullopt;
  const auto names = entries(type);
  const auto found = std::ranges::find(names, entry_name);
  if (found == names.end()) return std::nullopt;
  return static_cast<std::size_t>(found - names.begin());
}

// `what` is "parameter" or "command".
template <typename Entries>
Result<Place> find_place(const StreamSettings& settings, const std::string& name, const char* what,
                         const Entries& entries) {
  std::vector<Place> found;
  std::vector<std::string> known;
  for (std::size_t stage = 0; stage < settings.stages.size(); ++stage) {
    const StageType& type = *settings.stages[stage].type;
    for (const std::string_view entry : entries(type)) {
      known.push_back(fmt::format("{}.{}", type.name, entry));
    }
    if (const auto index = index_in(type, name, entries)) found.push_back({stage, *index});
  }
  if (found.size() == 1) return found.front();
  if (found.size() > 1) {
    return fail(fmt::format("{} is the name of several {}s; put the stage before it: {}",
                            in_quotes(name), what, fmt::join(known, ", ")));
  }
  for (const StageType* type : stage_types()) {
    if (!index_in(*type, name, entries)) continue;
    return fail(
        fmt::format("{0} is a {1} of stage {2}, which the stream does not have; give it a"
                    " [stream.{2}] table in the config and start again",
                    in_quotes(name), what, type->name));
  }
  return fail(fmt::format("there is no {} {}; there is: {}", what, in_quotes(name),
                          known.empty() ? "none" : joined(known)));
}

ParameterValue value_in(const v1::ControlRequest::SetParameter& wanted) {
  switch (wanted.value_case()) {
    case v1::ControlRequest::SetParameter::kNumber:
      return wanted.number();
    case v1::ControlRequest::SetParameter::kFlag:
      return wanted.flag();
    default:
      return wanted.text();
  }
}

// Options come as numbers, whatever their type: a flag as 0 or 1.
Result<Parameters> options_of(const StageCommandType& type,
                              const v1::ControlRequest::StageCommand& wanted) {
  Parameters given;
  for (const auto& [name, number] : wanted.number()) {
    const auto spec = std::ranges::find(type.options, name, &ParameterSpec::shown_name);
    if (spec == type.options.end()) {
      return fail(fmt::format("{} takes no {}", type.name, in_quotes(name)));
    }
    const bool flag = std::holds_alternative<bool>(spec->default_value);
    const bool is_flag = flag && (number == 0.0 || number == 1.0);
    const auto value = TRY(from_display(
        *spec, is_flag ? ParameterValue(number == 1.0) : ParameterValue(number), name));
    given.emplace(spec->name, value);
  }
  return complete_parameters(type.options, given);
}

Result<Place> find_parameter_place(const StreamSettings& settings, const std::string& name) {
  const auto names = [](const StageType& type) {
    return names_of(type.parameters, &ParameterSpec::shown_name);
  };
  return find_place(settings, name, "parameter", names);
}

}  // namespace

Result<StageChange> parameter_change(const StreamSettings& settings,
                                     const v1::ControlRequest::SetParameter& wanted) {
  const auto place = TRY(find_parameter_place(settings, wanted.name()));
  const StageType& type = *settings.stages[place.stage].type;
  const ParameterSpec& spec = type.parameters[place.index];
  if (!spec.live) {
    return fail(
        fmt::format("{} cannot change while the daemon runs; set it in [stream.{}] and start"
                    " again",
                    spec.shown_name(), type.name));
  }
  const auto value = TRY(from_display(spec, value_in(wanted), spec.shown_name()));
  return StageChange{.kind = StageChange::Kind::kSet,
                     .index = static_cast<std::uint8_t>(place.index),
                     .type = &type,
                     .value = number_of(spec, value)};
}

Result<std::optional<v1::ControlRequest>> text_change(
    const StreamSettings& settings, const v1::ControlRequest::SetParameter& wanted) {
  const auto place = TRY(find_parameter_place(settings, wanted.name()));
  const StageType& type = *settings.stages[place.stage].type;
  const ParameterSpec& spec = type.parameters[place.index];
  if (!text_command(type, spec)) return std::nullopt;
  const auto value = TRY(from_display(spec, value_in(wanted), spec.shown_name()));
  v1::ControlRequest request;
  auto& command = *request.mutable_stage_command();
  command.set_stream(wanted.stream());
  command.set_name(fmt::format("{}.{}", type.name, spec.name));
  std::string_view rest = std::get<std::string>(value);
  while (!rest.empty()) {
    const auto comma = rest.find(',');
    command.add_word(std::string(rest.substr(0, comma)));
    if (comma + 1 == rest.size()) command.add_word("");  // it ends in a comma
    rest.remove_prefix(comma == std::string_view::npos ? rest.size() : comma + 1);
  }
  return request;
}

Result<FoundCommand> find_command(const StreamSettings& settings, const std::string& name) {
  const auto names = [](const StageType& type) {
    return names_of(type.commands, &StageCommandType::name);
  };
  const auto place = TRY(find_place(settings, name, "command", names));
  return FoundCommand{.stage = place.stage,
                      .change = {.kind = StageChange::Kind::kCommand,
                                 .index = static_cast<std::uint8_t>(place.index),
                                 .type = settings.stages[place.stage].type}};
}

std::string joined_words(const v1::ControlRequest::StageCommand& wanted) {
  return joined(wanted.word(), ",");
}

Result<StageCommand> encode_command(const StageCommandType& type, const StageModel* model,
                                    const v1::ControlRequest::StageCommand& wanted) {
  if (wanted.word_size() > kMaxWords || wanted.number_size() > kMaxNumbers) {
    return fail(fmt::format("{} has too many words or options; it takes at most {} and {}",
                            type.name, kMaxWords, kMaxNumbers));
  }
  for (const std::string& word : wanted.word()) {
    if (word.size() <= kMaxWord) continue;
    return fail(
        fmt::format("{} is too long: a word has at most {} bytes", in_quotes(word), kMaxWord));
  }
  const auto options = TRY(options_of(type, wanted));
  const std::vector<std::string> words(wanted.word().begin(), wanted.word().end());
  return type.encode(model, words, options);
}

Result<std::size_t> stage_for_model(const StreamSettings& settings, std::span<const std::byte> file,
                                    const std::string& name) {
  const auto opened = TRY(model_file::open(file, name));
  const auto takes = [&](const StageType& type) {
    return type.takes != nullptr && type.takes(opened);
  };
  for (std::size_t i = 0; i < settings.stages.size(); ++i) {
    if (takes(*settings.stages[i].type)) return i;
  }
  for (const StageType* type : stage_types()) {
    if (!takes(*type)) continue;
    return fail(
        fmt::format("{0} is a model for stage {1}, which the stream does not have; give it a"
                    " [stream.{1}] table in the config and start again",
                    name, type->name));
  }
  return fail(fmt::format("{} is a model that no stage of this posed takes; update posed", name));
}

}  // namespace posed::control
