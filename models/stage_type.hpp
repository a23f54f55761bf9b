// StageType: what the rest of posed knows about a kind of stage: its name, its parameters, its
// models and commands, and how one is made. models/stages/registry.cpp lists all of them. Config,
// control, device log and replay work from this table and know no stage by name. Cold, but for the
// constants.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "models/stage.hpp"
#include "proto/frame/result.hpp"
#include "proto/frame/skeleton.hpp"
#include "proto/text/parameter.hpp"

namespace posed::v1 {
class DecisionValue;
class ModelFile;
}  // namespace posed::v1

namespace posed {

// A stream whose frames a stage gets beside those of its own.
struct StagePartner {
  std::shared_ptr<const Skeleton>
      skeleton{};        // of the frames that it publishes; null: it is not there
  double rate_hz = 0.0;  // nominal; 0: unknown
};

// The stream that a stage is made for.
struct StageContext {
  std::shared_ptr<const Skeleton> skeleton{};  // of the frames that enter; never null
  double rate_hz = 0.0;                        // nominal, of the stream; 0: unknown
  Parameters parameters{};                     // complete
  std::vector<StagePartner> partners{};        // [StageType::partners]
};

// A parameter that contradicts others.
struct ParameterFault {
  std::string_view parameter;  // as people write it
  std::string sentence;
};

// An action of a stage on request, once: "play". Control sends it, the device log keeps it.
struct StageCommandType {
  std::string_view name;
  std::string_view help;
  std::vector<ParameterSpec> options{};
  bool performs = false;       // starts a motion of the stage's own
  std::string_view refusal{};  // the sentence when the stage refuses it at the moment
  // The command for `words` and complete `options`. `model` is the stage's model by the time that
  // the command arrives; null: it has none.
  Result<StageCommand> (*encode)(const StageModel* model, std::span<const std::string> words,
                                 const Parameters& options) = nullptr;
  // The command as the device log keeps it, and back; null when the name says everything. Empty for
  // a value that encode() cannot have made.
  void (*to_log)(const StageCommand& command, v1::DecisionValue& value) = nullptr;
  std::optional<StageCommand> (*from_log)(const v1::DecisionValue& value) = nullptr;
};

// A number that a stage measures while it runs. It goes into the field of posed.v1.StreamStats that
// has its name, which no other stage's reading has. Where that field is a text the number is the
// index of a joint of the skeleton that enters or leaves the stream, and the text its name.
struct StageReadingType {
  std::string_view name;
  std::string_view help;
  bool of_leaving = false;
};

// A sentence that a stage reports by itself, as an event of its stream.
struct StageNoticeType {
  std::string_view sentence;  // without a full stop
  bool is_warning = true;     // else a calibration that took effect
};

// What a stage does with StageFrame::input.
enum class StageInput : std::uint8_t {
  kHandsOn,
  kRenews,  // the frames that leave it have one, whatever entered
  kLoses,   // it holds frames back or makes its own
};

struct StageType {
  std::string_view name;  // no other stage or driver has it; the name of its table in the config
  std::string_view summary;
  std::string_view words{};  // what people read in place of the name; empty: the name will do
  std::vector<ParameterSpec> parameters{};
  // Those parameters, all of them text, that name other streams; an empty name is none. While a
  // partner is not there the stage runs without it; when one comes, the stage is made again.
  std::vector<std::string_view> partners{};
  StageInput input = StageInput::kHandsOn;
  bool needs_input = false;  // without StageFrame::input it does nothing
  bool bridges = false;      // fills in values that are missing

  // Whether a stream without a table for this stage has it all the same; null: never. `bridged`:
  // the config names a stage that fills in values that are missing.
  bool (*is_default)(const Skeleton& skeleton, bool bridged) = nullptr;
  // Checks what the range of a single parameter cannot, before the stage is made; live parameters
  // must be valid in any combination. Null: nothing.
  std::optional<ParameterFault> (*check)(const Parameters& parameters, bool has_model) = nullptr;
  // Replaces the names of files by what the stage needs of them, so that the device log holds all
  // that a replay needs. Null: no parameter names a file.
  Result<> (*read_files)(Parameters& parameters) = nullptr;
  // The skeleton of the frames that leave the stage. The same context gives the same skeleton.
  // Null: that of the frames that enter.
  Result<std::shared_ptr<const Skeleton>> (*leaves)(const StageContext& context) = nullptr;
  // Returns an error for a skeleton that the stage cannot serve. `model` is one that bind_model
  // made for the same context; null: none. It outlives the stage, or its successor does.
  Result<std::unique_ptr<Stage>> (*make)(const StageContext& context, const StageModel* model);

  // A stage with a model; all null for one without.
  bool model_required = false;
  bool (*takes)(const v1::ModelFile& file) = nullptr;  // whether the file is for this stage
  // Streams of one skeleton and rate may share what is bound, so it depends on nothing else of the
  // context.
  Result<std::unique_ptr<const StageModel>> (*bind_model)(std::span<const std::byte> file,
                                                          const StageContext& context,
                                                          const std::string& name) = nullptr;

  std::vector<StageReadingType> readings{};
  std::vector<StageNoticeType> notices{};
  std::vector<StageCommandType> commands{};
  // The command that the parameters ask for at the start of a live run (index in `commands`), if
  // any; null: never. `file` is the model's, which `model` was bound from; empty without a model.
  struct FirstCommand {
    std::size_t index;
    StageCommand command;
  };
  Result<std::optional<FirstCommand>> (*first_command)(const Parameters& parameters,
                                                       const StageModel* model,
                                                       std::span<const std::byte> file) = nullptr;

  [[nodiscard]] bool has_model() const noexcept { return bind_model != nullptr; }
};

// Live parameters that are text of no fixed words, such as the weights of styles: what they mean
// may depend on the stage's model, and the stage gets it in a form of its own. So the stage's type
// has a command of the same name, whose only word is the text; control, device log and replay
// handle the parameter as that command. This is its index in StageType::commands; empty for a
// parameter that is no such text.
[[nodiscard]] inline std::optional<std::size_t> text_command(const StageType& type,
                                                             const ParameterSpec& spec) noexcept {
  if (!spec.live || has_number(spec)) return std::nullopt;
  const auto found = std::ranges::find(type.commands, spec.name, &StageCommandType::name);
  if (found == type.commands.end()) return std::nullopt;
  return static_cast<std::size_t>(found - type.commands.begin());
}

// Whether this command is the one of a live text.
[[nodiscard]] inline bool is_live_text(const StageType& type, std::string_view command) noexcept {
  const ParameterSpec* const spec = find_parameter(type.parameters, command);
  return spec != nullptr && text_command(type, *spec).has_value();
}

}  // namespace posed
