// From sensor values to the angles of the maker's library: gains, relative abductions, computed
// distal joints, the left hand mirrored. Sources: vt_glove.cpp in VR Juggler, and ltaquet's
// calibrateCGdata.m, which was written from the CyberGlove III SDK and agrees.
#pragma once

#include <bitset>
#include <cstdint>
#include <span>

#include "drivers/cyberglove/protocol.hpp"
#include "drivers/glove/model.hpp"
#include "proto/frame/hand.hpp"
#include "proto/frame/result.hpp"

namespace posed::drivers::cyberglove {

using Valid = std::bitset<glove::kMaxSensors>;

// 23 sensors by name, in mask order, curves of default gains; a raw value is an 8-bit count, in
// sixteenths for the 16-bit form. Cold.
[[nodiscard]] Result<glove::Model> glove_model(Side hand);

// Place in Calibration::parameter.
inline constexpr std::size_t kAbductionBias = 0;

// Calibrated values [23] to the library's angles [rad], in place: flexion negative, abductions
// absolute; distal joints that `fitted` lacks are computed. RT-safe.
void compute_angles(float abduction_bias, Side hand, std::uint32_t fitted, std::span<float> value,
                    Valid& valid) noexcept;

// The way back for emulators: angles as compute_angles gives them to calibrated values. What the
// middle finger's own abduction was is lost: sensors only know differences.
void uncompute_angles(Side hand, std::span<double> value) noexcept;

}  // namespace posed::drivers::cyberglove
