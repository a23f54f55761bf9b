// The questions file: the class of each finger in each gesture (config/gestures/gcp134.toml), or of
// each group of a body's joints (config/gestures/raise-arms.toml).
#pragma once

#include <filesystem>

#include "models/gesture/questions.hpp"
#include "proto/frame/result.hpp"

namespace posed::tools {

// A file whose tables have joints is a body's. Errors name file and line, or the label in which a
// finger or group is in no class or in two.
Result<gesture::Vocabulary> read_questions(const std::filesystem::path& path);

Result<> write_questions(const gesture::Vocabulary& vocabulary, const std::filesystem::path& path);

}  // namespace posed::tools
