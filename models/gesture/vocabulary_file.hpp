// The vocabulary's part of a gesture model's file: labels with their classes, and of a body its
// joints and groups (proto/README.md). Cold.
#pragma once

#include "models/gesture/vocabulary.hpp"
#include "posed/v1/model.pb.h"
#include "proto/model/validator.hpp"

namespace posed::gesture {

// What is wrong goes to `check`; `vocabulary` may be used only if that is sound.
void read_vocabulary(const v1::GestureModel& from, Vocabulary& vocabulary,
                     model_file::Validator& check);
void write_vocabulary(const Vocabulary& vocabulary, v1::GestureModel& out);

}  // namespace posed::gesture
