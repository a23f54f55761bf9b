// Finds out what a request to a stage means, by the tables of the stream's stages. Requests are
// untrusted. Every error is a sentence for the client. Cold.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>

#include "daemon/pipeline/messages.hpp"
#include "daemon/pipeline/stream_settings.hpp"
#include "posed/v1/control.pb.h"
#include "proto/frame/result.hpp"

namespace posed::control {

// Returns the change that a SetParameter asks for, checked against the parameter's type and range;
// not for a live text, which text_change() knows.
Result<pipeline::StageChange> parameter_change(const pipeline::StreamSettings& settings,
                                               const v1::ControlRequest::SetParameter& wanted);

// If the parameter is a live text (models/live_text.hpp), returns the StageCommand that sets it,
// whose words are the pieces of the text between commas. Otherwise returns nullopt.
Result<std::optional<v1::ControlRequest>> text_change(
    const pipeline::StreamSettings& settings, const v1::ControlRequest::SetParameter& wanted);

struct FoundCommand {
  std::size_t stage = 0;         // index in the stream's stages
  pipeline::StageChange change;  // without the words, which encode_command() adds
};
// Finds a command by its name: "generate.play", or "play" if only one stage has such a command.
Result<FoundCommand> find_command(const pipeline::StreamSettings& settings,
                                  const std::string& name);

// Returns the words of a command as one text with commas between them, as text_change() took it.
[[nodiscard]] std::string joined_words(const v1::ControlRequest::StageCommand& wanted);

// Encodes a command for its stage. `model` is the one that the stage will have when the command
// arrives; null: none.
Result<StageCommand> encode_command(const StageCommandType& type, const StageModel* model,
                                    const v1::ControlRequest::StageCommand& wanted);

// Returns the index of the first stage that takes this model file. `name` is the file's, for
// errors.
Result<std::size_t> stage_for_model(const pipeline::StreamSettings& settings,
                                    std::span<const std::byte> file, const std::string& name);

}  // namespace posed::control
