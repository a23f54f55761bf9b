// PlayOrder: a label sequence to perform, as indices into one model; trivially copyable and small
// enough for a lock-free ring.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "models/gesture/gesture_model.hpp"
#include "proto/frame/result.hpp"

namespace posed::gesture {

inline constexpr int kMaxLabels = 256;  // most labels of one order
inline constexpr double kMinTempo = 0.5, kMaxTempo = 2.0;

struct PlayOrder {
  float tempo = 1.0F;                             // kMinTempo to kMaxTempo; 2 takes half the time
  bool loop = false;                              // begin again after the last label
  std::uint16_t size = 0;                         // labels in use
  std::array<std::uint16_t, kMaxLabels> label{};  // indices into GestureModel::labels

  [[nodiscard]] std::span<const std::uint16_t> labels() const noexcept {
    return std::span(label).first(size);
  }
};
static_assert(std::is_trivially_copyable_v<PlayOrder>);

// The order for these label names. Errors: a name that the model does not know (the message lists
// the known ones), no labels, too many labels, a tempo (duration scale) out of range. Cold.
Result<PlayOrder> make_play_order(const GestureModel& model, std::span<const std::string> names,
                                  double tempo, bool loop);

// "g 1  c" -> g, 1, c.
[[nodiscard]] std::vector<std::string> split_labels(const std::string& text);

}  // namespace posed::gesture
