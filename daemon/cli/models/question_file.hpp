// The questions file: which class each finger of each gesture is of (config/gestures/gcp134.toml).
#pragma once

#include <filesystem>
#include <vector>

#include "models/gesture/questions.hpp"
#include "proto/frame/result.hpp"

namespace posed::cli {

// Errors name file and line, or the label that a finger has in no class or in two.
[[nodiscard]] Result<std::vector<gesture::Label>> read_questions(const std::filesystem::path& path);

[[nodiscard]] Result<> write_questions(const std::vector<gesture::Label>& labels,
                                       const std::filesystem::path& path);

}  // namespace posed::cli
