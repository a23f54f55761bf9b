// What a request to a stage means, worked out from the tables of the stream's stages. Requests are
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

// The change that a SetParameter asks for, checked against the parameter's type and range.
Result<pipeline::StageChange> parameter_change(const pipeline::StreamSettings& settings,
                                               const v1::ControlRequest::SetParameter& wanted);

// The same as a request for the stage's command, where the parameter is a live text
// (models/live_text.hpp): the pieces between its commas are the words. Nothing for another one.
Result<std::optional<v1::ControlRequest>> text_change(
    const pipeline::StreamSettings& settings, const v1::ControlRequest::SetParameter& wanted);

struct FoundCommand {
  std::size_t stage = 0;  // index in the stream's stages
  pipeline::StageChange change;
};
// `name` is "generate.play", or "play" where only one stage has such a command.
Result<FoundCommand> find_command(const pipeline::StreamSettings& settings,
                                  const std::string& name);

// The words of a command as one text, with the commas between which they stood.
[[nodiscard]] std::string joined_words(const v1::ControlRequest::StageCommand& wanted);

// `model` is the stage's model by the time that the command arrives; it may be null.
Result<StageCommand> encode_command(const StageCommandType& type, const StageModel* model,
                                    const v1::ControlRequest::StageCommand& wanted);

// The index of the stage for which a model file is. `name` is the file's, for errors.
Result<std::size_t> stage_for_model(const pipeline::StreamSettings& settings,
                                    std::span<const std::byte> file, const std::string& name);

}  // namespace posed::control
