// The questions file: the class of each finger in each gesture (config/gestures/gcp134.toml).
#pragma once

#include <filesystem>
#include <vector>

#include "models/gesture/questions.hpp"
#include "proto/frame/result.hpp"

namespace posed::cli {

// Errors name file and line, or the label in which a finger is in no class or in two.
[[nodiscard]] Result<std::vector<gesture::Label>> read_questions(const std::filesystem::path& path);

[[nodiscard]] Result<> write_questions(const std::vector<gesture::Label>& labels,
                                       const std::filesystem::path& path);

}  // namespace posed::cli
