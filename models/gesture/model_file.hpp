// The gesture model's file: the envelope of proto/model/model_file.hpp around
// posed.v1.GestureModel; proto/README.md describes the format and how another program generates a
// motion from it. Cold.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>

#include "models/gesture/gesture_model.hpp"
#include "proto/frame/result.hpp"

namespace posed::gesture {

// Everything that a lookup relies on is checked: each tree is a single tree, its numbers are
// finite, its variances positive, and every label is in exactly one class per finger.
Result<GestureModel> load_model(const std::filesystem::path& path);
// Reads a model as load_model() does, from bytes (control message, device log). `name` is only for
// error messages. Any bytes give a model or an Error, never a crash.
Result<GestureModel> parse_model(std::span<const std::byte> bytes, const std::string& name);
[[nodiscard]] std::string serialize_model(const GestureModel& model);
Result<> save_model(const GestureModel& model, const std::filesystem::path& path);

}  // namespace posed::gesture
