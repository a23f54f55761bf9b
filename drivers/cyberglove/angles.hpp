// Converts sensor values to the joint angles of the maker's library: gains, relative abductions,
// computed distal joints, and the mirrored left hand. Sources: vt_glove.cpp in VR Juggler, and
// ltaquet's calibrateCGdata.m, which was written from the CyberGlove III SDK and agrees.
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

// 23 sensors by name, in mask order, with curves of default gains. A raw value is an 8-bit count;
// the 16-bit form adds steps of a sixteenth. Cold.
Result<glove::Model> glove_model(Side hand);

// Index in Calibration::parameter.
inline constexpr std::size_t kAbductionBias = 0;

// Turns calibrated values [23] into the library's angles [rad], in place: flexion negative,
// abductions absolute. Distal joints that `fitted` lacks are computed.
RT_SAFE void compute_angles(float abduction_bias, Side hand, std::uint32_t fitted,
                            std::span<float> value, Valid& valid) noexcept;

// The inverse, for emulators: angles as compute_angles gives them to calibrated values. The middle
// finger's own abduction is lost, because the sensors measure only differences.
void uncompute_angles(Side hand, std::span<double> value) noexcept;

}  // namespace posed::drivers::cyberglove
