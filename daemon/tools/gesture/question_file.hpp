// The questions file: the class of each finger in each gesture (config/gestures/gcp134.toml), or of
// each group of a body's joints (config/gestures/raise-arms.toml).
#pragma once

#include <filesystem>

#include "models/gesture/questions.hpp"
#include "proto/frame/result.hpp"

namespace posed::tools {

// A file is a body's whose tables have joints, or of which no table is a finger's. Errors name file
// and line, or the label in which a finger or group is in no class or in two.
Result<gesture::Vocabulary> read_questions(const std::filesystem::path& path);

// Writes a proposal for people: it has no `named`.
Result<> write_questions(const gesture::Vocabulary& vocabulary, const std::filesystem::path& path);

}  // namespace posed::tools
